"""Regions of the face on the average human, and the table of their roughness and strength."""

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
"""Names of the labels; the sixth is the skin between nose and mouth."""

# Artist's values on the average human [mm].
_NOSE_OUTLINE = np.array(
    [[-49.0, 7.0], [-46, 15], [-41, 19.5], [-35, 19.5], [-29, 17.5], [-20, 12], [-10, 9], [6, 6]]
)
"""Height and half the breadth of the nose."""
_NOSE_BASE = np.array([[0.0, -49.0], [7, -48], [12, -45.5], [18, -43]])
"""From the middle outwards, height at which the nose ends."""
_NASOLABIAL_FOLD = np.array([[-68.0, 27.0], [-60, 24.5], [-50, 21.5], [-43, 20]])
"""Height and distance from the middle of the fold between the skin over the upper lip and the cheek."""
_CHIN_OUTLINE = np.array([[-110.0, 26.0], [-68, 22.0]])


_MIN_NOSE_Z, _JAW_Y = -20.0, -108.0
DEFAULT_TABLE = "default"
"""Name of the package's own table, of artist's values."""
LIMITS = {"m": (0.05, 1.0), "rho_s": (0.0, 1.0)}
_FILES = ("landmarks", "labels")


def nose_distance_mm(places: Doubles) -> Doubles:
    """How far (n,) places (n, 3) on the average human are inside of the nose [mm]."""
    x, y, z = np.abs(places[:, 0]), places[:, 1], places[:, 2]
    top, half = _NOSE_OUTLINE[-1]
    beside = np.interp(y, *_NOSE_OUTLINE.T) - np.maximum(y - top, 0.0) * half - x
    return np.where(z > _MIN_NOSE_Z, np.minimum(beside, y - np.interp(x, *_NOSE_BASE.T)), -1.0)


def neck_distance_mm(places: Doubles) -> Doubles:
    """How far (n,) places (n, 3) on the average human are below the jaw and the skull [mm]."""
    return np.asarray(_JAW_Y + 0.42 * np.maximum(6 - places[:, 2], 0) - places[:, 1])


def classify_regions(places: Doubles, lips: Mask, ears: Mask) -> NDArray[np.int64]:
    """Index into `REGIONS` (n,) of places (n, 3) on the average human [mm].

    lips, ears : (n,) what is these, the inside of the mouth with the lips
    """
    x, y, z = np.abs(places[:, 0]), places[:, 1], places[:, 2]
    front, above_jaw = z > _MIN_NOSE_Z, neck_distance_mm(places) < 0
    tests = {
        "ear": ears,
        "lips": lips,
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
    """The arch where eyebrows grow, thinner outwards."""
    middle = 20.5 - ((x - 33) / 10) ** 2 * 1.2
    inside = np.abs(y - middle) < 5.5 - 0.06 * np.maximum(x - 20, 0)
    return np.asarray(inside & (x > 9) & (x < 55))


@dataclass(frozen=True)
class RegionTable:
    """Roughness and strength by region.

    values : (10, 2) roughness m and strength rho_s [-] in the order of `zones.REGIONS`
    landmarks : file of the head's landmarks, for heads that the package does not know
    labels : picture of the head's labels, which then needs no landmarks
    """

    values: NDArray[np.float64]
    landmarks: Path | None = None
    labels: Path | None = None


def load_region_table(name: str | Path) -> RegionTable:
    """The table of a TOML file, or the package's own by the name "default".

    Raises DermisError when a region is missing, unknown, or has invalid numbers.
    """
    if str(name) == DEFAULT_TABLE:
        own = resources.files(__package__).joinpath("default.toml").read_text("utf-8")
        return _table(tomllib.loads(own), Path(DEFAULT_TABLE))
    return _table(read_toml(name, "default, or regions in TOML"), Path(name))


def _table(entries: dict[str, Any], path: Path) -> RegionTable:
    files = {key: _file_path(path, key, entries.pop(key)) for key in _FILES if key in entries}
    if set(entries) != set(REGIONS):
        unexpected = sorted(set(entries) - set(REGIONS)) or sorted(set(REGIONS) - set(entries))
        actual = f"[{unexpected[0]}] {'is none of them' if unexpected[0] in entries else 'is missing'}"
        refuse(path, f"one table for each of {', '.join(REGIONS)}", actual, "Correct it")
    return RegionTable(
        np.array([_region_values(path, region, entries[region]) for region in REGIONS]), **files
    )


def _region_values(path: Path, region: str, entry: Any) -> list[float]:
    if not isinstance(entry, dict) or entry.keys() != LIMITS.keys():
        refuse(
            f"{path}: {region}", "m and rho_s", f"got {format_value(entry)}", "Give both, and nothing else"
        )
    where = f"{path}: {region}"
    return [checked_number(f"{where}: {name}", entry[name], *limits) for name, limits in LIMITS.items()]


def _file_path(path: Path, key: str, name: Any) -> Path:
    if not isinstance(name, str):
        refuse(f"{path}: {key}", "the name of a file", f"got {format_value(name)}", "Write it in quotes")
    return path.parent / name
