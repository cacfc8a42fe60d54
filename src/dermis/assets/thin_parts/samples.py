"""The atlas in coarse cells: places that give light through thin parts, and places that take it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.mesh import Mesh

Index = NDArray[np.int64]
Floats = NDArray[np.float64]
_INSIDE = 0.1  # texels; the place of a texel beside a chart is on its edge, or in another chart
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


def giving(mesh: Mesh, atlas: Atlas, side: int) -> Samples:
    """For each cell that holds surface of its own, all of that, and the texel nearest the middle."""
    stride = max(1, atlas.size // max(_ENOUGH, side))
    y, x = (stride * axis for axis in np.nonzero(atlas.own[::stride, ::stride]))
    inside = np.abs(_place(atlas, x, y) - np.stack([x, y], axis=-1)).max(axis=1) < _INSIDE
    x, y = x[inside], y[inside]
    column, row = x * side // atlas.size, y * side // atlas.size
    cell, ratio = row * side + column, atlas.size / side
    off = np.hypot(x + 0.5 - (column + 0.5) * ratio, y + 0.5 - (row + 0.5) * ratio)
    order = np.lexsort((off, cell))
    kept = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    mm2 = stride**2 * _texel_mm2(mesh, atlas)[atlas.triangle[y, x]]
    weighed = mm2[:, None] * np.column_stack([np.ones(len(x)), _position(mesh, atlas, x, y)])
    area, *moment = (np.bincount(cell, part)[cell[kept]] for part in weighed.T)
    normal = _normal(mesh, atlas, x[kept], y[kept])
    centre = np.stack(moment, axis=-1) / np.maximum(area, 1e-30)[:, None]
    chosen = np.stack([column, row], axis=-1)[kept], np.stack([x, y], axis=-1)[kept]
    return Samples(side, *chosen, centre, normal, area)


def taking(mesh: Mesh, atlas: Atlas, given: Samples) -> Samples:
    """The middles of cells that hold surface, and of those beside them that show where it goes on."""
    from scipy.ndimage import binary_dilation

    held = np.zeros((given.side, given.side), bool)
    held[given.cell[:, 1], given.cell[:, 0]] = True
    middle = middles(atlas.size, given.side)
    row, column = np.nonzero(
        binary_dilation(held, np.ones((3, 3), bool)) & atlas.coverage[np.ix_(middle, middle)]
    )
    cell = np.stack([column, row], axis=-1)
    x, y = middle[cell].T
    at = _position(mesh, atlas, x, y), _normal(mesh, atlas, x, y)
    return Samples(given.side, cell, middle[cell], *at, np.zeros(len(cell)))


def shown(atlas: Atlas, given: Samples) -> NDArray[np.int32]:
    """(n, n) the sample at or beside whose texel each texel's light is; -1 where none is.

    In the aprons that is one from elsewhere.
    """
    beside = np.full((atlas.size + 2, atlas.size + 2), -1, np.int32)
    x, y = given.texel.T + 1
    for dy, dx in (*np.ndindex(3, 3), (1, 1)):  # a sample's own texel last
        beside[y + dy - 1, x + dx - 1] = np.arange(len(x))
    y, x = np.nonzero(atlas.coverage)
    place = np.clip(np.rint(_place(atlas, x, y)).astype(np.int64) + 1, 0, atlas.size + 1)
    found = np.full((atlas.size, atlas.size), -1, np.int32)
    found[y, x] = beside[place[:, 1], place[:, 0]]
    return found


def middles(size: int, side: int) -> Index:
    """(side,) texels in the middle of the cells."""
    return np.asarray(((np.arange(side) + 0.5) * size / side).astype(np.int64))


def _position(mesh: Mesh, atlas: Atlas, x: Index, y: Index) -> Floats:
    """(n, 3) of texels [mm]."""
    return _interpolated(mesh, atlas, x, y, mesh.positions)


def _place(atlas: Atlas, x: Index, y: Index) -> Floats:
    """(n, 2) where in the atlas the surface is that texels show [texel], whole numbers at texel centres."""
    b = atlas.barycentric[y, x] / 65535.0
    a, *rest = (atlas.place[:, k][atlas.triangle[y, x]].astype(np.float64) for k in range(3))
    return np.asarray((a + sum(b[:, k, None] * (rest[k] - a) for k in range(2))) * atlas.size - 0.5)


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
