"""Panels of cloth over the skin: each of their points is bound to the skin sheet at a height above it."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.human.wear.skin_sheet import point_normals, unit_vectors

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_RELAXATION_STEPS = 40
_SMOOTHED_HEIGHT_MM = 6.0  # height from which normals are smoothed, so that surfaces do not cross
_NORMAL_STEPS = 12
_NEIGHBOUR_WEIGHT = 3.0  # of the normals around a point of stretched cloth


class PanelVertices(NamedTuple):
    """Vertices of a panel: index of the point (v,), position on the cloth (v, 2) [mm], triangles (t, 3)."""

    point: Ints
    uv_mm: Doubles
    triangles: Ints

    @property
    def triangles_of_points(self) -> Ints:
        """Return the triangles (t, 3) as indices of points."""
        return np.asarray(self.point[self.triangles], np.int32)


class Panel:
    """Surface of cloth that is bound to the skin sheet.

    bind : (m, n) weights of the n points of the sheet in each point of the panel
    triangles : (t, 3) indices of points, counter-clockwise seen from outside
    height_mm : (m,) minimum height above the skin and the garment beneath [mm]
    fold_mm : (m,) height of folds above that [mm]
    uv_mm : (m, 2) position on the cloth along weft and warp [mm]
    slot : material, such as "cloth"
    taut : (m,) mask of points that are stretched between their neighbours instead of following the skin
    covers : whether later panels lie on top of this one
    grid : indices of the points if they are a grid, else None
    """

    def __init__(
        self,
        bind: csr_array,
        triangles: Ints,
        height_mm: Doubles,
        uv_mm: Doubles,
        slot: str = "cloth",
        *,
        fold_mm: Doubles | None = None,
        taut: Mask | None = None,
        covers: bool = False,
        grid: Grid | None = None,
    ) -> None:
        count = len(height_mm)
        self.bind, self.triangles, self.height_mm, self.uv_mm = bind, triangles, height_mm, uv_mm
        self.slot, self.covers, self.grid = slot, covers, grid
        self.fold_mm = np.zeros(count) if fold_mm is None else fold_mm
        self.taut = np.zeros(count, bool) if taut is None else taut

    @cached_property
    def mean_of_neighbours(self) -> csr_array:
        """Return the (m, m) matrix of the means over the neighbours of each point."""
        from scipy.sparse import coo_array, csr_array, diags_array

        a = self.triangles.ravel()
        b = np.roll(self.triangles, -1, axis=1).ravel()
        rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
        links = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(self.height_mm),) * 2).tocsr()
        links.data[:] = 1.0
        return csr_array(diags_array(1.0 / np.maximum(links.sum(axis=1), 1.0)) @ links)

    @cached_property
    def vertices(self) -> PanelVertices:
        """Return the vertices; the first column of a closed grid is duplicated at its end, where uv jumps."""
        if self.grid is None or not self.grid.is_closed:
            return PanelVertices(np.arange(len(self.height_mm), dtype=np.int32), self.uv_mm, self.triangles)
        return self.grid.vertices(self.uv_mm)

    def heights_on_sheet(self, points: Doubles, skin_mm: Doubles, skin_normals: Doubles) -> Doubles:
        """Return the height (n,) of this panel above the points of the sheet, 0 where it is not [mm].

        points : (m, 3) points of the panel, from `place`
        """
        normal = unit_vectors(np.asarray(self.bind @ skin_normals))
        height = np.maximum(((points - self.bind @ skin_mm) * normal).sum(axis=1), 0.0)
        total = np.asarray(self.bind.T @ np.ones(len(height)))
        return np.asarray(self.bind.T @ height) / np.where(total > 0.0, total, 1.0)

    def place(self, skin_mm: Doubles, skin_normals: Doubles, cover_mm: Doubles) -> Doubles:
        """Return the points (m, 3) of the panel on a person [mm].

        skin_mm, skin_normals : (n, 3) points of the person's sheet, and unit normals there
        cover_mm : (n,) height of the garment beneath
        """
        base, normal = np.asarray(self.bind @ skin_mm), unit_vectors(np.asarray(self.bind @ skin_normals))
        height = self.height_mm + np.asarray(self.bind @ cover_mm) * (self.height_mm > 0.0)
        if height.max() > _SMOOTHED_HEIGHT_MM and not self.taut.any():
            normal = self._smooth(normal)
        if self.taut.any():  # normals at the border of the skin depend on single triangles
            normal = unit_vectors(normal + _NEIGHBOUR_WEIGHT * (self.mean_of_neighbours @ normal))
        points = base + height[:, None] * normal
        if not self.taut.any():
            return np.asarray(points + self.fold_mm[:, None] * normal)
        links, taut = self.mean_of_neighbours[self.taut], self.taut
        for _ in range(_RELAXATION_STEPS):
            points[taut] = links @ points
            low = height - ((points - base) * normal).sum(axis=1)
            points += np.maximum(low, 0.0)[:, None] * normal
        outward = point_normals(points, self.triangles)
        return np.asarray(points + self.fold_mm[:, None] * outward)

    def _smooth(self, normal: Doubles) -> Doubles:
        for _ in range(_NORMAL_STEPS):
            normal = np.asarray(self.mean_of_neighbours @ normal)
        return unit_vectors(normal)


class Grid(NamedTuple):
    """Indices of the points of a panel that is a grid of rows and columns.

    rows, columns : size of the grid
    is_closed : whether the last column is next to the first one
    """

    rows: int
    columns: int
    is_closed: bool

    @property
    def triangles(self) -> Ints:
        """Return the triangles (t, 3), counter-clockwise if rows run upwards and columns to the right."""
        row, column = np.meshgrid(
            np.arange(self.rows - 1), np.arange(self.columns - (not self.is_closed)), indexing="ij"
        )
        after = (column + 1) % self.columns
        a, b = row * self.columns + column, row * self.columns + after
        c, d = a + self.columns, b + self.columns
        return np.stack([a, b, d, a, d, c], axis=-1).reshape(-1, 3).astype(np.int32)

    def vertices(self, uv_mm: Doubles) -> PanelVertices:
        """Return the vertices of a closed grid, whose first column is duplicated at its end, where uv jumps.

        uv_mm : (m, 2) position of the points on the cloth [mm]
        """
        point = np.arange(self.rows * self.columns, dtype=np.int32).reshape(self.rows, self.columns)
        uv = uv_mm.reshape(self.rows, self.columns, 2)
        last = 2.0 * uv[:, -1:] - uv[:, -2:-1]
        return PanelVertices(
            np.concatenate([point, point[:, :1]], axis=1).ravel(),
            np.concatenate([uv, last], axis=1).reshape(-1, 2),
            Grid(self.rows, self.columns + 1, False).triangles,
        )

    @property
    def end_caps(self) -> Ints:
        """Return triangles (t, 3) that join row k to row -1 - k at the first and at the last column."""
        low = np.arange(self.rows // 2 - 1)
        caps = []
        for column, order in ((0, 1), (self.columns - 1, -1)):
            a, b = (row * self.columns + column for row in (low, low + 1))
            c, d = ((self.rows - 1 - row) * self.columns + column for row in (low, low + 1))
            caps += [np.stack([a, b, c], 1)[:, ::order], np.stack([b, d, c], 1)[:, ::order]]
        return np.concatenate(caps).astype(np.int32)


def border_loop(triangles: Ints) -> Index:
    """Return the directed border edges (b, 2) of triangles (t, 3), which belong to one triangle only."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    size = int(triangles.max()) + 1
    twins = np.isin(edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0])
    return edges[~twins]
