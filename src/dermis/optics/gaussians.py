"""Diffusion profiles as sums of Gaussians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse

Floats = NDArray[np.float64]
MAX_GAUSSIANS = 24
"""Largest number of Gaussians in a sum: eight for each of three channels."""

MAX_VARIANCE_MM2 = 1e4
MAX_WEIGHT = 100.0
_MIN_VARIANCE_MM2 = 1e-12  # a nanometre squared, far below the wavelengths of light
_MIN_ALBEDO = 1e-12  # smallest albedo of a channel by which single precision can divide
_PROFILE_TABLE_ADVICE = "Correct the profile's table"


@dataclass(frozen=True)
class GaussianSum:
    """Diffusion profile R(r), a sum of Gaussians w exp(-r^2 / 2v) / (2 pi v).

    name : name of the preset or file
    variance_mm2 : (k,) variances v, increasing [mm2]
    weight : (k, c) weights w, the light that each Gaussian spreads in c channels; the renderer needs three
        channels, in linear Rec. 709 [-]
    from_photons : whether the sum was fitted to the result of a Monte Carlo simulation instead of a diffusion
        model

    Source: [dEonLuebke2007] section 14.4.

    Examples
    --------
    >>> import numpy as np
    >>> profile = GaussianSum("two", np.array([0.1, 1.0]), np.array([[0.2], [0.3]]))
    >>> float(profile.albedo[0])
    0.5
    """

    name: str
    variance_mm2: Floats
    weight: Floats
    from_photons: bool = False

    def __post_init__(self) -> None:
        """Raise DermisError for invalid variances or weights."""
        variance, weight = self.variance_mm2, self.weight
        if variance.ndim != 1 or weight.ndim != 2 or len(variance) != len(weight) or weight.size == 0:
            actual = f"got shapes {variance.shape} and {weight.shape}"
            refuse(self.name, "k variances and k x c weights", actual, _PROFILE_TABLE_ADVICE)
        if not (np.isfinite(variance).all() and np.isfinite(weight).all()):
            refuse(self.name, "finite numbers", "got NaN or infinity", _PROFILE_TABLE_ADVICE)
        if len(variance) > MAX_GAUSSIANS or variance.max() > MAX_VARIANCE_MM2:
            limit = f"at most {MAX_GAUSSIANS} Gaussians of up to {MAX_VARIANCE_MM2:g} mm2"
            refuse(self.name, limit, f"got {len(variance)} up to {variance.max():g}", _PROFILE_TABLE_ADVICE)
        if (variance < _MIN_VARIANCE_MM2).any() or (np.diff(variance) <= 0).any():
            expected = f"variances from {_MIN_VARIANCE_MM2:g} mm2 that increase"
            refuse(self.name, expected, f"they are {variance.tolist()}", _PROFILE_TABLE_ADVICE)
        if (weight < 0).any() or (weight.sum(axis=0) < _MIN_ALBEDO).any():
            refuse(
                self.name,
                "weights of 0 or more, some above 0 in each channel",
                "they are not",
                _PROFILE_TABLE_ADVICE,
            )
        if weight.max() > MAX_WEIGHT:
            actual = f"got {weight.max():g}"
            refuse(
                self.name, f"weights up to {MAX_WEIGHT:g}, fractions of light", actual, _PROFILE_TABLE_ADVICE
            )

    @property
    def albedo(self) -> Floats:
        """Return the total reflectance (c,), the sum of all weights in each channel [-]."""
        return np.asarray(self.weight.sum(axis=0))

    def radiant_exitance(self, radius_mm: ArrayLike) -> Floats:
        """Return the profile R(r), (..., c), at distances r from a narrow beam of unit power [1/mm2]."""
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        gaussians = np.exp(-(r**2) / (2 * self.variance_mm2)) / (2 * np.pi * self.variance_mm2)
        return np.asarray(gaussians @ self.weight)

    def energy_within(self, radius_mm: ArrayLike) -> Floats:
        """Return the light (..., c) that emerges within given distances from a narrow beam of unit power [-].

        radius_mm : distances from the beam [mm]
        """
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        return np.asarray(-np.expm1(-(r**2) / (2 * self.variance_mm2)) @ self.weight)

    def hankel(self, frequency: ArrayLike) -> Floats:
        """Return the Hankel transform (..., c) of R(r) at frequencies s [1/mm].

        The transform is the integral of 2 pi r R(r) J0(s r) over r, with the Bessel function J0.
        """
        s = np.asarray(frequency, dtype=np.float64)[..., None]
        return np.asarray(np.exp(-self.variance_mm2 * s**2 / 2) @ self.weight)

    def inner_product(self, other_profile: GaussianSum) -> Floats:
        """Return the integral (c,) of r R(r) S(r) over r, where S(r) is another sum of Gaussians [1/mm2].

        The squared error between two profiles is a sum of such integrals.
        """
        gram = 1 / (4 * np.pi**2 * np.add.outer(self.variance_mm2, other_profile.variance_mm2))
        return np.asarray(np.einsum("ic,ij,jc->c", self.weight, gram, other_profile.weight))
