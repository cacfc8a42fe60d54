"""Diffusion profiles as sums of Gaussians: a published preset, files, and fits to tissue."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.base.quantities import checked_array
from dermis.base.reading import checked_path, read_text, read_toml
from dermis.base.renamed import renamed_keywords
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.fits.targets import RingTarget
from dermis.optics.gaussians import MAX_VARIANCE_MM2, MAX_WEIGHT, GaussianSum
from dermis.optics.media import Floats
from dermis.optics.radial import RadialProfile
from dermis.optics.reduced_scattering import MCML_SUFFIXES, refuse_mcml
from dermis.optics.tissue import Tissue, load_tissue, tissue_names

PUBLISHED_PRESET = "gpu-gems-3"
GAUSSIAN_TERMS = 6
PHOTON_MODELS = "counted", "montecarlo"
"""Models whose profiles are results of Monte Carlo simulation, which counts the photons that leave."""
_PROFILE_CSV_HEADER = ["variance_mm2", "red", "green", "blue"]
_PROFILE_CSV_FORMAT = "a CSV file with the columns " + ",".join(_PROFILE_CSV_HEADER)
_MAX_CACHED_FILES = 16
_PROFILE_ADVICE = "Correct the profile's table"


def preset_names() -> tuple[str, ...]:
    """Return the names that `load_profile` accepts besides files."""
    return (PUBLISHED_PRESET, *tissue_names())


@renamed_keywords(near="similar_fit", initial="similar_fit")
def load_profile(
    name: str | Path, pigments: Mapping[str, float] | None = None, similar_fit: GaussianSum | None = None
) -> GaussianSum:
    """Return the diffusion profile of a preset or a file as a sum of Gaussians.

    If the preset or file describes a tissue, six Gaussians are fitted to the diffusion profile of the tissue.
    This profile comes from tables of Monte Carlo results if they cover the tissue, and from layered diffusion
    otherwise.

    Parameters
    ----------
    name : str or Path
        Preset ("gpu-gems-3", "dj3", "spectral" ...), or a file: .csv, or .toml as written by
        ``dermis profile``.
    pigments : Mapping of str to float, optional
        For a skin that is defined by its pigments, values that replace fields of its `SkinParameters`.
    similar_fit : GaussianSum, optional
        Fit of a similar skin, as start of the new fit, which is then several times faster.

    Returns
    -------
    GaussianSum
        Profile with variances (k,) [mm²] and weights (k, 3) in linear Rec. 709.

    Raises
    ------
    DermisError
        There is no such preset or file, or its numbers are not a valid profile.

    References
    ----------
    [dEonLuebke2007] section 14.4 for sums of Gaussians.

    Examples
    --------
    >>> from dermis import load_profile
    >>> profile = load_profile("gpu-gems-3")
    >>> profile.variance_mm2.shape, profile.weight.shape
    ((6,), (6, 3))
    """
    checked_path(name, "a profile")
    if pigments:
        return fit_profile(load_tissue(name, pigments=pigments), name, similar_fit)
    table = find_gaussians(name)
    if table is not None:
        return table
    if str(name) in tissue_names():
        return _fit_preset(str(name))
    return fit_profile(load_tissue(Path(name)), name)


def find_gaussians(name: str | Path) -> GaussianSum | None:
    """Return the Gaussians of a preset or file, or None if the preset or file describes a tissue.

    Raises DermisError for an unknown name, and for Gaussians that are not a valid profile.
    """
    if str(name) == PUBLISHED_PRESET:
        return _published_profile()
    if str(name) in tissue_names():
        return None
    path = Path(name)
    if path.suffix.lower() in MCML_SUFFIXES:
        refuse_mcml(path)
    state = _file_state(path)
    if not state and path.suffix.lower() != ".toml":
        expected = (
            f"a preset ({', '.join(preset_names())}), a .toml file of a tissue, or {_PROFILE_CSV_FORMAT}"
        )
        refuse(f"profile {name}", expected, "there is no such file", "Check the name")
    return _read_gaussians(path, state)


@lru_cache(_MAX_CACHED_FILES)
def _read_gaussians(path: Path, file_state: tuple[int, ...]) -> GaussianSum | None:
    """Return the Gaussians in a file, or None if the file describes a tissue; cache the result.

    file_state : state of the file from `_file_state`; the file is read again if its state has changed
    """
    if path.suffix.lower() == ".toml":
        document = read_toml(path)
        return _gaussians_from_toml(path, document) if "variances_mm2" in document else None
    return _parse_csv(str(path), read_text(path, _PROFILE_CSV_FORMAT))


def _file_state(path: Path) -> tuple[int, ...]:
    """Return a file's modification time, size and inode, to detect changes; () if there is no such file."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # no such file, an invalid name, or a folder without access
        return ()
    return status.st_mtime_ns, status.st_size, status.st_ino


def write_profile(path: Path, profile: GaussianSum, metadata: Mapping[str, Any]) -> None:
    """Write a sum of Gaussians to a .toml file atomically.

    metadata : further entries of the file, as a dictionary from key to text, number, or list of these

    Raises DermisError when the file cannot be written.
    """
    lines = ["# Written by dermis profile. Lengths in mm; red, green, blue are linear Rec. 709."]
    lines += [f"{key} = {_format_toml_value(value)}" for key, value in metadata.items()]
    lines += [f"variances_mm2 = {_format_toml_value(profile.variance_mm2)}", "weights = ["]
    lines += [f"    {_format_toml_value(row)}," for row in profile.weight]
    with atomic_file(path) as temporary:
        temporary.write_text("\n".join([*lines, "]", ""]), encoding="utf-8")


def _format_toml_value(entry_value: Any) -> str:
    if isinstance(entry_value, bool):
        return str(entry_value).lower()
    if isinstance(entry_value, np.ndarray):
        return _format_toml_value(entry_value.tolist())
    if isinstance(entry_value, Sequence) and not isinstance(entry_value, str):
        return f"[{', '.join(map(_format_toml_value, entry_value))}]"
    if isinstance(entry_value, float):
        return repr(float(entry_value))  # the repr of NumPy scalars contains their type
    return json.dumps(entry_value, ensure_ascii=False) if isinstance(entry_value, str) else repr(entry_value)


@cache
def _fit_preset(preset_name: str) -> GaussianSum:
    return fit_profile(load_tissue(preset_name), preset_name)


def fit_profile(
    tissue: Tissue,
    profile_name: str | Path,
    similar_fit: GaussianSum | None = None,
    *,
    keep_energy: bool = False,
) -> GaussianSum:
    """Fit six Gaussians to the diffusion profile of a tissue, computed by the tissue's default model.

    If the profile comes from Monte Carlo simulation (a model of `PHOTON_MODELS`), the fit is constrained to
    the total reflectance of the profile. Such profiles are so steep at the centre that a fit without this
    constraint would lose up to 2 % of the light.

    profile_name : preset or file after which the fitted profile is named
    similar_fit : fit of a similar tissue, as start of the new fit, which is then several times faster
    keep_energy : whether to constrain the fit to the total reflectance also for profiles that are not
        tabulated from photons

    Raises DermisError when the fit is not a valid profile.
    """
    return _fit_rings(
        tissue.ring_target(),
        tissue.default_profile_model,
        f"profile {profile_name}",
        similar_fit,
        keep_energy=keep_energy,
    )


def fit_radial(
    radial_profile: RadialProfile, profile_name: str, similar_fit: GaussianSum | None = None
) -> GaussianSum:
    """Fit six Gaussians to a radial profile.

    If the profile comes from Monte Carlo simulation (a model of `PHOTON_MODELS`), the fit is constrained to
    the total reflectance of the profile; otherwise the two may differ slightly.

    profile_name : name of the fitted profile
    similar_fit : fit of a similar profile, as start of the new fit, which is then several times faster
    """
    return _fit_rings(radial_profile.ring_target(), radial_profile.model, profile_name, similar_fit)


def _fit_rings(
    rings: RingTarget,
    model: str,
    profile_name: str,
    similar_fit: GaussianSum | None,
    *,
    keep_energy: bool = False,
) -> GaussianSum:
    from_photons = model in PHOTON_MODELS
    fit = fit_gaussians(
        rings,
        GAUSSIAN_TERMS,
        keep_energy=keep_energy or from_photons,
        similar_fit=similar_fit,
        profile_name=profile_name,
    )
    return replace(fit.profile, from_photons=from_photons)


@cache
def _published_profile() -> GaussianSum:
    file = resources.files("dermis.optics").joinpath(f"data/{PUBLISHED_PRESET}.csv")
    return _parse_csv(PUBLISHED_PRESET, file.read_text("utf-8"))


def _gaussians_from_toml(path: Path, document: Mapping[str, Any]) -> GaussianSum:
    name = f"profile {path}"
    key = "variances_mm2"
    variances = checked_array(f"{name}: {key}", document[key], (0,), 0.0, MAX_VARIANCE_MM2)
    weights = checked_array(f"{name}: weights", document.get("weights"), (0, 3), 0.0, MAX_WEIGHT)
    return replace(
        _checked_rgb_gaussians(path, variances, weights), from_photons=document.get("model") in PHOTON_MODELS
    )


def _parse_csv(profile_name: str, csv_text: str) -> GaussianSum:
    lines = [line.strip() for line in csv_text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines or [cell.strip() for cell in lines[0].split(",")] != _PROFILE_CSV_HEADER:
        actual = f"its first line is {lines[0] if lines else 'missing'!r}"
        refuse(f"profile {profile_name}", _PROFILE_CSV_FORMAT, actual, _PROFILE_ADVICE)
    try:
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]], dtype=np.float64)
    except ValueError:
        table = np.empty((0, 4))
    if table.ndim != 2 or table.shape[1:] != (4,) or len(table) == 0:
        refuse(f"profile {profile_name}", "rows of four numbers", "it has other rows", _PROFILE_ADVICE)
    return _checked_rgb_gaussians(profile_name, table[:, 0], table[:, 1:])


def _checked_rgb_gaussians(profile_name: object, variance_mm2: Floats, weight: Floats) -> GaussianSum:
    if weight.ndim != 2 or weight.shape[1:] != (3,):
        refuse(
            f"profile {profile_name}",
            "weights in red, green and blue",
            f"got shape {weight.shape}",
            _PROFILE_ADVICE,
        )
    return GaussianSum(f"profile {profile_name}", variance_mm2, weight)
