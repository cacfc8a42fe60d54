"""Tables of roughness and strength by region, as TOML."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import number
from dermis.base.reading import read_toml
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
    return _table(read_toml(name, "default, or regions in TOML"), Path(name))


def _table(entries: dict[str, Any], path: Path) -> RegionTable:
    files = {key: _file(path, key, entries.pop(key)) for key in _FILES if key in entries}
    if set(entries) != set(REGIONS):
        odd = sorted(set(entries) - set(REGIONS)) or sorted(set(REGIONS) - set(entries))
        came = f"[{odd[0]}] {'is none of them' if odd[0] in entries else 'is missing'}"
        refuse(path, f"one table for each of {', '.join(REGIONS)}", came, "Correct it")
    return RegionTable(np.array([_row(path, region, entries[region]) for region in REGIONS]), **files)


def _row(path: Path, region: str, entry: Any) -> list[float]:
    if not isinstance(entry, dict) or entry.keys() != LIMITS.keys():
        refuse(
            f"{path}: {region}", "m and rho_s", f"{shown_value(entry)} came", "Give both, and nothing else"
        )
    where = f"{path}: {region}"
    return [number(f"{where}: {name}", entry[name], *limits) for name, limits in LIMITS.items()]


def _file(path: Path, key: str, name: Any) -> Path:
    if not isinstance(name, str):
        refuse(f"{path}: {key}", "the name of a file", f"{shown_value(name)} came", "Write it in quotes")
    return path.parent / name
