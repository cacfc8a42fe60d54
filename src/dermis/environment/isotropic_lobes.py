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
    """Return named values that `//#fill` lines insert into environment.wgsl.

    The values are the sizes and the roughness range of the table of isotropic lobes.
    """
    return {
        "mirror_rough": ROUGHNESS_COUNT,
        "mirror_views": VIEW_COUNT,
        "mirror_lobes": LOBE_COUNT,
        "mirror_smoothest": float(LOBE_TABLE_ROUGHNESSES[0]),
        "mirror_roughest": float(LOBE_TABLE_ROUGHNESSES[-1]),
    }


@cache
def isotropic_lobe_table(model: str = "kelemen") -> Floats:
    """Return a table (12, 16, 5, 4) of the five isotropic lobes that approximate a specular lobe.

    The axes of the table are roughness, view, lobe, and parameter. The roughness axis is uniform in the
    logarithm of the roughness, from 0.05 to 1. The view axis is uniform in the square root of the cosine of
    the view angle. The parameters are the direction (x, y), the roughness and the weight of a lobe.

    model : name in MODELS

    The direction (x, y) is the stereographic projection of a unit vector about the mirror direction: x points
    away from the viewer in the plane of incidence, and y is perpendicular to this plane. The components of
    the unit vector along x, y and the mirror direction are 2x, 2y and 1 - x^2 - y^2, each divided by
    1 + x^2 + y^2. Lobes thus follow the mirror direction when the table is interpolated between views.

    Lobes of weight 0 need no lookup. Models without a shipped table are fitted on first use, which takes half
    a minute.
    """
    rows = [row for row in read_rows("dermis.environment", "data/mirrors") if row["model"] == model]
    columns = [
        f"{name}_{k}" for k in range(LOBE_COUNT) for name in ("angle", "beside", "roughness", "weight")
    ]
    shape = ROUGHNESS_COUNT, VIEW_COUNT, LOBE_COUNT, 4
    fits = float_columns(rows, " ".join(columns)).reshape(shape) if rows else _fit_lobe_table(model)
    angle, out_of_plane, roughness, weight = np.moveaxis(fits, -1, 0)
    weight = weight / weight.sum(axis=-1, keepdims=True)
    offset = angle - np.arccos(LOBE_TABLE_COSINES)[:, None]
    scale = 1.0 + np.cos(offset) * np.cos(out_of_plane)
    x, y = np.sin(offset) * np.cos(out_of_plane) / scale, np.sin(out_of_plane) / scale
    return np.stack([x, y, roughness, weight], -1)


@logged_step("finding what the surface reflects of the environment")
def _fit_lobe_table(model: str) -> Floats:
    return fit_isotropic_lobes(MODELS[model].lobe)
