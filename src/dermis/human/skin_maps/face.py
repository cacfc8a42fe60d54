"""Tables of a bust for the kernels: its warp, zones, lines of lips and lids, and folds."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust import ears, eyes, lips, nose
from dermis.human.bust.fields import Doubles, gradient, spline
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.shape import symmetric
from dermis.human.bust.warp import make_warp
from dermis.tables import numbers, read_rows

_STEP_MM = 0.25
DEGREES = 2
"""Angle between the columns of `Face.hairline`."""
_REACH_MM = 52.0
_UPPER_LID_MM = 0.5  # from the line of the lids to where they meet
_AMOUNTS = "blood melanin strength roughness pores furrows freckles level around hair"
_PIECES = 4


class Face(NamedTuple):
    """Tables of one bust.

    width, centres, radii, shifts : of the warp; see `warp.Warp`
    zone_centres, zone_radii : (k, 3) of soft zones on the symmetric head [mm]
    zone_amounts : (k, 10) what each zone changes, see zones.csv
    lips : (3, m) heights of the upper border, the line and the lower border of the lips [mm]
    lids : (m,) height of the line where the lids meet [mm]
    hairline : (91,) height of the edge of the hair, by the angle from the front [mm]
    step_mm : distance in x between columns of `lips` and `lids`, from 0 [mm]
    """

    width: float
    centres: Doubles
    radii: Doubles
    shifts: Doubles
    zone_centres: Doubles
    zone_radii: Doubles
    zone_amounts: Doubles
    lips: Doubles
    lids: Doubles
    hairline: Doubles
    step_mm: float


def make_face(parameters: BustParameters) -> Face:
    """The tables of the bust of these parameters."""
    warp = make_warp(parameters)
    centres, radii, amounts = _zones(parameters)
    return Face(
        warp.width, warp.centres, warp.radii, warp.shifts, centres, radii, amounts,
        _curves(lips.BORDERS), _curves(eyes.LINES)[0] - _UPPER_LID_MM, _hairline(), _STEP_MM,
    )  # fmt: skip


def _zones(parameters: BustParameters) -> tuple[Doubles, Doubles, Doubles]:
    """Centres, radii and amounts of the zones, grown with their parts."""
    rows = read_rows(__package__, "zones")
    centres, radii, amounts = (numbers(rows, names) for names in ("x y z", "rx ry rz", _AMOUNTS))
    growth = {
        "face": (np.zeros(3), np.ones(3)),
        "nose": (nose.BASE, nose.growth(parameters)),
        "ear": (ears.CENTRE, np.full(3, parameters.ears)),
    }
    base = np.array([growth[row["part"]][0] for row in rows])
    factor = np.array([growth[row["part"]][1] for row in rows])
    return base + (centres - base) * factor, radii * factor, amounts


def _curves(knots: Doubles) -> Doubles:
    """Smooth curves through knots, rows of x and heights, at even steps of x, level beyond the ends."""
    from scipy.interpolate import CubicSpline

    x = np.arange(0.0, _REACH_MM, _STEP_MM)
    return np.ascontiguousarray(CubicSpline(knots[:, 0], knots[:, 1:])(np.clip(x, *knots[[0, -1], 0])).T)


def _hairline() -> Doubles:
    from scipy.interpolate import PchipInterpolator

    angle, height = numbers(read_rows(__package__, "hairline"), "angle height").T
    return np.asarray(PchipInterpolator(angle, height)(np.arange(0, 181, DEGREES)))


class Folds(NamedTuple):
    """Curves of straight pieces on the left half of the symmetric head.

    knots : (k, 3) of all curves [mm]
    along : (k,) from 0 at a curve's start to 1 at its end [-]
    first : (c + 1,) where each curve begins
    bounds : (c, 4) centre and radius of a ball around it [mm]
    width_mm, depth_mm : (c,) of the furrow [mm]
    """

    knots: Doubles
    along: Doubles
    first: NDArray[np.int64]
    bounds: Doubles
    width_mm: Doubles
    depth_mm: Doubles


def make_folds(parameters: BustParameters, age: float) -> Folds:
    """The folds of a face of this age, 0 to 1, on its skin."""
    curves, sizes = [], []
    for _, group in groupby(read_rows(__package__, "folds"), key=lambda row: row["fold"]):
        rows = list(group)
        curves.append(spline(numbers(rows, "x y z"), _PIECES))
        width, young, old = (float(rows[0][name]) for name in ("width", "young", "old"))
        sizes.append((width, young + age * (old - young)))
    lengths = [len(curve) for curve in curves]
    knots = _on_skin(np.concatenate(curves), parameters)
    first = np.concatenate(([0], np.cumsum(lengths)))
    along = np.concatenate([np.linspace(0.0, 1.0, length) for length in lengths])
    bounds = np.array([_ball(part) for part in np.split(knots, first[1:-1])])
    width_mm, depth_mm = np.array(sizes).T
    return Folds(knots, along, first, bounds, width_mm.copy(), depth_mm.copy())


def _on_skin(points: Doubles, parameters: BustParameters) -> Doubles:
    """Points (n, 3) of the symmetric head moved onto its skin."""
    for _ in range(5):
        slope = gradient(lambda p: symmetric(p, parameters), points)
        away = symmetric(points, parameters) / np.maximum(np.einsum("ni,ni->n", slope, slope), 0.05)
        points = points - slope * away[:, None]
    return points


def _ball(points: Doubles) -> Doubles:
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())
