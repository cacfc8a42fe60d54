"""Registry of garments for the upper body, which consist of panels over the skin."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.curves import smoothstep
from dermis.human.wear.folds import Folds, smooth_noise
from dermis.human.wear.panels import Panel
from dermis.human.wear.sewing import (
    FULL_TURN,
    body_panel,
    column_angles,
    front_panel,
    swept_panel,
    towards_back,
)
from dermis.human.wear.skin_sheet import NECK_AXIS_Z_MM, RING_SIZE, skin_sheet

Pattern = Callable[[Folds], list[Panel]]
Profile = list[tuple[Doubles, Doubles]]


def _rib_profile(lower: float, upper: float, thickness: float) -> Profile:
    """Return the profile of a knitted band from a lower to an upper level, with a rounded upper edge [mm]."""
    t = thickness
    outer = [(lower + 0.8, 0.4), (lower + 0.6, t), (lower - 1.0, t + 0.6)]
    outer += [(level, t + 0.6) for level in np.linspace(lower - 4.0, upper + 2.5, 4)]
    inner = [(upper + 0.6, t + 0.2), (upper, t - 0.7), (upper + 0.5, 0.9), (upper + 6.0, 0.7)]
    return [(np.asarray(level), np.asarray(height)) for level, height in outer + inner]


def crew_neck(folds: Folds) -> list[Panel]:
    """Return the panels of a T-shirt or sweater with a round neckline and a knitted band."""
    level = skin_sheet().level_mm
    return [body_panel(level - 11.0, folds, 4.0), swept_panel(level, _rib_profile(13.0, -5.0, 2.4))]


def v_neck(folds: Folds) -> list[Panel]:
    """Return the panels of a shirt or sweater with a neckline that runs to a point on the chest."""
    sheet = skin_sheet()
    x, _, z = sheet.mean_mm.T
    depth = np.maximum(68.0 - 1.05 * np.hypot(x, 3.0), 0.0) * (z > NECK_AXIS_Z_MM)
    field = sheet.level_mm - depth
    return [body_panel(field - 10.0, folds, 4.0), swept_panel(field, _rib_profile(12.0, -4.0, 2.4))]


def high_neck(folds: Folds) -> list[Panel]:
    """Return the panels of a sweater with a tall collar that is folded down."""
    level, back = skin_sheet().level_mm, towards_back(column_angles())
    top, fold_edge = -(46.0 + 18.0 * back), -(8.0 + 6.0 * back)
    rows = [(np.full(RING_SIZE, 13.0), 0.6), (np.full(RING_SIZE, 12.5), 3.2), (np.full(RING_SIZE, 8.0), 3.8)]
    rows += [(0.5 * (8.0 + fold_edge), 4.2), (fold_edge - 6.0, 4.0), (fold_edge - 5.0, 5.0)]
    rows += [(fold_edge - 1.2, 6.0), (fold_edge, 7.4), (fold_edge - 1.5, 8.6)]
    rows += [(fold_edge + t * (top - fold_edge), 8.8 - 1.4 * t) for t in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)]
    rows += [(top + 0.6, 6.6), (top, 4.4), (top + 0.6, 2.0), (top + 4.0, 1.0), (top + 12.0, 0.8)]
    profile = [(level_mm, np.full(RING_SIZE, height)) for level_mm, height in rows]

    def slouch_mm(angle: Doubles, row: Doubles) -> Doubles:
        around = np.stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.55 * row], axis=1)
        outside = smoothstep(6.0, 9.5, row) * smoothstep(18.5, 16.0, row)  # without the folded edges
        return np.asarray(1.5 * np.maximum(smooth_noise(around, 8), 0.0) * outside)

    return [body_panel(level - 11.0, folds, 5.0), swept_panel(level, profile, fold_mm=slouch_mm)]


def shirt(folds: Folds) -> list[Panel]:
    """Return the panels of a shirt with a stand-up collar that is folded down, a placket and buttons."""
    level, angle = skin_sheet().level_mm, column_angles()
    back = towards_back(angle)
    crease = -(18.0 + 16.0 * back)
    stand = [(8.0 + 0.0 * back, 0.4), (7.0 + 0.0 * back, 2.2), (0.0 * back - 4.0, 3.2)]
    stand += [(0.5 * crease, 4.2), (crease + 1.5, 5.0)]
    stand += [(crease, 4.2), (crease + 1.5, 2.6), (0.6 * crease, 1.0), (0.0 * back + 4.0, 0.6)]
    band = swept_panel(level, [(one, np.full(RING_SIZE, height)) for one, height in stand], "cloth")
    return [
        body_panel(level - 5.0, folds, 5.0),
        _placket(),
        band,
        _collar_leaf(level, crease),
        *(_button(0.0, y) for y in (-212.0, -262.0, -312.0)),
    ]


def _collar_leaf(level_mm: Doubles, crease_mm: Doubles) -> Panel:
    """Return the part of a shirt collar that is folded down, with a point on each side of the opening.

    crease_mm : (RING_SIZE,) levels of the crease at the columns of a ring [mm]
    """
    angle = column_angles()
    edge = 14.0 + 40.0 * smoothstep(1.25, 0.35, angle)
    profile, columns = Profile(), list[Doubles]()
    outer = [
        (0.0, 5.4),
        (0.01, 7.4),
        (0.06, 9.0),
        (0.2, 9.4),
        (0.35, 8.2),
        (0.5, 6.6),
        (0.65, 5.4),
        (0.8, 4.8),
    ]
    outer += [(0.93, 4.8), (0.985, 4.7)]
    under = [
        (1.0, 4.0),
        (0.985, 3.0),
        (0.93, 2.8),
        (0.8, 2.8),
        (0.65, 3.2),
        (0.5, 4.2),
        (0.35, 5.8),
        (0.2, 6.8),
    ]
    under += [(0.06, 6.4), (0.01, 5.0)]
    for t, height in reversed(outer + under):
        start = np.radians(4.0 + 13.0 * t)
        columns.append(np.linspace(start, FULL_TURN - start, RING_SIZE - 1))
        profile.append((crease_mm + t * (edge - crease_mm), np.full(RING_SIZE, height)))
    return swept_panel(level_mm, profile, "cloth", columns)


def _placket() -> Panel:
    """Return the placket, the strip of cloth with the buttonholes."""
    across = np.array(
        [-17.5, -17.0, -16.0, -12.5, -11.5, -10.5, -4.0, 4.0, 10.5, 11.5, 12.5, 16.0, 17.0, 17.5]
    )
    rise = np.array([-2.0, 1.6, 2.0, 1.9, 1.5, 2.0, 2.2, 2.2, 2.0, 1.5, 1.9, 2.0, 1.6, -2.0])
    y = np.linspace(-352.0, -203.0, 44)
    x, y = np.meshgrid(across, y)
    return front_panel(x, y, np.broadcast_to(rise, x.shape), "cloth", covers=True)


def _button(x_mm: float, y_mm: float) -> Panel:
    """Return a round button with a rim, at a position seen from the front [mm]."""
    radius = np.array([5.6, 5.6, 5.0, 4.3, 3.4, 1.2, 0.05])
    height = np.array([0.3, 2.0, 2.6, 2.6, 1.9, 1.8, 1.8])
    angle = np.linspace(0.0, FULL_TURN, 24, endpoint=False)
    x, y = x_mm + radius[:, None] * np.cos(angle), y_mm + radius[:, None] * np.sin(angle)
    return front_panel(x, y, np.broadcast_to(height[:, None], x.shape), "button", is_closed=True)


def hoodie(folds: Folds) -> list[Panel]:
    """Return the panels of a hooded sweatshirt, with the hood down and two cords."""
    level, angle = skin_sheet().level_mm, column_angles()
    back = towards_back(angle)
    width, height = 11.0 + 27.0 * back**1.3, 5.0 + 21.0 * back**1.2
    middle = 3.0 + 13.0 * back**2
    profile = Profile()
    for phi in np.linspace(-0.42, 1.28, 25) * np.pi:
        above = np.sin(phi) + 0.16 * np.sin(2.0 * phi)
        profile.append((middle + width * np.cos(phi), np.maximum(1.0 + height * (0.42 + above), 0.8)))

    def creases_mm(angle: Doubles, row: Doubles) -> Doubles:
        around = np.stack([2.1 * np.cos(angle), 2.1 * np.sin(angle), 0.16 * row], axis=1)
        size = 0.35 + 0.65 * towards_back(angle)
        return np.asarray(6.0 * size * smooth_noise(around, 9) * np.sin(np.pi * row / 24.0))

    cords = [_cord(side * 15.0, side * 24.0, -198.0, end) for side, end in ((-1.0, -318.0), (1.0, -306.0))]
    return [
        body_panel(level - 6.0, folds, 6.0),
        swept_panel(level, profile, "cloth", fold_mm=creases_mm),
        *cords,
    ]


def _cord(top_x_mm: float, low_x_mm: float, top_y_mm: float, low_y_mm: float) -> Panel:
    """Return a cord that hangs over the chest between two positions seen from the front [mm]."""
    t = np.linspace(0.0, 1.0, 40)
    x = top_x_mm + (low_x_mm - top_x_mm) * smoothstep(-0.2, 1.2, t) + 2.0 * np.sin(5.0 * t + top_x_mm)
    y = top_y_mm + (low_y_mm - top_y_mm) * t
    radius = 2.2 + 0.9 * (t > 0.9) - 2.1 * ((t == 1.0) | (t == 0.0))
    angle = np.linspace(FULL_TURN, 0.0, 10, endpoint=False)
    across = x[:, None] - radius[:, None] * np.cos(angle)
    height = 3.2 + radius[:, None] * (1.0 + np.sin(angle))
    return front_panel(across, np.broadcast_to(y[:, None], across.shape), height, "cord", is_closed=True)


GARMENTS: Mapping[str, Pattern] = {
    "crew neck": crew_neck,
    "v-neck": v_neck,
    "high neck": high_neck,
    "shirt": shirt,
    "hoodie": hoodie,
}
"""Functions that make the panels of garments, by the name of the garment."""


@cache
def garment_panels(garment: str, folds: Folds) -> list[Panel]:
    """Return the panels of a garment, cached."""
    return GARMENTS[garment](folds)
