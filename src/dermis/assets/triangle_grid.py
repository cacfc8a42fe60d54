"""Even cells over a mesh, each with the triangles that may pass through it, to follow rays through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.assets.mesh import Mesh

Index = NDArray[np.int64]
_MOST_CELLS = 160  # along the longest side
_EDGES = 1.5  # median edges to a cell


@dataclass(frozen=True)
class TriangleGrid:
    """Cells in the order x, y, z, x fastest.

    low : (3,) corner of the first cell [mm]
    cell_mm : side of a cell [mm]
    size : (3,) cells along each axis
    first : (cells + 1,) uint32 where each cell's triangles begin in the list
    triangle : (n,) uint32 the list
    """

    low: NDArray[np.float64]
    cell_mm: float
    size: tuple[int, int, int]
    first: NDArray[np.uint32]
    triangle: NDArray[np.uint32]


def build_grid(mesh: Mesh) -> TriangleGrid:
    """The grid of a mesh; a triangle is in every cell that its bounds touch [AmanatidesWoo1987]."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    edge = float(np.median(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    cell = max(_EDGES * edge, float((high - low).max()) / _MOST_CELLS, 1e-3)
    low = low - 0.5 * cell  # a flat mesh would lie between two layers of cells
    size = np.floor((high - low) / cell).astype(np.int64) + 1
    least, most = (np.floor((corners.min(axis=1) - low) / cell), np.floor((corners.max(axis=1) - low) / cell))
    triangle, place = _cells_within(least.astype(np.int64), most.astype(np.int64))
    index = place[:, 0] + size[0] * (place[:, 1] + size[1] * place[:, 2])
    order = np.argsort(index, kind="stable")
    first = np.searchsorted(index[order], np.arange(size.prod() + 1))
    return TriangleGrid(
        low,
        cell,
        (int(size[0]), int(size[1]), int(size[2])),
        first.astype(np.uint32),
        triangle[order].astype(np.uint32),
    )


def _cells_within(least: Index, most: Index) -> tuple[Index, Index]:
    """Every cell (n, 3) between two corners (f, 3) of each box, and the box (n,) it belongs to."""
    sides = most - least + 1
    count = sides.prod(axis=1)
    box = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(box)) - np.repeat(np.cumsum(count) - count, count)
    x, y = sides[box, 0], sides[box, 1]
    return box, least[box] + np.stack([step % x, step // x % y, step // (x * y)], axis=-1)
