"""Tables of isotropic lobes that approximate specular lobes, for lookups in prefiltered panoramas."""

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
    """Return the values of environment.wgsl's `#fill` constants for the table: sizes and roughness range."""
    return {
        "mirror_rough": ROUGHNESS_COUNT,
        "mirror_views": VIEW_COUNT,
        "mirror_lobes": LOBE_COUNT,
        "mirror_smoothest": float(LOBE_TABLE_ROUGHNESSES[0]),
        "mirror_roughest": float(LOBE_TABLE_ROUGHNESSES[-1]),
    }


@cache
def isotropic_lobe_table(model: str = "kelemen") -> Floats:
    """Return the isotropic lobes that approximate a specular lobe, by roughness and view, (12, 16, 5, 4).

    The last axis is the direction (x, y), the roughness and the weight of each of five lobes.

    model : name in MODELS

    The first axis is uniform in the logarithm of the roughness from 0.05 to 1, the second in the square root
    of the view's cosine. Directions are stereographic coordinates (x, y) about the mirror direction: the
    direction is 2 x away from the viewer, 2 y across the plane of incidence and 1 - x^2 - y^2 along the
    mirror direction, all divided by 1 + x^2 + y^2. Lobes that are interpolated between columns thus follow
    the mirror direction; the views of the last two columns are 29 degrees apart. The weighted sum of five
    lobes approximates the specular lobe, which at grazing views is elongated, off the mirror direction, and
    ends at the horizon. Lobes of weight 0 need no lookup. Models without a shipped table are fitted on first
    use, which takes half a minute.
    """
    rows = [row for row in read_rows("dermis.environment", "data/mirrors") if row["model"] == model]
    columns = [
        f"{name}_{k}" for k in range(LOBE_COUNT) for name in ("angle", "beside", "roughness", "weight")
    ]
    shape = ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT, 4
    fits = float_columns(rows, " ".join(columns)).reshape(shape) if rows else _fit_model(model)
    angle, out_of_plane, roughness, weight = np.moveaxis(fits, -1, 0)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    offset = angle - np.arccos(LOBE_TABLE_COSINES)[:, None]
    scale = 1.0 + np.cos(offset) * np.cos(out_of_plane)
    x, y = np.sin(offset) * np.cos(out_of_plane) / scale, np.sin(out_of_plane) / scale
    return np.stack([x, y, roughness, weight], -1)


@logged_step("finding what the surface reflects of the environment")
def _fit_model(model: str) -> Floats:
    return fit_isotropic_lobes(MODELS[model].lobe)
