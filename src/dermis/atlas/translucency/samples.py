"""The atlas in coarse cells: sources that give light through thin parts, and receivers that take it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.mesh.mesh import Mesh

Index = NDArray[np.int64]
Floats = NDArray[np.float64]
Chosen = NDArray[np.bool_]
_ENOUGH = 1024  # texels a side among which the cells' places are chosen


@dataclass(frozen=True)
class Samples:
    """Places in the cells of a coarse atlas of side x side.

    cell : (n, 2) x, y
    texel : (n, 2) of the atlas, x, y
    position, normal : (n, 3) on the surface [mm]
    area_mm2 : (n,) of the surface that the sample stands for; 0 for places that only take light
    """

    side: int
    cell: Index
    texel: Index
    position: Floats
    normal: Floats
    area_mm2: Floats


def texel_mm(atlas: Atlas) -> float:
    """Median side of a texel on the surface [mm]."""
    density = atlas.stretch[atlas.own].astype(np.float64).prod(axis=1)
    return float(1.0 / np.sqrt(np.median(density))) if len(density) else 1.0


@dataclass(frozen=True)
class Texels:
    """The surface that the texels of an atlas show.

    nearest : (n, n, 2) x and y, from -1 to n, of the texel that owns it or lies beside it
    inside : (n, n) texels that own it, except at the edges of charts
    """

    nearest: NDArray[np.int16]
    inside: NDArray[np.bool_]


def texels(atlas: Atlas) -> Texels:
    """The texels of an atlas."""
    from dermis.atlas.translucency.kernels.facing import places

    nearest, inside = places(atlas.triangle, atlas.barycentric, atlas.place)
    return Texels(nearest, inside & atlas.own)


def surface(atlas: Atlas, seen: Texels, side: int) -> NDArray[np.bool_]:
    """(side, side) cells that hold surface, and neighbours that show its continuation."""
    held, middle = np.zeros((side, side), bool), middles(atlas.size, side)
    every = _stride(atlas, side)
    y, x = (every * axis * side // atlas.size for axis in np.nonzero(seen.inside[::every, ::every]))
    held[y, x] = True
    return _widened(held) & (atlas.triangle[np.ix_(middle, middle)] >= 0)


def giving(mesh: Mesh, atlas: Atlas, seen: Texels, side: int, thin: Chosen) -> Samples:
    """One source for each cell with surface of its own: its area, and the texel nearest the middle.

    thin : (f,) triangles; cells without them, and without a neighbour that has some, are left out
    """
    every = _stride(atlas, side)
    y, x = (every * axis for axis in np.nonzero(_asked(atlas, seen, side, thin)[::every, ::every]))
    column, row = x * side // atlas.size, y * side // atlas.size
    cell, ratio = row * side + column, atlas.size / side
    off = np.hypot(x + 0.5 - (column + 0.5) * ratio, y + 0.5 - (row + 0.5) * ratio)
    order = np.lexsort((off, cell))
    kept = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    mm2 = every**2 * _texel_mm2(mesh, atlas)[atlas.triangle[y, x]]
    weighed = mm2[:, None] * np.column_stack([np.ones(len(x)), _position(mesh, atlas, x, y)])
    area, *moment = (np.bincount(cell, part)[cell[kept]] for part in weighed.T)
    normal = _normal(mesh, atlas, x[kept], y[kept])
    centre = np.stack(moment, axis=-1) / np.maximum(area, 1e-30)[:, None]
    chosen = np.stack([column, row], axis=-1)[kept], np.stack([x, y], axis=-1)[kept]
    return Samples(side, *chosen, centre, normal, area)


def _asked(atlas: Atlas, seen: Texels, side: int, thin: Chosen) -> Chosen:
    """(n, n) texels in cells with chosen triangles, or beside such."""
    cell = np.arange(atlas.size) * side // atlas.size
    y, x = np.nonzero(thin[atlas.triangle] & seen.inside)
    held = np.zeros((side, side), bool)
    held[cell[y], cell[x]] = True
    return _widened(held)[np.ix_(cell, cell)] & seen.inside


def taking(mesh: Mesh, atlas: Atlas, surface: Chosen, thin: Chosen) -> Samples:
    """The middles of cells with surface.

    thin : (f,) triangles; cells that show another are left out
    """
    side = len(surface)
    middle = middles(atlas.size, side)
    row, column = np.nonzero(surface & thin[atlas.triangle[np.ix_(middle, middle)]])
    cell = np.stack([column, row], axis=-1)
    x, y = middle[cell].T
    at = _position(mesh, atlas, x, y), _normal(mesh, atlas, x, y)
    return Samples(side, cell, middle[cell], *at, np.zeros(len(cell)))


def shown(atlas: Atlas, seen: Texels, given: Samples) -> NDArray[np.int32]:
    """(n, n) sample at or beside the place that each texel shows, -1 for none; gutters show other places."""
    beside = np.full((atlas.size + 2, atlas.size + 2), -1, np.int32)
    x, y = given.texel.T + 1
    for dy, dx in (*np.ndindex(3, 3), (1, 1)):  # a sample's own texel last
        beside[y + dy - 1, x + dx - 1] = np.arange(len(x))
    return np.where(atlas.coverage, beside[seen.nearest[..., 1] + 1, seen.nearest[..., 0] + 1], -1)


def _widened(cells: Chosen) -> Chosen:
    """Cells, and all around them."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _stride(atlas: Atlas, side: int) -> int:
    """Between the texels that cells are made of."""
    return max(1, atlas.size // max(_ENOUGH, side))


def middles(size: int, side: int) -> Index:
    """(side,) texels in the middle of the cells."""
    return np.asarray(((np.arange(side) + 0.5) * size / side).astype(np.int64))


def _position(mesh: Mesh, atlas: Atlas, x: Index, y: Index) -> Floats:
    """(n, 3) of texels [mm]."""
    return _interpolated(mesh, atlas, x, y, mesh.positions)


def _normal(mesh: Mesh, atlas: Atlas, x: Index, y: Index) -> Floats:
    """(n, 3) of texels."""
    normal = _interpolated(mesh, atlas, x, y, mesh.normals)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30))


def _interpolated(mesh: Mesh, atlas: Atlas, x: Index, y: Index, values: NDArray[np.floating]) -> Floats:
    b = atlas.barycentric[y, x] / 65535.0
    a, *rest = (values[mesh.triangles[:, k]][atlas.triangle[y, x]].astype(np.float64) for k in range(3))
    return np.asarray(a + sum(b[:, k, None] * (rest[k] - a) for k in range(2)))


def _texel_mm2(mesh: Mesh, atlas: Atlas) -> Floats:
    """(f,) surface under a texel of each triangle [mm2]."""
    p = mesh.positions[mesh.triangles].astype(np.float64)
    q = atlas.place.astype(np.float64) * atlas.size
    a, b = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    surface = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return np.asarray(surface / np.maximum(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), 1e-9))
