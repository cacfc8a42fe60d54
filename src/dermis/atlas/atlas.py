"""The surface atlas: the point of the surface at each texel of the uv map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh

ALL_ROWS = slice(None)
GUTTER = 3  # texels around each chart of the mesh's own layout, so that interpolation at its edge finds light
REACH_MM = 8.0  # of gutters: 3.4 standard deviations of the widest Gaussian added to another [dEonLuebke2007]
MOST_SHEAR = 0.9  # a map that is sheared more is blurred as if by this much


@dataclass(frozen=True)
class Atlas:
    """Texel -> surface, once per mesh and size. Row 0 is the top of the maps (v = 0).

    triangle : (n, n) int32 triangle at the texel's centre, -1 where none is. Beyond a chart's edge it is the
        nearest one or, in a stitched layout, the one across the seam
    barycentric : (n, n, 2) uint16 weights of the triangle's second and third corner [1/65535]
    stretch : (n, n, 2) float16 texels per mm along u and v [1/mm]; beyond a chart's edge those at the edge
    shear : (n, n) float16 cosine of the angle that the directions of u and v make on the surface
    reach : (n, n, 4) uint16 texels to the left, right, up and down of the same chart without a gap between
    place : (f, 3, 2) float32 uv of each triangle's corners in the atlas, v down
    gutter : (a, 2) uint16 texels (x, y) beyond a chart's edge, which copy what other texels compute
    source : (a, 2) float32 place that each copies [texel], whole numbers at texel centres
    beyond : (r, 2) uint16 texels (x, y) outside of the triangles, gutters and others, that are stretched as
        another place is
    root : (r,) int32 triangle of that place
    root_weight : (r, 2) uint16 its weights of the second and third corner [1/65535]
    per_uv : (f,) float32 texels in a unit of uv
    mapped : (f,) triangles that own texels; the others (opaque, collapsed, overlapped in uv) are lit directly
    """

    triangle: NDArray[np.int32]
    barycentric: NDArray[np.uint16]
    stretch: NDArray[np.float16]
    shear: NDArray[np.float16]
    reach: NDArray[np.uint16]
    place: NDArray[np.float32]
    gutter: NDArray[np.uint16]
    source: NDArray[np.float32]
    beyond: NDArray[np.uint16]
    root: NDArray[np.int32]
    root_weight: NDArray[np.uint16]
    per_uv: NDArray[np.float32]
    mapped: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Texels along each side."""
        return len(self.triangle)

    @property
    def coverage(self) -> NDArray[np.bool_]:
        """(n, n) texels that show surface, gutters included."""
        return np.asarray(self.triangle >= 0)

    @property
    def own(self) -> NDArray[np.bool_]:
        """(n, n) texels that hold surface of their own, without the gutters that copy others."""
        own = self.coverage
        own[self.gutter[:, 1], self.gutter[:, 0]] = False
        return own

    def unscattered(self, mesh: Mesh) -> float:
        """Share of the skin's triangles that own no texels [0..1]."""
        skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
        return float(1.0 - self.mapped[skin].mean()) if skin.any() else 0.0

    def weights(self, rows: slice = ALL_ROWS) -> NDArray[np.float64]:
        """(n, n, 3) barycentric weights of the three corners, or those of some rows."""
        bc = self.barycentric[rows] / 65535.0
        return np.concatenate([1.0 - bc.sum(axis=-1, keepdims=True), bc], axis=-1)

    def interpolate(
        self, mesh: Mesh, values: NDArray[np.floating], rows: slice = ALL_ROWS
    ) -> NDArray[np.float64]:
        """(n, n, c) of a (v, c) corner attribute, or those of some rows; undefined outside the coverage."""
        corners = values[mesh.triangles[np.maximum(self.triangle[rows], 0)]].astype(float)
        return np.asarray(np.einsum("yxk,yxkc->yxc", self.weights(rows), corners))
