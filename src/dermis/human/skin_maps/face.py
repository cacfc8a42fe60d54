"""What the compiled loops need to know of a bust: its warp, its zones, and the lines of lips and lids."""

from __future__ import annotations

import csv
from importlib import resources
from typing import NamedTuple

import numpy as np

from dermis.human.bust import ears, eyes, lips, nose
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.warp import make_warp
from dermis.human.skin_maps.patch import Doubles

_STEP_MM = 0.25
DEGREES = 2
"""Angle between the columns of `Face.hairline`."""
_REACH_MM = 52.0
_UPPER_LID_MM = 0.5  # from the line of the lids to where they meet
_AMOUNTS = (
    "blood",
    "melanin",
    "strength",
    "roughness",
    "pores",
    "furrows",
    "freckles",
    "level",
    "around",
    "hair",
)


class Face(NamedTuple):
    """Tables of one bust.

    width, centres, radii, shifts : of the warp; see `warp.Warp`
    zone_centres, zone_radii : (k, 3) of soft zones on the symmetric head [mm]
    zone_amounts : (k, 10) what each zone changes, see the table zones.csv
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


def read_rows(table: str) -> list[dict[str, str]]:
    """Rows of one of this folder's tables."""
    text = resources.files(__package__).joinpath(f"{table}.csv").read_text("utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _zones(parameters: BustParameters) -> tuple[Doubles, Doubles, Doubles]:
    """Centres, radii and amounts of the zones, grown with their parts."""
    rows = read_rows("zones")
    centres, radii, amounts = (
        np.array([[float(row[name]) for name in names] for row in rows])
        for names in (("x", "y", "z"), ("rx", "ry", "rz"), _AMOUNTS)
    )
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

    angle, height = np.array([[float(row["angle"]), float(row["height"])] for row in read_rows("hairline")]).T
    return np.asarray(PchipInterpolator(angle, height)(np.arange(0, 181, DEGREES)))
