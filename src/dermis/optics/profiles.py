"""Profiles that a renderer can use: the published table, tables and fits in files, and tissue by name."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.atomic_write import replacing
from dermis.base.errors import refuse
from dermis.base.quantities import numbers
from dermis.base.reading import named_path, read_text, read_toml
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.fits.targets import Rings
from dermis.optics.gaussians import MOST_WEIGHT, WIDEST_MM2, GaussianSum
from dermis.optics.media import Floats
from dermis.optics.radial import RadialProfile
from dermis.optics.tissue import Tissue, load_tissue, names

PUBLISHED = "gpu-gems-3"
TERMS = 6
COUNTED_MODELS = "counted", "montecarlo"
"""Models whose profiles are of photons."""
_HEADER = ["variance_mm2", "red", "green", "blue"]
_FILE_FORM = "a CSV file with the columns " + ",".join(_HEADER)
_KEPT_FILES = 16
_MEND = "Correct the profile's table"


def preset_names() -> tuple[str, ...]:
    """Names that `load_profile` knows without a file."""
    return (PUBLISHED, *names())


def load_profile(
    name: str | Path, pigments: Mapping[str, float] | None = None, near: GaussianSum | None = None
) -> GaussianSum:
    """The Gaussians of a name ("gpu-gems-3", "dj3" ...) or of a file: .csv, or .toml of `dermis profile`.

    Tissue without Gaussians of its own is fitted with six: half-spaces of one medium by counted photons,
    other tissue by layered diffusion.

    pigments : fields of `SkinParameters` that replace those of a skin of pigments
    near : the fit of similar pigments to start from, several times faster

    Raises DermisError when there is no such preset or file, or when its numbers cannot be a profile.
    """
    named_path(name, "a profile")
    if pigments:
        return fit_profile(load_tissue(name, pigments=pigments), name, near)
    table = find_table(name)
    if table is not None:
        return table
    return _fitted(str(name)) if str(name) in names() else fit_profile(load_tissue(Path(name)), name)


def find_table(name: str | Path) -> GaussianSum | None:
    """The Gaussians that a name or a file states; None when it names tissue.

    Raises DermisError when it is neither, or when its numbers cannot be a profile.
    """
    if str(name) == PUBLISHED:
        return _published()
    if str(name) in names():
        return None
    path = Path(name)
    written = _written(path)
    if not written and path.suffix.lower() != ".toml":
        expected = f"a preset ({', '.join(preset_names())}), a .toml file of a tissue, or {_FILE_FORM}"
        refuse(f"profile {name}", expected, "there is no such file", "Check the name")
    return _table(path, written)


@lru_cache(_KEPT_FILES)
def _table(path: Path, written: tuple[int, ...]) -> GaussianSum | None:
    """The Gaussians of a file, cached because each frame asks for them.

    written : the state of the file, as `_written` gives it
    """
    if path.suffix.lower() == ".toml":
        document = read_toml(path)
        return _from_toml(path, document) if "variances_mm2" in document else None
    return _parse(str(path), read_text(path, _FILE_FORM))


def _written(path: Path) -> tuple[int, ...]:
    """Time of writing, size and inode of a file; empty when there is none."""
    try:
        found = path.stat()
    except (OSError, ValueError):  # no such file, a name that none can have, or a folder without access
        return ()
    return found.st_mtime_ns, found.st_size, found.st_ino


def write_profile(path: Path, profile: GaussianSum, remarks: Mapping[str, Any]) -> None:
    """Write Gaussians to a .toml file, whole or not at all.

    remarks : further entries: text, numbers, and lists of them

    Raises DermisError when it cannot be written.
    """
    lines = ["# Written by dermis profile. Lengths in mm; red, green, blue are linear Rec. 709."]
    lines += [f"{key} = {_toml(value)}" for key, value in remarks.items()]
    lines += [f"variances_mm2 = {_toml(profile.variance_mm2)}", "weights = ["]
    lines += [f"    {_toml(row)}," for row in profile.weight]
    with replacing(path) as trial:
        trial.write_text("\n".join([*lines, "]", ""]), encoding="utf-8")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, np.ndarray):
        return _toml(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        return repr(float(value))  # NumPy's own numbers print their type
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


@cache
def _fitted(name: str) -> GaussianSum:
    return fit_profile(load_tissue(name), name)


def fit_profile(tissue: Tissue, name: str | Path, near: GaussianSum | None = None) -> GaussianSum:
    """Six Gaussians for the usual profile of a tissue.

    Those of counted photons, whose profile is steeper than diffusion's, would miss up to 2 % of its light and
    are made to keep it.

    near : the fit of a similar tissue to start from, several times faster

    Raises DermisError when its numbers cannot be a profile.
    """
    return _fit_rings(tissue.rings(), tissue.usual_model, f"profile {name}", near)


def fit_radial(radial: RadialProfile, name: str, near: GaussianSum | None = None) -> GaussianSum:
    """Six Gaussians for a radial profile; those of photons keep its light.

    near : as of `fit_profile`
    """
    return _fit_rings(radial.rings(), radial.model, name, near)


def _fit_rings(rings: Rings, model: str, name: str, near: GaussianSum | None) -> GaussianSum:
    counted = model in COUNTED_MODELS
    fit = fit_gaussians(rings, TERMS, keep_energy=counted, near=near, name=name)
    return replace(fit.profile, counted=counted)


@cache
def _published() -> GaussianSum:
    return _parse(
        PUBLISHED, resources.files("dermis.optics").joinpath(f"data/{PUBLISHED}.csv").read_text("utf-8")
    )


def _from_toml(path: Path, document: Mapping[str, Any]) -> GaussianSum:
    name = f"profile {path}"
    variances = numbers(f"{name}: variances_mm2", document["variances_mm2"], (0,), 0.0, WIDEST_MM2)
    weights = numbers(f"{name}: weights", document.get("weights"), (0, 3), 0.0, MOST_WEIGHT)
    return replace(_three(path, variances, weights), counted=document.get("model") in COUNTED_MODELS)


def _parse(name: str, text: str) -> GaussianSum:
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines or [cell.strip() for cell in lines[0].split(",")] != _HEADER:
        came = f"its first line is {lines[0] if lines else 'missing'!r}"
        refuse(f"profile {name}", _FILE_FORM, came, _MEND)
    try:
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]], dtype=np.float64)
    except ValueError:
        table = np.empty((0, 4))
    if table.ndim != 2 or table.shape[1:] != (4,) or len(table) == 0:
        refuse(f"profile {name}", "rows of four numbers", "other rows came", _MEND)
    return _three(name, table[:, 0], table[:, 1:])


def _three(name: object, variance_mm2: Floats, weight: Floats) -> GaussianSum:
    if weight.ndim != 2 or weight.shape[1:] != (3,):
        refuse(f"profile {name}", "weights in red, green and blue", f"shape {weight.shape} came", _MEND)
    return GaussianSum(f"profile {name}", variance_mm2, weight)
