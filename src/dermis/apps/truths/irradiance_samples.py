"""Irradiance samples at the corners of small triangles on a mesh, denser where the irradiance varies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.triangles import Floats, Index, split_triangles, triangle_edges
from dermis.base.errors import refuse
from dermis.mesh.mesh import Mesh


@dataclass(frozen=True)
class MeshPoints:
    """Points on the triangles of a mesh.

    positions : (n, 3) positions [mm]
    face : (n,) index of each point's triangle
    barycentric : (n, 3) weights of the triangle's corners
    """

    positions: Floats
    face: Index
    barycentric: Floats

    def interpolate(self, mesh: Mesh, vertex_values: NDArray[np.floating]) -> Floats:
        """Return the values (n, k) at the points, interpolated from vertex values.

        vertex_values : (v, k) values at the vertices of the mesh
        """
        return _interpolate(vertex_values[mesh.triangles[self.face]], self.barycentric)


IrradianceFunction = Callable[[MeshPoints], Floats]


@dataclass(frozen=True)
class IrradianceSamples:
    """Irradiance on a surface that is divided into small triangles, linear on each triangle.

    positions : (n, 3) sample positions [mm]
    triangles : (m, 3) sample indices of the corners; the triangles cover the surface without overlaps
    irradiance : (n, 3) irradiance at each sample, by channel, never negative
    """

    positions: Floats
    triangles: Index
    irradiance: Floats


def sample_irradiance(
    mesh: Mesh,
    irradiance_at: IrradianceFunction,
    spacing_mm: float,
    min_spacing_mm: float | None = None,
    contrast_threshold: float = 0.05,
) -> IrradianceSamples:
    """Return irradiance samples at the corners of small triangles that subdivide the skin of a mesh.

    Sides longer than `spacing_mm` are halved. Then sides of high contrast are halved further. The contrast of
    a side is the difference between the irradiances at its ends, relative to the largest irradiance.

    irradiance_at : function that returns the irradiance (n, 3) at `MeshPoints`; called once for each point
    spacing_mm : greatest side length of the small triangles [mm]
    min_spacing_mm : sides shorter than twice this length are not halved for contrast; None to halve no sides
        for contrast [mm]
    contrast_threshold : contrast above which a side is halved further [-]

    Source: [JensenBuhler2002] for sampling the irradiance on the surface.
    """
    if not (
        spacing_mm > 0
        and (min_spacing_mm is None or 0 < min_spacing_mm <= spacing_mm)
        and contrast_threshold > 0
    ):
        actual = f"got {spacing_mm}, {min_spacing_mm} and {contrast_threshold}"
        refuse("irradiance samples", "spacing >= finest > 0 and a contrast above 0", actual, "Correct them")
    subdivision = _subdivide_to(_skin_triangles(mesh), spacing_mm)
    irradiance = irradiance_at(_sample_points(subdivision))
    while min_spacing_mm is not None:
        ends, side, length = _edges_with_lengths(subdivision)
        contrast_across = np.abs(irradiance[ends[:, 0]] - irradiance[ends[:, 1]]).max(axis=1)
        high_contrast = (length >= 2 * min_spacing_mm) & (
            contrast_across > contrast_threshold * irradiance.max()
        )
        if not high_contrast.any():
            break
        known_count = len(irradiance)
        subdivision = _halve_edges(subdivision, side, _add_longest_sides(side, length, high_contrast))
        irradiance = np.vstack((irradiance, irradiance_at(_sample_points(subdivision, known_count))))
    return IrradianceSamples(_sample_points(subdivision).positions, subdivision.corners, irradiance)


@dataclass(frozen=True)
class _Subdivision:
    """Small triangles that subdivide the triangles of a mesh.

    corners : (m, 3) sample indices of the small triangles' corners
    face : (m,) index of the mesh triangle that contains each small triangle
    barycentric : (m, 3, 3) for each corner of each small triangle, three barycentric weights in the mesh
        triangle that contains it
    """

    mesh: Mesh
    corners: Index
    face: Index
    barycentric: Floats

    @property
    def sample_count(self) -> int:
        return int(self.corners.max()) + 1


def _interpolate(corner_values: NDArray[np.floating], barycentric: Floats) -> Floats:
    return np.asarray(np.einsum("nc,nck->nk", barycentric, corner_values.astype(np.float64)))


def _skin_triangles(mesh: Mesh) -> _Subdivision:
    is_skin = np.array([material.kind == "skin" for material in mesh.materials])
    face = np.flatnonzero(is_skin[mesh.material])
    if not len(face):
        refuse("irradiance samples", "a mesh with skin", "all of its materials are opaque", "Check the mesh")
    _, corners = np.unique(mesh.triangles[face], return_inverse=True)
    barycentric = np.broadcast_to(np.eye(3), (len(face), 3, 3)).copy()
    return _Subdivision(mesh, corners.reshape(-1, 3).astype(np.int64), face, barycentric)


def _subdivide_to(subdivision: _Subdivision, spacing_mm: float) -> _Subdivision:
    while True:
        _, side, length = _edges_with_lengths(subdivision)
        if not (length > spacing_mm).any():
            return subdivision
        subdivision = _halve_edges(subdivision, side, length > spacing_mm)


def _edges_with_lengths(subdivision: _Subdivision) -> tuple[Index, Index, Floats]:
    return triangle_edges(_sample_points(subdivision).positions, subdivision.corners)


def _add_longest_sides(
    side_edges: Index, edge_lengths: Floats, halved_edges: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return a larger mask: if any edge of a triangle is halved, the triangle's longest edge is halved too.

    This avoids slivers.

    side_edges : (m, 3) edge index of each side of the triangles
    edge_lengths : (e,) lengths of the edges [mm]
    halved_edges : (e,) mask of edges to halve
    """
    longest = np.take_along_axis(side_edges, edge_lengths[side_edges].argmax(axis=1)[:, None], axis=1)[:, 0]
    halved_edges = halved_edges.copy()
    while (missing := halved_edges[side_edges].any(axis=1) & ~halved_edges[longest]).any():
        halved_edges[longest[missing]] = True
    return halved_edges


def _halve_edges(
    subdivision: _Subdivision, side_edges: Index, halved_edges: NDArray[np.bool_]
) -> _Subdivision:
    """Return the subdivision with selected edges halved in all triangles that share them.

    side_edges : (m, 3) edge index of each side of the triangles
    halved_edges : (e,) mask of edges to halve
    """
    new_index = subdivision.sample_count + np.cumsum(halved_edges) - 1
    corners, source, barycentric = split_triangles(
        subdivision.corners, subdivision.barycentric, np.where(halved_edges, new_index, -1)[side_edges]
    )
    return _Subdivision(subdivision.mesh, corners, subdivision.face[source], barycentric)


def _sample_points(subdivision: _Subdivision, first_index: int = 0) -> MeshPoints:
    """Return the positions on the mesh of all samples from index `first_index` onwards."""
    count = subdivision.sample_count
    face, barycentric = np.empty(count, np.int64), np.empty((count, 3))
    face[subdivision.corners] = subdivision.face[:, None]
    barycentric[subdivision.corners] = subdivision.barycentric
    face, barycentric = face[first_index:], barycentric[first_index:]
    mesh = subdivision.mesh
    return MeshPoints(_interpolate(mesh.positions[mesh.triangles[face]], barycentric), face, barycentric)
