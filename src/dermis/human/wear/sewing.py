"""Shapes of which garments are made: body, parts swept around the neck, and parts on the chest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.curves import smoothstep
from dermis.human.wear.cloth_uv import cloth_coordinates_mm
from dermis.human.wear.folds import Folds
from dermis.human.wear.panels import Grid, Panel, border_loop
from dermis.human.wear.skin_sheet import NECK_AXIS_Z_MM, RING_SIZE, cut_below, ring_around, skin_sheet
from dermis.mesh.geometry import cross_2d

if TYPE_CHECKING:
    from scipy.sparse import csr_array

FULL_TURN = 2.0 * np.pi
COLUMNS = np.arange(RING_SIZE) * FULL_TURN / RING_SIZE
"""Angles of the columns of a ring from the front [rad]."""
_MM_PER_RADIAN = 62.0  # mean radius of the base of the neck
_CANDIDATE_COUNT = 16  # triangles near a position of which one contains it


def column_angles() -> Doubles:
    """Return the angles (RING_SIZE,) of the columns of a ring from the front, 0 to pi [rad]."""
    return np.minimum(COLUMNS, FULL_TURN - COLUMNS)


def towards_back(angle: Doubles) -> Doubles:
    """Return 0 at the front to 1 at the back, for angles (n,) from the front [rad]."""
    return np.asarray(0.5 - 0.5 * np.cos(angle))


def body_panel(field_mm: Doubles, folds: Folds, ease_mm: float) -> Panel:
    """Return the body of a garment: the sheet below the neckline, with a hem at its lower border.

    field_mm : (n,) distance of the points of the sheet below the neckline, negative above it [mm]
    folds : folds of the cloth
    ease_mm : least height of the cloth above the skin, away from the neckline [mm]
    """
    from scipy.sparse import vstack
    from scipy.spatial import cKDTree

    sheet, part = skin_sheet(), cut_below(field_mm)
    mean, below = np.asarray(part.bind @ sheet.mean_mm), np.asarray(part.bind @ field_mm)
    height = 2.2 + (ease_mm - 2.2) * smoothstep(0.0, 70.0, below)
    edges = border_loop(part.triangles)
    edges = edges[~part.on_border[edges].any(axis=1)]
    hem, at = np.unique(edges, return_inverse=True)
    a, b = edges.T
    c, d = (at.reshape(-1, 2) + len(mean)).T
    wall = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
    taut = ~part.on_border
    taut[hem] = False
    above_hem: Doubles = np.asarray(cKDTree(mean[hem]).query(mean)[0])
    fold = folds.heights_mm(mean) * smoothstep(0.0, 28.0, below) * smoothstep(0.0, 24.0, above_hem)
    uv = cloth_coordinates_mm(part, mean)
    return Panel(
        vstack([part.bind, part.bind[hem]]).tocsr(),
        np.concatenate([part.triangles, wall]).astype(np.int32),
        np.concatenate([height, np.full(len(hem), -0.5)]),
        np.concatenate([uv, uv[hem]]),
        fold_mm=np.concatenate([fold, np.zeros(len(hem))]),
        taut=np.concatenate([taut, np.zeros(len(hem), bool)]),
        covers=True,
    )


def swept_panel(
    field_mm: Doubles,
    profile: Sequence[tuple[Doubles, Doubles]],
    slot: str = "trim",
    columns: Sequence[Doubles] | None = None,
    fold_mm: Callable[[Doubles, Doubles], Doubles] | None = None,
) -> Panel:
    """Return a panel with a profile that is swept around the neck.

    field_mm : (n,) level of the points of the sheet, on which the profile places the rows [mm]
    profile : rows from the outer lower edge upwards, over the upper edge, and down on the inner side; each
        has its level and its height above the skin, both by angle from the front (RING_SIZE,) [mm]
    columns : angles of the columns in each row [rad]; None for closed rings. The ends are closed by joining
        the first row to the last one, the second to the last but one, and so on
    fold_mm : function of angles (n,) [rad] and rows (n,) that returns heights of folds (n,) [mm]
    """
    from scipy.sparse import vstack

    sheet = skin_sheet()
    angle = np.arctan2(sheet.mean_mm[:, 0], sheet.mean_mm[:, 2] - NECK_AXIS_Z_MM) % FULL_TURN
    binds: list[csr_array] = []
    heights, angles = list[Doubles](), list[Doubles]()
    rings: dict[bytes, csr_array] = {}
    for k, (level, height) in enumerate(profile):
        level, height = (np.broadcast_to(values, RING_SIZE) for values in (level, height))
        key = np.ascontiguousarray(level).tobytes()
        if key not in rings:
            rings[key] = ring_around(field_mm - np.interp(angle, COLUMNS, level, period=FULL_TURN))
        ring, own = rings[key], COLUMNS if columns is None else columns[k]
        binds.append(ring if columns is None else _between_columns(own) @ ring)
        heights.append(np.interp(own, COLUMNS, height, period=FULL_TURN))
        angles.append(own)
    bind = vstack(binds).tocsr()
    grid = Grid(len(profile), len(angles[0]), columns is None)
    mean = np.asarray(bind @ sheet.mean_mm).reshape(grid.rows, grid.columns, 3)
    lift = np.diff(np.stack(heights), axis=0, prepend=heights[0][None])
    step = np.linalg.norm(np.diff(mean, axis=0, prepend=mean[:1]), axis=-1)
    v = np.cumsum(np.hypot(step, lift), axis=0).mean(axis=1)
    u = np.stack(angles) * _MM_PER_RADIAN
    uv = np.stack([u, np.broadcast_to(v[:, None], u.shape)], axis=-1).reshape(-1, 2)
    height = np.concatenate(heights)
    row = np.repeat(np.arange(grid.rows, dtype=float), grid.columns)
    fold = None if fold_mm is None else fold_mm(np.concatenate(angles), row) * (height > 0.0)
    triangles = grid.triangles if columns is None else np.concatenate([grid.triangles, grid.end_caps])
    return Panel(bind, triangles, height, uv, slot, fold_mm=fold, grid=grid)


def _between_columns(angle: Doubles) -> csr_array:
    """Return weights (q, RING_SIZE) that interpolate between the columns of a ring at angles (q,) [rad]."""
    from scipy.sparse import csr_array

    place = (angle % FULL_TURN) / FULL_TURN * RING_SIZE
    before = np.floor(place).astype(np.int64) % RING_SIZE
    t = place - np.floor(place)
    rows = np.repeat(np.arange(len(angle)), 2)
    columns = np.stack([before, (before + 1) % RING_SIZE], axis=1).ravel()
    return csr_array((np.stack([1.0 - t, t], axis=1).ravel(), (rows, columns)), shape=(len(angle), RING_SIZE))


def _front_bind(x_mm: Doubles, y_mm: Doubles) -> csr_array:
    """Return weights (q, n) of the points of the sheet at positions (q,) seen from the front [mm]."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    sheet = skin_sheet()
    corners = sheet.mean_mm[sheet.triangles]
    middles = corners.mean(axis=1)
    front = np.flatnonzero(middles[:, 2] > NECK_AXIS_Z_MM)
    p = np.stack([x_mm, y_mm], axis=1)
    near = front[cKDTree(middles[front, :2]).query(p, k=_CANDIDATE_COUNT)[1]]
    a, b, c = (sheet.mean_mm[sheet.triangles[near, k], :2] - p[:, None] for k in range(3))
    weights = np.stack([cross_2d(b, c), cross_2d(c, a), cross_2d(a, b)], axis=-1)
    area = weights.sum(axis=-1, keepdims=True)
    weights = np.where(area > 1e-6, weights / np.maximum(area, 1e-6), -np.inf)
    best = weights.min(axis=-1).argmax(axis=1)
    triangle = near[np.arange(len(best)), best]
    rows = np.repeat(np.arange(len(best)), 3)
    own = weights[np.arange(len(best)), best].clip(0.0, 1.0)
    own /= own.sum(axis=1, keepdims=True)
    shape = len(best), len(sheet.mean_mm)
    return csr_array((own.ravel(), (rows, sheet.triangles[triangle].ravel())), shape=shape)


def front_panel(
    x_mm: Doubles, y_mm: Doubles, height_mm: Doubles, slot: str, is_closed: bool = False, covers: bool = False
) -> Panel:
    """Return a panel on the chest whose points are a grid (rows, columns) seen from the front [mm]."""
    rows, columns = x_mm.shape
    grid = Grid(rows, columns, is_closed)
    uv = np.stack([x_mm.ravel(), y_mm.ravel()], axis=1)
    bind = _front_bind(x_mm.ravel(), y_mm.ravel())
    return Panel(bind, grid.triangles, height_mm.ravel(), uv, slot, covers=covers, grid=grid)
