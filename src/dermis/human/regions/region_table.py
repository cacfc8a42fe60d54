"""Face regions on the average human, and the table of their roughness and specular strength."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_number
from dermis.base.reading import read_toml

Doubles = NDArray[np.float64]
Mask = NDArray[np.bool_]

REGIONS = (
    "forehead",
    "brow",
    "eyelid",
    "nose",
    "cheek",
    "upper lip",
    "lips",
    "chin",
    "ear",
    "neck and scalp",
)
"""Names of the regions; "upper lip" is the skin between nose and mouth."""

# Artist's values on the average human [mm].
_NOSE_OUTLINE = np.array(
    [[-49.0, 7.0], [-46, 15], [-41, 19.5], [-35, 19.5], [-29, 17.5], [-20, 12], [-10, 9], [6, 6]]
)
"""Outline of the nose as pairs: a height on the nose, and half the width of the nose there [mm]."""
_NOSE_BASE = np.array([[0.0, -49.0], [7, -48], [12, -45.5], [18, -43]])
"""Base of the nose as pairs: a distance from the middle of the face, and the base's height there [mm]."""
_NASOLABIAL_FOLD = np.array([[-68.0, 27.0], [-60, 24.5], [-50, 21.5], [-43, 20]])
"""Fold between upper lip and cheek as pairs: a height, and the distance from the middle of the face [mm]."""
_CHIN_OUTLINE = np.array([[-110.0, 26.0], [-68, 22.0]])
"""Outline of the chin as pairs: a height on the chin, and half the width of the chin there [mm]."""


_MIN_NOSE_Z_MM, _JAW_Y_MM = -20.0, -108.0
_NECK_NOTCH_YZ_MM = -195.0, -42.0  # notch between the collar bones, at the base of the neck
DEFAULT_TABLE_NAME = "default"
"""Name of the package's own table, which holds artist's values instead of measured ones."""
REGION_VALUE_LIMITS = {"m": (0.05, 1.0), "rho_s": (0.0, 1.0)}
_KEYS_WITH_FILE_NAMES = ("landmarks", "labels")


def nose_distance_mm(points: Doubles) -> Doubles:
    """Return the signed distance (n,) of points to the outline of the nose, positive on the nose [mm].

    points : (n, 3) positions on the average human [mm]
    """
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    top, half = _NOSE_OUTLINE[-1]
    beside = np.interp(y, *_NOSE_OUTLINE.T) - np.maximum(y - top, 0.0) * half - x
    return np.where(z > _MIN_NOSE_Z_MM, np.minimum(beside, y - np.interp(x, *_NOSE_BASE.T)), -1.0)


def neck_distance_mm(points: Doubles) -> Doubles:
    """Return the vertical distances (n,) of points from the border between head and neck [mm].

    Seen from the side, the border rises from the jaw to the back of the skull. The distance is positive below
    the border, on the neck, and negative on the head.

    points : (n, 3) positions on the average human [mm]
    """
    return np.asarray(_JAW_Y_MM + 0.42 * np.maximum(6 - points[:, 2], 0) - points[:, 1])


def torso_distance_mm(points: Doubles) -> Doubles:
    """Return the vertical distance (n,) of each point below the base of the neck [mm].

    The base of the neck runs from the notch between the collar bones to the lowest vertebra of the neck, over
    the shoulders. The distance is positive on the torso and negative on neck and head.

    points : (n, 3) positions on the average human [mm]
    """
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    base_y = _NECK_NOTCH_YZ_MM[0] - 0.417 * (z - _NECK_NOTCH_YZ_MM[1]) + 0.35 * x
    return np.asarray(base_y - y)


def classify_regions(points: Doubles, on_lips: Mask, on_ears: Mask) -> NDArray[np.int64]:
    """Return the face region (n,) of points on the average human, as indices into `REGIONS`.

    points : (n, 3) positions [mm]
    on_lips : (n,) mask of points on the lips or inside the mouth
    on_ears : (n,) mask of points on the ears
    """
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    front, above_jaw = z > _MIN_NOSE_Z_MM, neck_distance_mm(points) < 0
    tests = {
        "ear": on_ears,
        "lips": on_lips,
        "eyelid": (((x - 30) / 18) ** 2 + ((y + 0.5) / 12) ** 2 < 1) & (z > -40),
        "brow": _brow_mask(x, y) & (z > -30),
        "nose": front
        & (x < np.interp(y, _NOSE_OUTLINE[:, 0], _NOSE_OUTLINE[:, 1], right=0.0))
        & (y > np.interp(x, *_NOSE_BASE.T)),
        "upper lip": front & (y > -68) & (y < -40) & (x < np.interp(y, *_NASOLABIAL_FOLD.T)),
        "chin": front & above_jaw & (y <= -68) & (x < np.interp(y, *_CHIN_OUTLINE.T)),
        "forehead": (y > 10) & (y < 72 - 0.006 * np.maximum(x - 20, 0) ** 2) & (z > -45),
        "cheek": (z > -66) & (y <= 24) & above_jaw,
    }
    order = [REGIONS.index(name) for name in tests]
    return np.select(list(tests.values()), order, default=REGIONS.index("neck and scalp"))


def _brow_mask(x: Doubles, y: Doubles) -> Mask:
    """Return a mask (n,) of points inside the brows, from their x and y on the average person [mm]."""
    middle = 20.5 - ((x - 33) / 10) ** 2 * 1.2
    inside = np.abs(y - middle) < 5.5 - 0.06 * np.maximum(x - 20, 0)
    return np.asarray(inside & (x > 9) & (x < 55))


@dataclass(frozen=True)
class RegionTable:
    """Roughness and specular strength of each face region.

    values : (10, 2) Beckmann roughness m and specular strength rho_s [-], in the order of `REGIONS`
    landmarks : CSV file of the head's landmarks, for heads unknown to the package
    labels : label map of the head, whose texels are indices into `REGIONS`; used instead of landmarks
    """

    values: NDArray[np.float64]
    landmarks: Path | None = None
    labels: Path | None = None


def load_region_table(name_or_path: str | Path) -> RegionTable:
    """Load a region table from a TOML file; the name "default" loads the package's own table.

    Raises DermisError for missing and unknown regions and for invalid numbers.
    """
    if str(name_or_path) == DEFAULT_TABLE_NAME:
        text = resources.files(__package__).joinpath("default.toml").read_text("utf-8")
        return _build_table(tomllib.loads(text), Path(DEFAULT_TABLE_NAME))
    return _build_table(read_toml(name_or_path, "default, or regions in TOML"), Path(name_or_path))


def _build_table(region_entries: dict[str, Any], path: Path) -> RegionTable:
    files = {
        key: _file_path(path, key, region_entries.pop(key))
        for key in _KEYS_WITH_FILE_NAMES
        if key in region_entries
    }
    if set(region_entries) != set(REGIONS):
        wrong = sorted(set(region_entries) - set(REGIONS)) or sorted(set(REGIONS) - set(region_entries))
        actual = f"[{wrong[0]}] {'is none of them' if wrong[0] in region_entries else 'is missing'}"
        refuse(path, f"one table for each of {', '.join(REGIONS)}", actual, "Correct it")
    values = [_region_values(path, region, region_entries[region]) for region in REGIONS]
    return RegionTable(np.array(values), **files)


def _region_values(path: Path, region: str, region_entry: Any) -> list[float]:
    label = f"{path}: {region}"
    if not isinstance(region_entry, dict) or region_entry.keys() != REGION_VALUE_LIMITS.keys():
        refuse(label, "m and rho_s", f"got {format_value(region_entry)}", "Give both, and nothing else")
    return [
        checked_number(f"{label}: {name}", region_entry[name], *limits)
        for name, limits in REGION_VALUE_LIMITS.items()
    ]


def _file_path(path: Path, table_key: str, file_name: Any) -> Path:
    if not isinstance(file_name, str):
        refuse(
            f"{path}: {table_key}",
            "the name of a file",
            f"got {format_value(file_name)}",
            "Write it in quotes",
        )
    return path.parent / file_name
