"""Properties of the specular models for a comparison: peak, reciprocity error and directional albedo."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.specular.albedo import directional_albedo
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
COMPARED_ROUGHNESSES = np.round(np.arange(1, 6) / 10, 1)
COMPARED_COSINES = np.round(np.arange(1, 21) / 20, 2)
_DIRECTION_PAIR_COUNT = 4000
_NORMAL = np.array([0.0, 0.0, 1.0])


def normal_incidence_peak(model_name: str, m: float) -> float:
    """Return the BRDF of a model when light and viewer are both in the direction of the normal [1/sr].

    model_name : name of the specular model, evaluated for the specular strength rho_s = 1
    m : roughness [-]
    """
    return float(MODELS[model_name].lobe(cosines(_NORMAL, _NORMAL, _NORMAL), m))


def reciprocity_error(model_name: str) -> float:
    """Return a BRDF's largest change when light and view are exchanged, relative to the BRDF's maximum [-].

    Light and view are random directions up to 85 degrees from the normal. The result is the maximum over the
    roughnesses in `COMPARED_ROUGHNESSES`.

    model_name : name of the specular model
    """
    rng = np.random.default_rng(1)
    l, v = (_random_directions(rng) for _ in range(2))
    lobe = MODELS[model_name].lobe
    errors = []
    for m in COMPARED_ROUGHNESSES:
        forward, backward = lobe(cosines(_NORMAL, l, v), m), lobe(cosines(_NORMAL, v, l), m)
        errors.append(np.abs(forward - backward).max() / max(forward.max(), backward.max()))
    return float(max(errors))


def directional_albedo_rows(model_name: str) -> list[dict[str, float]]:
    """Return the directional albedo rho of a model at `COMPARED_ROUGHNESSES` and `COMPARED_COSINES`.

    Each row of the result has the keys m, cos_theta and rho, for a CSV file.
    """
    rho = directional_albedo(COMPARED_COSINES, COMPARED_ROUGHNESSES[:, None], MODELS[model_name].lobe)
    return [
        {"m": float(m), "cos_theta": float(c), "rho": float(rho[i, k])}
        for i, m in enumerate(COMPARED_ROUGHNESSES)
        for k, c in enumerate(COMPARED_COSINES)
    ]


def _random_directions(rng: Any) -> Floats:
    cosine, phi = (
        rng.uniform(np.cos(np.radians(85)), 1.0, _DIRECTION_PAIR_COUNT),
        rng.uniform(0, 2 * np.pi, _DIRECTION_PAIR_COUNT),
    )
    sine = np.sqrt(1.0 - cosine**2)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)
