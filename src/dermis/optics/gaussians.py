"""Diffusion profiles as sums of Gaussians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse

Floats = NDArray[np.float64]
MOST_GAUSSIANS = 24
"""As many as a frame sums: eight for each of three channels."""

WIDEST_MM2 = 1e4
MOST_WEIGHT = 100.0
_NARROWEST_MM2 = 1e-12  # a nanometre, far below light's wavelengths
_DARKEST = 1e-12  # of a channel's light: single precision divides by it
_MEND = "Correct the profile's table"


@dataclass(frozen=True)
class GaussianSum:
    """R(r) = sum of weight * exp(-r^2 / 2v) / (2 pi v), narrow to wide.

    name : preset or file
    variance_mm2 : (k,) increasing [mm2]
    weight : (k, c) share of the light that each Gaussian spreads in c channels; a frame takes three, linear
        Rec. 709 [-]
    counted : whether they are fitted to counted photons, not to diffusion

    Source: [dEonLuebke2007] section 14.4.
    """

    name: str
    variance_mm2: Floats
    weight: Floats
    counted: bool = False

    def __post_init__(self) -> None:
        variance, weight = self.variance_mm2, self.weight
        if variance.ndim != 1 or weight.ndim != 2 or len(variance) != len(weight) or weight.size == 0:
            came = f"shapes {variance.shape}, {weight.shape}"
            refuse(self.name, "k variances and k x c weights", came, _MEND)
        if not (np.isfinite(variance).all() and np.isfinite(weight).all()):
            refuse(self.name, "finite numbers", "NaN or infinity came", _MEND)
        if len(variance) > MOST_GAUSSIANS or variance.max() > WIDEST_MM2:
            limit = f"at most {MOST_GAUSSIANS} Gaussians of up to {WIDEST_MM2:g} mm2"
            refuse(self.name, limit, f"{len(variance)} up to {variance.max():g} came", _MEND)
        if (variance < _NARROWEST_MM2).any() or (np.diff(variance) <= 0).any():
            expected = f"variances from {_NARROWEST_MM2:g} mm2 that increase"
            refuse(self.name, expected, f"they are {variance.tolist()}", _MEND)
        if (weight < 0).any() or (weight.sum(axis=0) < _DARKEST).any():
            refuse(self.name, "weights of 0 or more, some above 0 in each channel", "they are not", _MEND)
        if weight.max() > MOST_WEIGHT:
            came = f"{weight.max():g} came"
            refuse(self.name, f"weights up to {MOST_WEIGHT:g}, for they are shares of light", came, _MEND)

    @property
    def albedo(self) -> Floats:
        """Total reflectance per channel: the sum of the weights [-]."""
        return np.asarray(self.weight.sum(axis=0))

    def radiant_exitance(self, radius_mm: ArrayLike) -> Floats:
        """R at distances r from a pencil of unit power, shape (..., c) [1/mm2]."""
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        bells = np.exp(-(r**2) / (2 * self.variance_mm2)) / (2 * np.pi * self.variance_mm2)
        return np.asarray(bells @ self.weight)

    def within(self, radius_mm: ArrayLike) -> Floats:
        """Share of the light that leaves within distances r, shape (..., c) [-]."""
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        return np.asarray(-np.expm1(-(r**2) / (2 * self.variance_mm2)) @ self.weight)

    def hankel(self, frequency: ArrayLike) -> Floats:
        """Integral of 2 pi r R(r) J0(s r) by frequency s [1/mm], shape (..., c) [-]."""
        s = np.asarray(frequency, dtype=np.float64)[..., None]
        return np.asarray(np.exp(-self.variance_mm2 * s**2 / 2) @ self.weight)

    def inner(self, other: GaussianSum) -> Floats:
        """Integral of r R(r) S(r) with another profile S, (c,) [1/mm2]."""
        gram = 1 / (4 * np.pi**2 * np.add.outer(self.variance_mm2, other.variance_mm2))
        return np.asarray(np.einsum("ic,ij,jc->c", self.weight, gram, other.weight))
