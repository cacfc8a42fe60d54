"""Hairs as Mitsuba's curves: cubic splines through their knots, with the fibres' own absorption."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.described import rgb
from dermis.apps.truths.person.subject import Hairs

Doubles = NDArray[np.float64]

INDEX = 1.55
"""Of refraction of keratin [Marschner2003]."""
TILT_DEGREES = 2.0
"""By which the scales of the cuticle rise."""
ROUGH_ALONG, ROUGH_AROUND = 0.22, 0.5
"""As artists give it [Chiang2016]."""
COLOURS = 12
"""Different absorptions at most: curves of one file share theirs."""
_LEAST_MM = 1e-3


def hair_shapes(mi: Any, hairs: Hairs, name: str = "hairs") -> dict[str, Any]:
    """The hairs in groups of nearly the same absorption, each a shape of that name and a number."""
    shapes = {}
    depth = hairs.absorption * hairs.radius_mm.max(axis=1, keepdims=True)  # Mitsuba's unit is the radius
    with tempfile.TemporaryDirectory() as folder:
        for k, group in enumerate(groups(depth)):
            file = Path(folder) / f"{k}.txt"
            write_curves(file, hairs.knots_mm[group], hairs.radius_mm[group])
            fibre = {
                "type": "hair",
                "sigma_a": rgb(depth[group].mean(axis=0)),
                "longitudinal_roughness": ROUGH_ALONG,
                "azimuthal_roughness": ROUGH_AROUND,
                "scale_tilt": TILT_DEGREES,
                "int_ior": INDEX,
            }
            shapes[f"{name}_{k}"] = mi.load_dict(
                {"type": "bsplinecurve", "filename": str(file), "bsdf": fibre}
            )
    return shapes


def groups(depth: NDArray[np.floating]) -> list[NDArray[np.int64]]:
    """Rows (n, 3) in as many groups as `COLOURS` at most, by their sum."""
    order = np.argsort(depth.sum(axis=1), kind="stable")
    return [part for part in np.array_split(order, min(COLOURS, len(order))) if len(part)]


def write_curves(path: Path, knots_mm: Doubles, radius_mm: NDArray[np.floating]) -> None:
    """A file of curves for Mitsuba: a line for each control point, an empty one after each curve."""
    rows = np.concatenate([knots_mm, radius_mm[..., None].astype(np.float64)], axis=-1)
    points = control_points(rows)
    points[..., 3] = np.maximum(points[..., 3], _LEAST_MM)
    with path.open("w", encoding="ascii") as file:
        for curve in points:
            np.savetxt(file, curve, "%.5f")
            file.write("\n")


def control_points(knots: Doubles) -> Doubles:
    """(n, k + 2, c) of uniform cubic B-splines through knots (n, k, c), straight at both ends."""
    count = knots.shape[1]
    matrix = np.eye(count)
    inner = np.arange(1, count - 1)
    matrix[inner, inner] = 4 / 6
    matrix[inner, inner - 1] = matrix[inner, inner + 1] = 1 / 6
    found = np.einsum("jk,nkc->njc", np.linalg.inv(matrix), knots)
    ends = 2 * found[:, [0, -1]] - found[:, [1, -2]]
    return np.concatenate([ends[:, :1], found, ends[:, 1:]], axis=1)
