"""Lobes as a few round ones: what prefiltered panoramas can be asked for, at any angle of view."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.environment.mirror_fits import LOBES, MIRROR_ROUGHNESSES, ROUGH, VIEWS, fitted_mirrors
from dermis.preparing import preparing
from dermis.specular.models import MODELS
from dermis.tables import numbers, read_rows

Floats = NDArray[np.float64]


def mirror_numbers() -> dict[str, float]:
    """Numbers that environment.wgsl fills in."""
    return {
        "mirror_rough": ROUGH,
        "mirror_views": VIEWS,
        "mirror_lobes": LOBES,
        "mirror_smoothest": float(MIRROR_ROUGHNESSES[0]),
        "mirror_roughest": float(MIRROR_ROUGHNESSES[-1]),
    }


@cache
def equivalent_mirrors(model: str = "kelemen") -> Floats:
    """(12, 16, 4, 4) by roughness and view: sine and cosine of where round lobes point, roughness, weight.

    model : name in MODELS

    Rows are even in the logarithm of the roughness from 0.05 to 1, columns in the root of the view's cosine.
    The weighted sum of the four stands for the lobe, which towards grazing views leaves the mirror direction,
    gets longer in the plane of view than across, and ends at the horizon. Models that the package does not
    ship are fitted when they are first used, in some seconds.
    """
    rows = [row for row in read_rows("dermis.environment", "data/mirrors") if row["model"] == model]
    columns = " ".join(f"{name}_{k}" for k in range(LOBES) for name in ("angle", "roughness", "weight"))
    fits = numbers(rows, columns).reshape(ROUGH, VIEWS, LOBES, 3) if rows else _fitted(model)
    angle, roughness, weight = np.moveaxis(fits, -1, 0)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    return np.stack([np.sin(angle), np.cos(angle), roughness, weight], axis=-1)


@preparing("finding what the surface reflects of the environment")
def _fitted(model: str) -> Floats:
    return fitted_mirrors(MODELS[model].lobe)
