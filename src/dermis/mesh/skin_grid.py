"""Grid of the skin around a head, by which strands of hair are kept outside, as in skin_grid.wgsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.mesh.geometry import vertex_normals
from dermis.mesh.mesh import Mesh

SKIN_CELLS = 96, 96, 68
"""Number of cells of the grid along x, y and z."""
SKIN_CELL_MM = 5.0
"""Side of a cell [mm]."""
SKIN_GRID_LOW_MM = -240.0, -345.0, -250.0
"""Corner of the grid, relative to the midpoint between the eyes [mm]."""
SKIN_WORDS_PER_VERTEX = 6
"""Number of words that the device stores for a vertex: its position and its normal."""
MEDIUM_VERTEX_STRIDE, FAR_VERTEX_STRIDE, FAR_REACH = 4, 16, 4
"""All vertices are entered into the cells next to their own, one of 4 into cells at a distance of two cells,
and one of 16 into cells at a distance of up to four cells, for points deep inside the skin."""
SKIN_CLEARANCE_RATIO = 1.3
"""Ratio of the height to which knots are pushed to the least height of strands above the skin."""
MAX_SKIN_VERTICES = 32_000
"""Largest number of vertices in the grid."""
SKIN_PUSHES = 3
"""Number of times that a knot is pushed out of the skin."""
NEAR_SKIN_MM = 1.5
"""Height above the nearest vertex's tangent plane from which no more vertices are looked up [mm]."""
MAX_SKIN_PUSH_MM, MAX_PUSH_PER_LENGTH = 16.0, 0.8
"""Largest distance by which a knot is pushed at once: in millimetres, and relative to its distance from the
root along the strand. On coarse meshes, the height above the skin of short hair is inaccurate."""
_INDEX_BITS, _DISTANCE_STEPS_PER_MM = 18, 256.0  # of a cell's word, see skin_grid.wgsl
_EMPTY = 0xFFFFFFFF
_REACH = range(-FAR_REACH, FAR_REACH + 1)
_STRIDE_BY_REACH = 1, 1, MEDIUM_VERTEX_STRIDE, FAR_VERTEX_STRIDE, FAR_VERTEX_STRIDE
_SOFTENING_MM2 = 0.05


def skin_grid_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in skin_grid.wgsl."""
    axes = "xyz"
    cells = {f"skin_cells_{axis}": n for axis, n in zip(axes, SKIN_CELLS, strict=True)}
    low = {f"skin_low_{axis}": x for axis, x in zip(axes, SKIN_GRID_LOW_MM, strict=True)}
    return {
        **cells,
        **low,
        "skin_cell_mm": SKIN_CELL_MM,
        "skin_words_per_vertex": SKIN_WORDS_PER_VERTEX,
        "medium_vertex_stride": MEDIUM_VERTEX_STRIDE,
        "far_vertex_stride": FAR_VERTEX_STRIDE,
        "far_reach": FAR_REACH,
        "skin_clearance_ratio": SKIN_CLEARANCE_RATIO,
        "skin_pushes": SKIN_PUSHES,
        "near_skin_mm": NEAR_SKIN_MM,
        "max_skin_push_mm": MAX_SKIN_PUSH_MM,
        "max_push_per_length": MAX_PUSH_PER_LENGTH,
    }


def skin_grid_vertices(mesh: Mesh) -> NDArray[np.uint32]:
    """Return the indices of the vertices of the skin that keep hair outside, one for each point.

    If there are too many, the first points are kept, which a subdivided mesh shares with coarser meshes.
    """
    skin = np.unique(mesh.triangles[mesh.material == 0])
    first = np.unique(mesh.point[skin], return_index=True)[1]
    return skin[first[:MAX_SKIN_VERTICES]].astype(np.uint32)


class SkinGrid:
    """Grid whose cells name the vertex of the posed skin that is nearest to the middle of the cell.

    mesh : mesh of the head
    points_mm : (p, 3) points of the mesh in a pose [mm]
    """

    def __init__(self, mesh: Mesh, points_mm: NDArray[np.floating]) -> None:
        index = skin_grid_vertices(mesh)
        positions, normals = mesh.positions, mesh.normals
        if not np.array_equal(points_mm, mesh.points_mm):
            positions = points_mm[mesh.point].astype(np.float32)
            normals = vertex_normals(positions, mesh.point, mesh.triangles)
        self._positions, self._normals = positions[index].astype(float), normals[index].astype(float)
        self._words = np.full(int(np.prod(SKIN_CELLS)), _EMPTY, np.int64)
        at = (self._positions - SKIN_GRID_LOW_MM) / SKIN_CELL_MM
        numbers, cells = np.arange(len(index)), np.floor(at).astype(np.int64)
        for offset in np.stack(np.meshgrid(_REACH, _REACH, _REACH), axis=-1).reshape(-1, 3):
            some = slice(None, None, _STRIDE_BY_REACH[np.abs(offset).max()])
            cell = cells[some] + offset
            away_mm = SKIN_CELL_MM * np.linalg.norm(cell + 0.5 - at[some], axis=1)
            words = ((_DISTANCE_STEPS_PER_MM * away_mm).astype(np.int64) << _INDEX_BITS) | numbers[some]
            inside = ((cell >= 0) & (cell < SKIN_CELLS)).all(axis=1)
            np.minimum.at(self._words, _cell_index(cell[inside]), words[inside])

    def push_out(self, points_mm: Doubles, clearance_mm: Doubles, length_mm: Doubles) -> Doubles:
        """Return points (n, 3) after moving those in the skin, or too close to it, outwards [mm].

        clearance_mm : (n,) heights above the skin that strands should have at least [mm]
        length_mm : (n,) distances from the roots along the strands [mm]
        """
        moved = points_mm.copy()
        candidates = np.arange(len(moved))
        for _ in range(SKIN_PUSHES):
            candidates = candidates[self._is_near(moved[candidates])]
            height, normal = self._skin_below(moved[candidates])
            least = SKIN_CLEARANCE_RATIO * clearance_mm[candidates]
            most = np.minimum(MAX_PUSH_PER_LENGTH * length_mm[candidates], MAX_SKIN_PUSH_MM)
            pushed = np.clip(least - height, 0.0, most)
            inside = pushed > 0.0
            candidates = candidates[inside]
            moved[candidates] += pushed[inside, None] * normal[inside]
        return moved

    def _is_near(self, points_mm: Doubles) -> NDArray[np.bool_]:
        """Return a mask (n,) of the points less than `NEAR_SKIN_MM` above the plane of a vertex."""
        cell = np.floor((points_mm - SKIN_GRID_LOW_MM) / SKIN_CELL_MM).astype(np.int64)
        inside = np.asarray(((cell >= 1) & (cell < np.array(SKIN_CELLS) - 1)).all(axis=1))
        word = np.where(inside, self._words[_cell_index(np.where(inside[:, None], cell, 0))], _EMPTY)
        vertex = self._vertex(word)
        height = ((points_mm - self._positions[vertex]) * self._normals[vertex]).sum(axis=1)
        return np.asarray((word != _EMPTY) & (height < NEAR_SKIN_MM))

    def _skin_below(self, points_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Return heights (n,) above the skin [mm], and its normals (n, 3), from the eight cells around."""
        low = np.floor((points_mm - SKIN_GRID_LOW_MM) / SKIN_CELL_MM - 0.5).astype(np.int64)
        height, normal = np.zeros(len(points_mm)), np.zeros_like(points_mm)
        for k in range(8):
            word = self._words[_cell_index(low + np.array([k & 1, k >> 1 & 1, k >> 2]))]
            vertex = self._vertex(word)
            away = points_mm - self._positions[vertex]
            weight = (word != _EMPTY) / ((away**2).sum(axis=1) + _SOFTENING_MM2)
            normal += weight[:, None] * self._normals[vertex]
            height += weight * (away * self._normals[vertex]).sum(axis=1)
        size = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
        return height / size, normal / size[:, None]

    @staticmethod
    def _vertex(word: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.where(word != _EMPTY, word & ((1 << _INDEX_BITS) - 1), 0)


def _cell_index(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    return (cell[..., 2] * SKIN_CELLS[1] + cell[..., 1]) * SKIN_CELLS[0] + cell[..., 0]
