"""Places and amounts of the skin of a face, and what expressions change: folds and blood."""

from __future__ import annotations

from collections import Counter
from functools import cache, lru_cache
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import float_columns, read_rows

Floats = NDArray[np.float32]

MOVEMENTS = (
    "raised-brows",
    "frown",
    "sneer",
    "squint",
    "smile",
    "sad-mouth",
    "raised-chin",
    "flush",
    "pressed",
)
"""Those that deepen folds, see folds.csv, then those that move blood."""
FOLD_MOVEMENTS = MOVEMENTS.index("flush")
"""How many deepen folds."""
ZONE_AMOUNTS = (
    "blood", "melanin", "strength", "roughness", "pores", "furrows",
    "sun", "level", "around", "hair", "beard", "veins",
)  # fmt: skip
"""What zones change, see zones.csv."""
HAIRLINE_STEP_DEGREES = 2
"""Angle between the heights of `hairline_heights`."""
_HAIRLINE_SAMPLES = 180 // HAIRLINE_STEP_DEGREES + 1
_SAMPLES_PER_SEGMENT = 4
_CACHE_SIZE = 32  # tables of receding hair
_CROWN = "crown"  # zone that thin hair leaves
_TEMPLE_RECESSION_MM, _FOREHEAD_RECESSION_MM = (
    22.0,
    16.0,
)  # by which hair recedes at most, there and all over the forehead
_TEMPLE_DEGREES, _TEMPLE_WIDTH_DEGREES, _FOREHEAD_WIDTH_DEGREES = (
    33.0,
    15.0,
    38.0,
)  # where these are and how wide [degrees]


def movement_weights(names: tuple[str, ...], weights: Floats) -> Floats:
    """(m,) how far each movement is made, 0 to 1.

    names, weights : of a rig's targets
    """
    return np.asarray(np.clip(_movement_matrix(names) @ weights, 0.0, 1.0), np.float32)


@cache
def _movement_matrix(names: tuple[str, ...]) -> Floats:
    """(m, t) of each target in each movement."""
    table = np.zeros((len(MOVEMENTS), len(names)), np.float32)
    for row in read_rows(__package__, "movements"):
        if row["target"] in names:
            table[MOVEMENTS.index(row["movement"]), names.index(row["target"])] = float(row["share"])
    return table


@lru_cache(maxsize=_CACHE_SIZE)
def zone_table(recession: float = 0.0) -> Floats:
    """(k, 20) of each zone its centre and 0, one over its radii and 0 [mm], and its amounts.

    recession : see `SkinLook`
    """
    rows = read_rows(__package__, "zones")
    for row in rows:
        if row["zone"] == _CROWN:
            row["hair"] = str(recession * float(row["hair"]))
    centres, radii, amounts = (
        float_columns(rows, names) for names in ("x y z", "rx ry rz", " ".join(ZONE_AMOUNTS))
    )
    none = np.zeros((len(rows), 1))
    return np.hstack([centres, none, 1.0 / radii, none, amounts]).astype(np.float32)


@lru_cache(maxsize=_CACHE_SIZE)
def hairline_heights(recession: float = 0.0) -> Floats:
    """(91,) height of the edge of the hair, by the angle from the front [mm].

    recession : see `SkinLook`; hair leaves the temples first
    """
    from scipy.interpolate import PchipInterpolator

    angle, height = float_columns(read_rows(__package__, "hairline"), "angle height").T
    edges = HAIRLINE_STEP_DEGREES * np.arange(_HAIRLINE_SAMPLES)
    temples = np.exp(-(((edges - _TEMPLE_DEGREES) / _TEMPLE_WIDTH_DEGREES) ** 2))
    forehead = np.exp(-((edges / _FOREHEAD_WIDTH_DEGREES) ** 4))
    receded = recession * (_TEMPLE_RECESSION_MM * temples + recession * _FOREHEAD_RECESSION_MM * forehead)
    return np.asarray(PchipInterpolator(angle, height)(edges) + receded, np.float32)


class Folds(NamedTuple):
    """Curves of straight pieces on the left half of the average person.

    knots : (k, 4) of all curves [mm], and how far along their curve each is, from 0 to 1
    curves : (c, 8) centre and radius of a ball around each, its width, its depth in a young and in an old
        face [mm], and the number of the movement that deepens it, from 1; 0 for none
    first : (c + 1,) where each curve begins
    """

    knots: Floats
    curves: Floats
    first: NDArray[np.uint32]


@cache
def fold_curves() -> Folds:
    """The folds of the face."""
    knots, curves = list[NDArray[np.float64]](), list[NDArray[np.float64]]()
    for _, group in groupby(read_rows(__package__, "folds"), key=lambda row: row["fold"]):
        rows = list(group)
        curve = _spline_points(float_columns(rows, "x y z"))
        knots.append(np.column_stack([curve, np.linspace(0.0, 1.0, len(curve))]))
        table_sizes = [float(rows[0][name]) for name in ("width", "young", "old")]
        movement = rows[0]["movement"]
        curves.append(
            np.array(
                [*_bounding_sphere(curve), *table_sizes, 1 + MOVEMENTS.index(movement) if movement else 0]
            )
        )
    first = np.cumsum([0, *map(len, knots)]).astype(np.uint32)
    return Folds(np.concatenate(knots).astype(np.float32), np.stack(curves).astype(np.float32), first)


@cache
def table_sizes() -> dict[str, int]:
    """How many zones, folds, knots and edges there are; found without the libraries that draw curves."""
    lengths = Counter(row["fold"] for row in read_rows(__package__, "folds")).values()
    knots = sum(map(_sample_count, lengths))
    return {"zones": len(zone_table()), "folds": len(lengths), "knots": knots, "edges": _HAIRLINE_SAMPLES}


def _sample_count(knots: int) -> int:
    """Places on a curve through so many knots."""
    return _SAMPLES_PER_SEGMENT * (knots - 1) + 1


def _spline_points(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places on the smooth curve through some, several from each to the next."""
    from scipy.interpolate import CubicSpline

    place = np.arange(len(knots))
    return np.asarray(CubicSpline(place, knots)(np.linspace(0, len(knots) - 1, _sample_count(len(knots)))))


def _bounding_sphere(points: NDArray[np.float64]) -> NDArray[np.float64]:
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())
