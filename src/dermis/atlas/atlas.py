"""Atlas of a mesh: the surface point at each texel of a uv layout, and the metric of the uv coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints, Mask
from dermis.mesh.mesh import Mesh

_ALL_ROWS = slice(None)
GUTTER_TEXELS = 3  # gutter width in the mesh's own layout, so that interpolation at chart edges finds light
# gutter width in stitched layouts: 3.4 standard deviations of the widest incremental blur [dEonLuebke2007]
GUTTER_MM = 8.0
MAX_SHEAR = 0.9  # largest shear that the blur takes into account; larger values are clipped


@dataclass(frozen=True)
class Atlas:
    """Map from the texels of a uv layout to the surface; row 0 is the top of the map (v = 0).

    triangle : (n, n) int32 index of the triangle at the texel's centre, -1 if there is none; a gutter texel
        has the nearest triangle of its chart or, in a stitched layout, the triangle across the seam
    barycentric : (n, n, 2) uint16 weights of the triangle's second and third corner [1/65535]
    stretch : (n, n, 2) float16 texels per mm along u and v; a texel outside its chart has the stretch of the
        chart's nearest edge [1/mm]
    shear : (n, n) float16 cosine of the angle between the directions of u and v on the surface
    edge_distance : (n, n, 4) uint16 distances to the edge of the chart, including any gutter around it, to
        the left, right, up and down [texel]
    corner_uv : (f, 3, 2) float32 uv of each triangle's corners in the atlas, v down
    gutter : (a, 2) uint16 gutter texels (x, y), into which the light of other texels is copied
    source : (a, 2) float32 position from which the light of each gutter texel is copied, integer at texel
        centres [texel]
    outside : (r, 2) uint16 texels (x, y) outside the triangles of their chart
    border_triangle : (r,) int32 index of the triangle at the nearest edge of each texel in `outside`
    border_weights : (r, 2) uint16 weights of that triangle's second and third corner at the nearest point of
        this edge [1/65535]
    texels_per_uv : (f,) float32 texels per unit of the mesh's own uv in each triangle
    mapped : (f,) mask of triangles that have texels of their own; light on all other triangles (opaque,
        collapsed, overlapped in uv) is not diffused
    """

    triangle: Ints
    barycentric: NDArray[np.uint16]
    stretch: NDArray[np.float16]
    shear: NDArray[np.float16]
    edge_distance: NDArray[np.uint16]
    corner_uv: Floats
    gutter: NDArray[np.uint16]
    source: Floats
    outside: NDArray[np.uint16]
    border_triangle: Ints
    border_weights: NDArray[np.uint16]
    texels_per_uv: Floats
    mapped: Mask

    @property
    def size(self) -> int:
        """Return the number n of texels along each side of the map."""
        return len(self.triangle)

    @property
    def coverage(self) -> Mask:
        """Return the (n, n) mask of texels that show a point of the surface, gutters included."""
        return np.asarray(self.triangle >= 0)

    @property
    def lit_mask(self) -> Mask:
        """Return the (n, n) mask of texels whose light is computed, not copied from other texels."""
        lit = self.coverage
        lit[self.gutter[:, 1], self.gutter[:, 0]] = False
        return lit

    def unscattered_fraction(self, mesh: Mesh) -> float:
        """Return the fraction of skin triangles without texels; light on these is not diffused [-]."""
        skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
        return float(1.0 - self.mapped[skin].mean()) if skin.any() else 0.0

    def with_triangles(self, triangle_count: int) -> Atlas:
        """Return this atlas for a mesh with triangles added at its end, which have no texels.

        triangle_count : number of triangles of that mesh
        """
        added = triangle_count - len(self.mapped)
        return replace(
            self,
            corner_uv=np.concatenate([self.corner_uv, np.zeros((added, 3, 2), np.float32)]),
            texels_per_uv=np.concatenate([self.texels_per_uv, np.ones(added, np.float32)]),
            mapped=np.concatenate([self.mapped, np.zeros(added, bool)]),
        )

    def barycentric_weights(self, rows: slice = _ALL_ROWS) -> Doubles:
        """Return the (n, n, 3) barycentric weights of all three corners at each texel.

        rows : rows of the map for which the weights are computed
        """
        bc = self.barycentric[rows] / 65535.0
        return np.concatenate([1.0 - bc.sum(axis=-1, keepdims=True), bc], axis=-1)

    def interpolate(
        self, mesh: Mesh, vertex_values: NDArray[np.floating], rows: slice = _ALL_ROWS
    ) -> Doubles:
        """Interpolate a vertex attribute (v, c) at the surface points of the texels, (n, n, c).

        rows : rows of the map for which the attribute is interpolated
        """
        corners = vertex_values[mesh.triangles[np.maximum(self.triangle[rows], 0)]].astype(float)
        return np.asarray(np.einsum("yxk,yxkc->yxc", self.barycentric_weights(rows), corners))
