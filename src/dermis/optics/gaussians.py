"""Diffusion profiles as sums of Gaussians."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.errors import refuse

Floats = NDArray[np.float64]
MOST_GAUSSIANS = 16
_WIDEST_MM2 = 1e4
_HEADER = ["variance_mm2", "red", "green", "blue"]
_FILE_FORM = "a CSV file with the columns " + ",".join(_HEADER)


@dataclass(frozen=True)
class GaussianSum:
    """R(r) = sum of weight * exp(-r^2 / 2v) / (2 pi v), narrow to wide.

    name : preset or file
    variance_mm2 : (k,) increasing [mm2]
    weight : (k, 3) share of the light that each Gaussian spreads, linear Rec. 709 [-]

    Source: [dEonLuebke2007] section 14.4.
    """

    name: str
    variance_mm2: Floats
    weight: Floats

    def __post_init__(self) -> None:
        variance, weight = self.variance_mm2, self.weight
        if variance.ndim != 1 or weight.shape != (len(variance), 3) or len(variance) == 0:
            refuse(
                self.name, "k variances and k x 3 weights", f"shapes {variance.shape}, {weight.shape}", _MEND
            )
        if not (np.isfinite(variance).all() and np.isfinite(weight).all()):
            refuse(self.name, "finite numbers", "NaN or infinity came", _MEND)
        if len(variance) > MOST_GAUSSIANS or variance.max() > _WIDEST_MM2:
            limit = f"at most {MOST_GAUSSIANS} Gaussians of up to {_WIDEST_MM2:g} mm2"
            refuse(self.name, limit, f"{len(variance)} up to {variance.max():g} came", _MEND)
        if (variance <= 0).any() or (np.diff(variance) <= 0).any():
            refuse(self.name, "variances above 0 that increase", f"they are {variance.tolist()}", _MEND)
        if (weight < 0).any() or (weight.sum(axis=0) <= 0).any():
            refuse(self.name, "weights of 0 or more with some in each channel", "they are not so", _MEND)

    @property
    def albedo(self) -> Floats:
        """Total reflectance per channel: the sum of the weights [-]."""
        total: Floats = self.weight.sum(axis=0)
        return total

    def radiant_exitance(self, radius_mm: ArrayLike) -> Floats:
        """R at distances r from a pencil of unit power, shape (..., 3) [1/mm2]."""
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        bells = np.exp(-(r**2) / (2 * self.variance_mm2)) / (2 * np.pi * self.variance_mm2)
        profile: Floats = bells @ self.weight
        return profile


_MEND = "Mend the profile's table"


@cache
def preset_names() -> tuple[str, ...]:
    """Names that `load_profile` knows without a file."""
    folder = resources.files("dermis.optics") / "data"
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".csv") for name in names if name.endswith(".csv")))


def load_profile(name: str | Path) -> GaussianSum:
    """The profile of a preset's name ("gpu-gems-3") or of a CSV file: variance_mm2,red,green,blue.

    Raises DermisError when there is no such preset or file, or when its numbers cannot be a profile.
    """
    if str(name) in preset_names():
        return _preset(str(name))
    path = Path(name)
    try:
        return _parse(str(path), path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        came = getattr(error, "strerror", None) or "it is not text"
        expected = f"a preset ({', '.join(preset_names())}) or {_FILE_FORM}"
        refuse(f"profile {name}", expected, f"it cannot be read: {came}", "Check the name")


@cache
def _preset(name: str) -> GaussianSum:
    text = (resources.files("dermis.optics") / "data" / f"{name}.csv").read_text(encoding="utf-8")
    return _parse(name, text)


def _parse(name: str, text: str) -> GaussianSum:
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines or [cell.strip() for cell in lines[0].split(",")] != _HEADER:
        refuse(
            f"profile {name}", _FILE_FORM, f"its first line is {lines[0] if lines else 'missing'!r}", _MEND
        )
    try:
        table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]], dtype=np.float64)
    except ValueError:
        table = np.empty((0, 4))
    if table.ndim != 2 or table.shape[1:] != (4,) or len(table) == 0:
        refuse(f"profile {name}", "rows of four numbers", "other rows came", _MEND)
    return GaussianSum(f"profile {name}", table[:, 0], table[:, 1:])
