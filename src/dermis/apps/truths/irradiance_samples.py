"""Samples of the irradiance on a mesh: at corners of small triangles, denser where the light changes."""

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
    """Points on a mesh.

    positions : (n, 3) [mm]
    face : (n,) the mesh's triangle
    barycentric : (n, 3) weights of its corners
    """

    positions: Floats
    face: Index
    barycentric: Floats

    def interpolate(self, mesh: Mesh, values: NDArray[np.floating]) -> Floats:
        """Return (n, k) values at the points, interpolated from values (v, k) at the mesh's vertices."""
        return _interpolate(values[mesh.triangles[self.face]], self.barycentric)


IrradianceFunction = Callable[[MeshPoints], Floats]


@dataclass(frozen=True)
class IrradianceSamples:
    """Irradiance on a surface of small triangles, linear within each.

    positions : (n, 3) of the samples [mm]
    triangles : (m, 3) of samples; they cover the surface once
    irradiance : (n, 3) at each sample, 0 or more
    """

    positions: Floats
    triangles: Index
    irradiance: Floats

    def __post_init__(self) -> None:
        count, light = len(self.positions), np.asarray(self.irradiance)
        if light.shape != (count, 3) or np.shape(self.positions) != (count, 3):
            came = f"{np.shape(self.positions)} and {light.shape} came"
            refuse("irradiance samples", "positions and irradiance, both (n, 3)", came, "Correct them")
        if not (np.isfinite(light).all() and (light >= 0).all()):
            refuse("irradiance samples", "finite irradiance of 0 or more", "others came", "Correct it")
        t = np.asarray(self.triangles)
        if t.ndim != 2 or t.shape[1:] != (3,) or not len(t) or t.min() < 0 or t.max() >= count:
            expected = f"triangles (m, 3) of 0 to {count - 1}"
            refuse("irradiance samples", expected, "others came", "Correct them")


def sample_irradiance(
    mesh: Mesh, light: IrradianceFunction, spacing_mm: float, finest_mm: float | None = None, contrast: float = 0.05
) -> IrradianceSamples:
    """Return samples on the skin of a mesh, whose flat triangles are subdivided, not smoothed.

    light : irradiance (n, 3) at places; called again for new places only
    spacing_mm : longest side of a small triangle [mm]
    finest_mm : sides across which the light changes are halved further, down to this length [mm]
    contrast : change of light across a side that asks for that, relative to the brightest sample [-]

    Corners of triangles have the smallest error for their number. Measured on waves, an edge and a stripe of
    light under a skin profile, with 1 sample per mm², as error over that of corners: random points with the
    light of the nearest 2.3 to 6, points pushed apart [Turk1992] 1.2 to 3, centres of triangles 1.4 to 3,
    points pushed apart with linear interpolation 0.9 to 1.8. A bare sum over points is 17 to 180 times worse,
    because the profile's peak falls between them.

    Source: [JensenBuhler2002] for sampling the irradiance on the surface.
    """
    if not (spacing_mm > 0 and (finest_mm is None or 0 < finest_mm <= spacing_mm) and contrast > 0):
        came = f"{spacing_mm}, {finest_mm} and {contrast} came"
        refuse("irradiance samples", "spacing >= finest > 0 and a contrast above 0", came, "Correct them")
    pieces = _subdivide_to(_skin_triangles(mesh), spacing_mm)
    irradiance = light(_sample_points(pieces))
    while finest_mm is not None:
        ends, side, length = _edge_lengths(pieces)
        change = np.abs(irradiance[ends[:, 0]] - irradiance[ends[:, 1]]).max(axis=1)
        uneven = (length >= 2 * finest_mm) & (change > contrast * irradiance.max())
        if not uneven.any():
            break
        known = len(irradiance)
        pieces = _bisect(pieces, side, _add_longest_sides(side, length, uneven))
        irradiance = np.vstack((irradiance, light(_sample_points(pieces, known))))
    return IrradianceSamples(_sample_points(pieces).positions, pieces.corners, irradiance)


@dataclass(frozen=True)
class _Subdivision:
    """Small triangles.

    corners : (m, 3) of samples
    face : (m,) the mesh's triangle
    barycentric : (m, 3, 3) weights of the corners in it
    """

    mesh: Mesh
    corners: Index
    face: Index
    barycentric: Floats

    @property
    def count(self) -> int:
        return int(self.corners.max()) + 1


def _interpolate(corners: NDArray[np.floating], barycentric: Floats) -> Floats:
    at: Floats = np.einsum("nc,nck->nk", barycentric, corners.astype(np.float64))
    return at


def _skin_triangles(mesh: Mesh) -> _Subdivision:
    kinds = np.array([material.kind == "skin" for material in mesh.materials])
    face = np.flatnonzero(kinds[mesh.material])
    if not len(face):
        refuse("irradiance samples", "a mesh with skin", "all of its materials are opaque", "Check the mesh")
    _, corners = np.unique(mesh.triangles[face], return_inverse=True)
    barycentric = np.broadcast_to(np.eye(3), (len(face), 3, 3)).copy()
    return _Subdivision(mesh, corners.reshape(-1, 3).astype(np.int64), face, barycentric)


def _subdivide_to(pieces: _Subdivision, spacing_mm: float) -> _Subdivision:
    while True:
        _, side, length = _edge_lengths(pieces)
        if not (length > spacing_mm).any():
            return pieces
        pieces = _bisect(pieces, side, length > spacing_mm)


def _edge_lengths(pieces: _Subdivision) -> tuple[Index, Index, Floats]:
    return triangle_edges(_sample_points(pieces).positions, pieces.corners)


def _add_longest_sides(side: Index, length: Floats, cut: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the edges to halve and the longest side of each of their triangles, which keeps them compact."""
    longest = np.take_along_axis(side, length[side].argmax(axis=1)[:, None], axis=1)[:, 0]
    cut = cut.copy()
    while (wanted := cut[side].any(axis=1) & ~cut[longest]).any():
        cut[longest[wanted]] = True
    return cut


def _bisect(pieces: _Subdivision, side: Index, cut: NDArray[np.bool_]) -> _Subdivision:
    """Return the pieces with these edges (e,) halved, alike for both triangles on an edge."""
    number = pieces.count + np.cumsum(cut) - 1
    corners, source, barycentric = split_triangles(pieces.corners, pieces.barycentric, np.where(cut, number, -1)[side])
    return _Subdivision(pieces.mesh, corners, pieces.face[source], barycentric)


def _sample_points(pieces: _Subdivision, first: int = 0) -> MeshPoints:
    """Return the samples from index `first` on."""
    count = pieces.count
    face, barycentric = np.empty(count, np.int64), np.empty((count, 3))
    face[pieces.corners] = pieces.face[:, None]
    barycentric[pieces.corners] = pieces.barycentric
    face, barycentric = face[first:], barycentric[first:]
    mesh = pieces.mesh
    return MeshPoints(_interpolate(mesh.positions[mesh.triangles[face]], barycentric), face, barycentric)
