"""Uncertainty of pigments that is due to the unknown oxygen and epidermal thickness of a person."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

import numpy as np

from dermis.apps.inverse.unmixing.skin_model import SkinModel, skin_model, solve_pigments
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.priors import skin_prior
from dermis.optics.pigments.spectra import rgb_weights
from dermis.optics.skin_spectra import skin_reflectance

FIXED_PARAMETERS = ("oxygen", "epidermis_mm")
"""Parameters that an inversion of colours assumes, and that differ between people."""
_SAMPLE_COUNT = 2000
_LOG_PIGMENT_KERNEL_SD = 0.35  # standard deviation of weights over the logarithms of melanin and blood
_LOG_ERROR_CLIP = 2.5  # largest error of a logarithm that counts, for blood that melanin hides


def sd_from_assumed_parameters(
    melanin: float,
    blood: float,
    skin: SkinParameters = DEFAULT_SKIN,
    known_parameters: Collection[str] = (),
    is_oxygen_fitted: bool = False,
) -> dict[str, float]:
    """Return the relative standard deviations of melanin and blood that are due to assumed skin parameters.

    Skins are sampled from the prior, and their colours are unmixed as if they had the parameters of `skin`.
    The error of a sample is the logarithm of the ratio of the estimated to the true fraction of a pigment.
    The result is the root mean square of this error over the samples with estimates near `melanin` and
    `blood`.

    melanin, blood : volume fractions that were estimated from a picture [-]
    skin : parameters that are assumed for unmixing
    known_parameters : names from `FIXED_PARAMETERS` of the parameters whose values are known for the person
    is_oxygen_fitted : whether unmixing also estimates oxygen
    """
    if set(FIXED_PARAMETERS) <= set(known_parameters):
        return {"melanin": 0.0, "blood": 0.0}
    found, error = _unmix_prior_sample(skin, tuple(sorted(known_parameters)), is_oxygen_fitted)
    target = np.log(np.maximum([melanin, blood], 1e-4))
    distance = ((found - target) ** 2).sum(axis=1)
    # Relative to the nearest sample, so that results outside the prior have weights too.
    weight = np.exp(-0.5 * (distance - distance.min()) / _LOG_PIGMENT_KERNEL_SD**2)
    square = weight @ error**2 / weight.sum()
    return dict(zip(("melanin", "blood"), map(float, np.sqrt(square)), strict=True))


@lru_cache(maxsize=8)
def _unmix_prior_sample(
    skin: SkinParameters, known_parameters: tuple[str, ...], is_oxygen_fitted: bool
) -> tuple[Floats, Floats]:
    """Unmix skins sampled from the prior; return estimates (n, 2) and their errors (n, 2).

    The estimates are logarithms of the fractions of melanin and blood.
    """
    true = skin_prior().sample(_SAMPLE_COUNT)
    values = true | {name: np.full(_SAMPLE_COUNT, getattr(skin, name)) for name in known_parameters}
    spectra = skin_reflectance(
        np.minimum(values["melanin"], 1.0),
        np.minimum(values["blood"], 1.0),
        oxygen=values["oxygen"],
        eumelanin_fraction=skin.eumelanin,
        epidermis_mm=values["epidermis_mm"],
        baseline=skin.baseline,
    )
    model: SkinModel = skin_model(skin, "oxygen" if is_oxygen_fitted else "none")
    estimate = solve_pigments(model, np.maximum(spectra @ rgb_weights().T, 0.0))
    found = np.log(np.maximum(np.stack([estimate.melanin, estimate.blood], axis=-1), 1e-4))
    error = found - np.log(np.maximum(np.stack([values["melanin"], values["blood"]], axis=-1), 1e-4))
    return found, np.clip(error, -_LOG_ERROR_CLIP, _LOG_ERROR_CLIP)
