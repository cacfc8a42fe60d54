"""Unwrapping of a mesh to a uv layout by given or found charts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.atlas.unwrap.charts import grow, tidy
from dermis.atlas.unwrap.pack import pack
from dermis.atlas.unwrap.seams import Flat, Surface, border_sides, lay_flat
from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh, build_mesh

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

PADDING = 1 / 128
"""Empty space between charts, of the map's side: 8 texels at 1024."""
UPRIGHT = (0.0, 1.0, -0.1)
"""Direction in space that points up on a map: up and, for level surfaces, towards the back."""

_LEAST_MM2 = 1e-10
_CHARTS = 16
_LEAST_CHART_MM2 = 1e-6


@dataclass(frozen=True)
class Layout:
    """Where the triangles of a mesh lie on its maps.

    uv : (v, 2) of each corner vertex, u to the right, v down
    triangles : (f, 3) corner vertices, in the order of the mesh's triangles
    point : (v,) point of the mesh that each corner vertex is
    chart : (f,) chart of each triangle, from 0
    """

    uv: Doubles
    triangles: Index
    point: Index
    chart: Index


def unwrap(
    positions: Doubles,
    triangles: Index,
    chart: Index,
    upright: ArrayLike = UPRIGHT,
    padding: float = PADDING,
) -> Layout:
    """The layout with each chart laid flat by itself.

    positions : (n, 3) [mm]
    triangles : (f, 3), each with an area
    chart : (f,) what is laid flat together; a chart in several pieces becomes several charts
    upright : (3,), or one for each triangle (f, 3), the direction in space that points up on the map
    padding : empty space between charts, of the map's side

    No triangle is mirrored and none lies on another: where a chart's border crosses itself, triangles go to
    the chart beside it; what cannot be laid flat even so is halved.

    Raises DermisError when a triangle has no area, and when there are too many charts for one map.
    """
    _check_areas(positions, triangles)
    flat = lay_flat(Surface(positions, triangles), chart)
    up = np.broadcast_to(np.asarray(upright, dtype=np.float64), (len(triangles), 3))
    first = np.unique(flat.piece, return_index=True)[1]
    height = np.einsum("fki,fi->fk", positions[triangles], up[first][flat.piece])
    uv = _pack(_turn(flat, height), flat, padding)
    return Layout(uv, flat.corner, flat.point, flat.piece)


def _check_areas(positions: Doubles, triangles: Index) -> None:
    flat = int((triangle_areas(positions[triangles]) < _LEAST_MM2).sum())
    if flat:
        refuse("mesh", "triangles with an area", f"{flat} have none", "Remove them first")


def _turn(flat: Flat, height: Doubles) -> Doubles:
    """The places (v, 2), each sheet turned so that `height` (f, 3) of the corners grows upwards."""
    z = flat.places[:, 0] + 1j * flat.places[:, 1]
    z3 = z[flat.corner]
    # i times the side opposite a corner points along the gradient of what is 1 there and 0 on that side
    slope = 1j * (height * (np.roll(z3, -2, axis=1) - np.roll(z3, -1, axis=1))).sum(axis=1)
    up = np.bincount(flat.piece, slope.real) + 1j * np.bincount(flat.piece, slope.imag)
    turn = np.where(np.abs(up) > 0, 1j * np.conj(up) / np.maximum(np.abs(up), 1e-300), 1)
    z *= turn[_owners(flat)]
    return np.column_stack((z.real, z.imag))


def _owners(flat: Flat) -> Index:
    """Piece of each corner vertex (v,)."""
    owner = np.empty(len(flat.point), dtype=np.int64)
    owner[flat.corner] = flat.piece[:, None]
    return owner


def _pack(places: Doubles, flat: Flat, padding: float) -> Doubles:
    """uv (v, 2), v down."""
    sides, triangle = border_sides(flat.corner)
    owner = flat.piece[triangle]
    order = np.argsort(owner, kind="stable")
    starts = np.flatnonzero(np.diff(owner[order])) + 1
    scale, offset = pack([places[some] for some in np.split(sides[order], starts)], padding)
    uv = scale * places + offset[_owners(flat)]
    return np.column_stack((uv[:, 0], 1 - uv[:, 1]))


def with_other_seams(mesh: Mesh) -> Mesh:
    """The same triangles in the same order on a layout of about 16 charts grown from random places.

    Triangles without an area keep no place on it: their uv is 0.
    """
    positions = np.zeros((int(mesh.point.max()) + 1, 3))
    positions[mesh.point] = mesh.positions
    points = mesh.point[mesh.triangles].astype(np.int64)
    kept = np.flatnonzero(triangle_areas(positions[points]) > _LEAST_CHART_MM2)
    triangles = points[kept]
    layout = unwrap(positions, triangles, tidy(grow(positions, triangles, _CHARTS), triangles))
    corner = np.full((len(points), 3), len(layout.uv), dtype=np.int64)
    corner[kept] = layout.triangles
    normals = np.zeros((len(positions), 3))
    normals[mesh.point] = mesh.normals
    point = np.append(layout.point, 0)
    uv = np.vstack([layout.uv, np.zeros(2)])
    return build_mesh(positions[point], uv, corner, mesh.material, mesh.materials, normals[point], point)
