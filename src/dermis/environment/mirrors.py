"""Lobes as a few round ones: what prefiltered panoramas can be asked for, at any angle of view."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.progress import preparing
from dermis.base.tables import numbers, read_rows
from dermis.environment.mirror_fits import (
    LOBES,
    MIRROR_ROUGHNESSES,
    MIRROR_VIEWS,
    ROUGH,
    VIEWS,
    fitted_mirrors,
)
from dermis.specular.models import MODELS

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
    """(12, 16, 5, 4) by roughness and view: where round lobes point (x, y), their roughness, weight.

    model : name in MODELS

    Rows are even in the logarithm of the roughness from 0.05 to 1, columns in the root of the view's
    cosine. A direction is given as a place (x, y), by stereographic projection about the mirror direction:
    it is 2 x away from the eye, 2 y beside the plane of view and 1 - x^2 - y^2 along the mirror direction,
    all over 1 + x^2 + y^2. So lobes follow that direction between the columns, the last two of which are 29
    degrees apart. The weighted sum of the five stands for the lobe, which towards grazing views leaves the
    mirror direction, gets longer in the plane of view than across, and ends at the horizon. Lobes without
    weight need not be looked up. Models that the package does not ship are fitted when they are first used,
    in half a minute.
    """
    rows = [row for row in read_rows("dermis.environment", "data/mirrors") if row["model"] == model]
    columns = " ".join(
        f"{name}_{k}" for k in range(LOBES) for name in ("angle", "beside", "roughness", "weight")
    )
    fits = numbers(rows, columns).reshape(ROUGH, VIEWS, LOBES, 4) if rows else _fitted(model)
    angle, beside, roughness, weight = np.moveaxis(fits, -1, 0)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    off = angle - np.arccos(MIRROR_VIEWS)[:, None]
    farther = 1.0 + np.cos(off) * np.cos(beside)
    return np.stack([np.sin(off) * np.cos(beside) / farther, np.sin(beside) / farther, roughness, weight], -1)


@preparing("finding what the surface reflects of the environment")
def _fitted(model: str) -> Floats:
    return fitted_mirrors(MODELS[model].lobe)
