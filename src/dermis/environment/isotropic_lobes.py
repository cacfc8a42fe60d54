"""Lobes as a few round ones: what prefiltered panoramas can be asked for, at any angle of view."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.progress import logged_step
from dermis.base.tables import float_columns, read_rows
from dermis.environment.isotropic_fits import (
    LOBE_COUNT,
    LOBE_TABLE_COSINES,
    LOBE_TABLE_ROUGHNESSES,
    ROUGHNESS_COUNT,
    VIEW_COUNT,
    fit_isotropic_lobes,
)
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]


def isotropic_lobe_constants() -> dict[str, float]:
    """Numbers that environment.wgsl fills in."""
    return {
        "mirror_rough": ROUGHNESS_COUNT,
        "mirror_views": VIEW_COUNT,
        "mirror_lobes": LOBE_COUNT,
        "mirror_smoothest": float(LOBE_TABLE_ROUGHNESSES[0]),
        "mirror_roughest": float(LOBE_TABLE_ROUGHNESSES[-1]),
    }


@cache
def isotropic_lobe_table(model: str = "kelemen") -> Floats:
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
        f"{name}_{k}" for k in range(LOBE_COUNT) for name in ("angle", "beside", "roughness", "weight")
    )
    fits = (
        float_columns(rows, columns).reshape(ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT, 4)
        if rows
        else _fit_model(model)
    )
    angle, beside, roughness, weight = np.moveaxis(fits, -1, 0)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    off = angle - np.arccos(LOBE_TABLE_COSINES)[:, None]
    farther = 1.0 + np.cos(off) * np.cos(beside)
    return np.stack([np.sin(off) * np.cos(beside) / farther, np.sin(beside) / farther, roughness, weight], -1)


@logged_step("finding what the surface reflects of the environment")
def _fit_model(model: str) -> Floats:
    return fit_isotropic_lobes(MODELS[model].lobe)
