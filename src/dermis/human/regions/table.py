"""Tables of roughness and strength by region, as TOML."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.human.regions.zones import REGIONS

DEFAULT = "default"
"""Name of the package's own table, of artist's values."""
LIMITS = {"m": (0.05, 1.0), "rho_s": (0.0, 1.0)}
_FILES = ("landmarks", "labels")


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


def load_table(name: str | Path) -> RegionTable:
    """The table of a TOML file, or the package's own by the name "default".

    Raises DermisError when a region is missing, unknown, or has invalid numbers.
    """
    if str(name) == DEFAULT:
        own = resources.files(__package__).joinpath("default.toml").read_text("utf-8")
        return _table(tomllib.loads(own), Path(DEFAULT))
    path = Path(name)
    try:
        return _table(tomllib.loads(path.read_text(encoding="utf-8")), path)
    except OSError as error:
        refuse(name, "default, or regions in TOML", f"it cannot be read ({error.strerror})", "Check the name")
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        refuse(name, "regions in TOML", f"its text is not TOML ({error})", "Correct it there")


def _table(entries: dict[str, Any], path: Path) -> RegionTable:
    files = {key: _file(path, key, entries.pop(key)) for key in _FILES if key in entries}
    if set(entries) != set(REGIONS):
        odd = sorted(set(entries) - set(REGIONS)) or sorted(set(REGIONS) - set(entries))
        came = f"[{odd[0]}] {'is none of them' if odd[0] in entries else 'is missing'}"
        refuse(path, f"one table for each of {', '.join(REGIONS)}", came, "Correct it")
    return RegionTable(np.array([_row(path, region, entries[region]) for region in REGIONS]), **files)


def _row(path: Path, region: str, entry: Any) -> list[float]:
    if not isinstance(entry, dict) or entry.keys() != LIMITS.keys():
        refuse(f"{path}: {region}", "m and rho_s", f"{entry!r} came", "Give both, and nothing else")
    for quantity, (low, high) in LIMITS.items():
        value = entry[quantity]
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            expected = f"a number from {low:g} to {high:g}"
            refuse(f"{path}: {region}: {quantity}", expected, f"{value!r} came", "Choose within")
    return [float(entry[quantity]) for quantity in LIMITS]


def _file(path: Path, key: str, name: Any) -> Path:
    if not isinstance(name, str):
        refuse(f"{path}: {key}", "the name of a file", f"{name!r} came", "Write it in quotes")
    return path.parent / name
