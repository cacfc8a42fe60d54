"""Unwrapping of a mesh to a uv layout by given or found charts, and their packing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.atlas.unwrap.charts import grow, tidy
from dermis.atlas.unwrap.seams import Flat, Surface, border_sides, lay_flat
from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Mesh, build_mesh

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

_CELLS = 512  # columns and rows of the square
_PLACINGS = 1000  # of sheets, over all orders that are tried
_HALVINGS = 9  # in the search for the scale
_GAIN = 1.004  # of the scale, for an order to be worth a search
PADDING = 1 / 128
"""Empty space between charts, of the map's side: 8 texels at 1024."""
UPRIGHT = (0.0, 1.0, -0.1)
"""Direction in space that points up on a map: up and, for level surfaces, towards the back."""
_LEAST_MM2 = 1e-10
_CHARTS = 16
_LEAST_CHART_MM2 = 1e-6


def pack(outlines: list[Doubles], padding: float) -> tuple[float, Doubles]:
    """Scale, and offset (c, 2) of each sheet, that bring scale * places + offset into the unit square.

    outlines : ends (k, 2, 2) of the sides of each sheet's border, counter-clockwise around it
    padding : empty space between sheets, half as much to the edge of the square, of the square's side

    Each sheet is let down onto those below, where it comes to lie lowest [Levy2002], in several orders.

    Raises DermisError when there are more sheets than fit side by side.
    """
    corner = np.array([sides.min(axis=(0, 1)) for sides in outlines])
    moved = [sides - low for sides, low in zip(outlines, corner, strict=True)]
    size = np.array([sides.max(axis=(0, 1)) for sides in moved])
    bound = _CELLS / np.sqrt(max(sum(_area(sides) for sides in moved), (size**2).max()))
    best, cells = 0.0, None
    for order in _orders(size):
        low, high = best, bound
        if cells is not None and _place(moved, order, best * _GAIN, padding) is None:
            continue
        for _ in range(_HALVINGS):
            scale = (low + high) / 2
            found = _place(moved, order, scale, padding)
            if found is None:
                high = scale
            else:
                best, cells, low = scale, found, scale
    if cells is None:
        refuse("charts", "fewer charts", f"got {len(outlines)}", "Cut the mesh into larger charts")
    return best / _CELLS, (cells - best * corner) / _CELLS


def _area(sides: Doubles) -> float:
    (x0, y0), (x1, y1) = sides[:, 0].T, sides[:, 1].T
    return float((x0 * y1 - x1 * y0).sum() / 2)


def _orders(size: Doubles) -> Iterator[Index]:
    """Which sheet comes first: the highest, the widest, or any."""
    yield np.argsort(-size[:, 1], kind="stable")
    yield np.argsort(-size[:, 0], kind="stable")
    random = np.random.default_rng(0)
    for _ in range(min(_PLACINGS // len(size), factorial(len(size)) - 2)):
        yield random.permutation(len(size))


def _place(moved: list[Doubles], order: Index, scale: float, padding: float) -> Doubles | None:
    """Where the lower left corners (c, 2) of the sheets come to lie [cells], None if they do not all fit.

    moved : outlines with their lower left corner at 0
    scale : [cells per unit of these]
    """
    margin = int(np.ceil(padding * _CELLS / 2))
    horizon, cells = np.zeros(_CELLS, dtype=np.int64), np.zeros((len(moved), 2))
    for k in order:
        low, high = _profile(moved[k] * scale, margin)
        if len(low) > _CELLS:
            return None
        rest = (np.lib.stride_tricks.sliding_window_view(horizon, len(low)) - low).max(axis=1)
        x = int(rest.argmin())
        y = int(rest[x])
        if y + high.max() >= _CELLS:
            return None
        horizon[x : x + len(low)] = np.maximum(horizon[x : x + len(low)], y + high + 1)
        cells[k] = x + margin, y + margin
    return cells


def _profile(sides: Doubles, margin: int) -> tuple[Index, Index]:
    """Lowest and highest cell (w,) of a sheet in each column, with empty cells around it.

    sides : ends (k, 2, 2) [cells]
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    steps = np.ceil(2 * np.abs(sides[:, 1] - sides[:, 0]).max(axis=1)).astype(np.int64) + 1
    which = np.repeat(np.arange(len(sides)), steps)
    t = (np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[which]
    x, y = (sides[which, 0] * (1 - t)[:, None] + sides[which, 1] * t[:, None]).astype(np.int64).T
    width = int(x.max()) + 1 + 2 * margin
    low, high = np.full(width, _CELLS), np.full(width, -_CELLS)
    np.minimum.at(low, x + margin, y)
    np.maximum.at(high, x + margin, y)
    around = 2 * margin + 1
    return minimum_filter1d(low, around), maximum_filter1d(high, around) + 2 * margin


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
