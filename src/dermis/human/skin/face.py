"""Zones, hairline and folds of the average face for skin painting, and how expressions change them."""

from __future__ import annotations

from collections import Counter
from functools import cache, lru_cache
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import float_columns, read_rows
from dermis.human.skin.measured import FACE_SITES, SiteDifferences

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
"""Facial movements. Movements before "flush" deepen folds, see folds.csv; the others move blood."""
FOLD_MOVEMENT_COUNT = MOVEMENTS.index("flush")
"""Number of movements that deepen folds."""
ZONE_AMOUNTS = (
    "blood", "melanin", "strength", "roughness", "pores", "furrows",
    "sun", "level", "around", "hair", "beard", "veins", "flush",
    "oxygen", "tension", "capillaries",
)  # fmt: skip
"""Quantities that zones of the face change, see zones.csv; shaders read them in groups of four."""
_REFERENCE_SITE = "cheek"
HAIRLINE_STEP_DEGREES = 2
"""Angle between samples of `hairline_heights` [degrees]."""
_HAIRLINE_SAMPLE_COUNT = 180 // HAIRLINE_STEP_DEGREES + 1
_FOLD_SAMPLES_PER_SEGMENT = 4
_MAX_CACHED_TABLES = 32  # number of results that each function caches
_CROWN_ZONE = "crown"  # zone where hair thins first
_TEMPLE_RECESSION_MM, _FOREHEAD_RECESSION_MM = 22.0, 16.0  # maximum recession of the hairline
_PEAK_MM, _PEAK_WIDTH_DEGREES = 9.0, 8.0  # depth and width of the hairline's peak where `widows_peak` is 1
_TEMPLE_DEGREES, _TEMPLE_WIDTH_DEGREES, _FOREHEAD_WIDTH_DEGREES = 33.0, 15.0, 38.0  # from the front


def movement_weights(target_names: tuple[str, ...], target_weights: Floats) -> Floats:
    """Return the strength (m,) of each facial movement in `MOVEMENTS`, 0 to 1, from morph target weights.

    target_names : names of the t morph targets
    target_weights : (t,) weights of the targets
    """
    return np.asarray(np.clip(_movement_matrix(target_names) @ target_weights, 0.0, 1.0), np.float32)


@cache
def _movement_matrix(target_names: tuple[str, ...]) -> Floats:
    """Return the contribution (m, t) of each morph target to each movement in `MOVEMENTS`."""
    table = np.zeros((len(MOVEMENTS), len(target_names)), np.float32)
    for row in read_rows(__package__, "movements"):
        if row["target"] in target_names:
            table[MOVEMENTS.index(row["movement"]), target_names.index(row["target"])] = float(row["share"])
    return table


@lru_cache(maxsize=_MAX_CACHED_TABLES)
def zone_table(recession: float = 0.0, site_differences: SiteDifferences | None = None) -> Floats:
    """Return the Gaussian zones of the face as rows (k, 24) for the paint shader.

    The columns are the centre (3) [mm], a zero, the inverse radii (3) [1/mm], a zero, and sixteen amounts by
    which the zone changes skin or hair, in the order of `ZONE_AMOUNTS`.

    recession : recession of the hair, 0 to 1, see `SkinLook`; it thins the hair at the crown
    site_differences : pigments at other sites of the face minus the pigments at the cheek; None if all sites
        have the pigments of the cheek
    """
    rows = read_rows(__package__, "zones")
    for row in rows:
        if row["zone"] == _CROWN_ZONE:
            row["hair"] = str(recession * float(row["hair"]))
    columns = "x y z", "rx ry rz", " ".join(ZONE_AMOUNTS)
    centres, radii, amounts = (float_columns(rows, names) for names in columns)
    if site_differences is not None:
        pigment_columns = [ZONE_AMOUNTS.index(name) for name in ("melanin", "blood", "oxygen")]
        amounts[:, pigment_columns] += _zone_amounts_of_sites() @ np.vstack(
            [np.zeros(3), site_differences.as_array()]
        )
    zero = np.zeros((len(rows), 1))
    return np.hstack([centres, zero, 1.0 / radii, zero, amounts]).astype(np.float32)


@cache
def lowest_zone_oxygen_change() -> float:
    """Return the most negative change of the oxygen saturation by a zone, at most 0 [-]."""
    return float(min(float_columns(read_rows(__package__, "zones"), "oxygen").min(), 0.0))


@cache
def _zone_amounts_of_sites() -> NDArray[np.float64]:
    """Return heights (k, 7) of the k Gaussian zones of the face, with one column for each of seven sites.

    The sites are positions on the face: the cheek, then `FACE_SITES`. With the heights of one column, the sum
    of all Gaussians is 1 at the site of this column and 0 at the six other sites. As zones overlap, a column
    has heights for several zones.
    """
    zones, names = read_rows(__package__, "zones"), (_REFERENCE_SITE, *FACE_SITES)
    places = {row["site"]: row for row in read_rows(__package__, "sites")}
    points = float_columns([places[name] for name in names], "x y z")
    centres, radii = float_columns(zones, "x y z"), float_columns(zones, "rx ry rz")
    weights = np.exp(-(((points[:, None] - centres) / radii) ** 2).sum(axis=-1))
    shares = np.array([[float(row["share"]) * (row["site"] == name) for name in names] for row in zones])
    return np.asarray(shares @ np.linalg.inv(weights @ shares))


@lru_cache(maxsize=_MAX_CACHED_TABLES)
def hairline_heights(recession: float = 0.0, widows_peak: float = 0.0) -> Floats:
    """Return the heights (91,) of the hairline above y = 0 [mm].

    The heights are for angles around the head from 0 (front) to 180 (back) in steps of 2 degrees.

    recession : recession of the hairline, 0 to 1, which is strongest at the temples, see `SkinLook`
    widows_peak : how far the middle of the hairline reaches down, 0 to 1, see `HairLook`
    """
    from scipy.interpolate import PchipInterpolator

    angle, height = float_columns(read_rows(__package__, "hairline"), "angle height").T
    edges = HAIRLINE_STEP_DEGREES * np.arange(_HAIRLINE_SAMPLE_COUNT)
    temples = np.exp(-(((edges - _TEMPLE_DEGREES) / _TEMPLE_WIDTH_DEGREES) ** 2))
    forehead = np.exp(-((edges / _FOREHEAD_WIDTH_DEGREES) ** 4))
    receded = recession * (_TEMPLE_RECESSION_MM * temples + recession * _FOREHEAD_RECESSION_MM * forehead)
    peak = np.exp(-edges / _PEAK_WIDTH_DEGREES) - 0.3 * temples
    return np.asarray(
        PchipInterpolator(angle, height)(edges) + receded - widows_peak * _PEAK_MM * peak, np.float32
    )


class Folds(NamedTuple):
    """Skin folds, such as the nasolabial fold, as polylines on the left half of the average face.

    knots : (k, 4) points of all polylines [mm], and the position of each point along its fold, 0 to 1
    curves : (c, 8) parameters of each fold: centre (3) and radius of its bounding sphere [mm]; its width
        [mm]; its depth in a young face and in an old face [mm]; and index plus 1 of the movement that deepens
        it, or 0 if no movement does
    first : (c + 1,) index of the first knot of each fold, and the number of knots at the end
    """

    knots: Floats
    curves: Floats
    first: NDArray[np.uint32]


@cache
def skin_folds() -> Folds:
    """Return the skin folds of folds.csv as smooth polylines with their dimensions."""
    knots, curves = list[NDArray[np.float64]](), list[NDArray[np.float64]]()
    for _, group in groupby(read_rows(__package__, "folds"), key=lambda row: row["fold"]):
        rows = list(group)
        curve = _spline_points(float_columns(rows, "x y z"))
        knots.append(np.column_stack([curve, np.linspace(0.0, 1.0, len(curve))]))
        dimensions = [float(rows[0][name]) for name in ("width", "young", "old")]
        movement = rows[0]["movement"]
        movement_code = 1 + MOVEMENTS.index(movement) if movement else 0
        curves.append(np.array([*_bounding_sphere(curve), *dimensions, movement_code]))
    first = np.cumsum([0, *map(len, knots)]).astype(np.uint32)
    return Folds(np.concatenate(knots).astype(np.float32), np.stack(curves).astype(np.float32), first)


@cache
def paint_table_sizes() -> dict[str, int]:
    """Return the number of zones, folds, fold knots and hairline samples, for use as shader constants."""
    lengths = Counter(row["fold"] for row in read_rows(__package__, "folds")).values()
    knots = sum(map(_spline_sample_count, lengths))
    return {
        "zones": len(zone_table()),
        "folds": len(lengths),
        "knots": knots,
        "edges": _HAIRLINE_SAMPLE_COUNT,
    }


def _spline_sample_count(knot_count: int) -> int:
    """Return the number of samples that represent a spline with `knot_count` knots."""
    return _FOLD_SAMPLES_PER_SEGMENT * (knot_count - 1) + 1


def _spline_points(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return samples of a cubic spline through knots (k, 3)."""
    from scipy.interpolate import CubicSpline

    index = np.arange(len(knots))
    return np.asarray(
        CubicSpline(index, knots)(np.linspace(0, len(knots) - 1, _spline_sample_count(len(knots))))
    )


def _bounding_sphere(points: NDArray[np.float64]) -> NDArray[np.float64]:
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())
