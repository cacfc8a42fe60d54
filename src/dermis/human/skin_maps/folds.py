"""Lines of the face as curves on the skin."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import gradient, spline
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.shape import symmetric
from dermis.human.skin_maps.face import read_rows
from dermis.human.skin_maps.patch import Doubles

_PIECES = 4


class Folds(NamedTuple):
    """Curves of straight pieces on the left half of the symmetric head.

    knots : (k, 3) of all curves [mm]
    along : (k,) from 0 at a curve's start to 1 at its end [-]
    first : (c + 1,) where each curve begins
    bounds : (c, 4) centre and radius of a ball around it [mm]
    width_mm, depth_mm : (c,) of the furrow [mm]
    """

    knots: Doubles
    along: Doubles
    first: NDArray[np.int64]
    bounds: Doubles
    width_mm: Doubles
    depth_mm: Doubles


def make_folds(parameters: BustParameters, age: float) -> Folds:
    """The folds of a face of this age, 0 to 1, on its skin."""
    curves, sizes = [], []
    for _, group in groupby(read_rows("folds"), key=lambda row: row["fold"]):
        rows = list(group)
        curves.append(spline([[float(row[axis]) for axis in "xyz"] for row in rows], _PIECES))
        width, young, old = (float(rows[0][name]) for name in ("width", "young", "old"))
        sizes.append((width, young + age * (old - young)))
    lengths = [len(curve) for curve in curves]
    knots = _on_skin(np.concatenate(curves), parameters)
    first = np.concatenate(([0], np.cumsum(lengths)))
    along = np.concatenate([np.linspace(0.0, 1.0, length) for length in lengths])
    bounds = np.array([_ball(part) for part in np.split(knots, first[1:-1])])
    width_mm, depth_mm = np.array(sizes).T
    return Folds(knots, along, first, bounds, width_mm.copy(), depth_mm.copy())


def _on_skin(points: Doubles, parameters: BustParameters) -> Doubles:
    """Points (n, 3) of the symmetric head moved onto its skin."""
    for _ in range(5):
        slope = gradient(lambda p: symmetric(p, parameters), points)
        away = symmetric(points, parameters) / np.maximum(np.einsum("ni,ni->n", slope, slope), 0.05)
        points = points - slope * away[:, None]
    return points


def _ball(points: Doubles) -> Doubles:
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.append(centre, np.linalg.norm(points - centre, axis=1).max())
