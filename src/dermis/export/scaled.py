"""Curves of one shape and any size, such as those of random walks, and the size that fits best."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from dermis.export.curve import Curve
from dermis.optics.media import Floats

Shape = Callable[[Floats], Floats]
"""Share of what leaves anywhere that leaves within radii (n,) in units of the size."""

_LEAST, _MOST, _NODES = 1e-3, 25.0, 500  # radii that a fit is judged at, by the true median
_REACH = 30.0  # of sizes about a first guess


def scaled(shapes: Sequence[Shape], size_mm: ArrayLike, energy: ArrayLike) -> Curve:
    """The curve of three shapes of these sizes.

    size_mm : (3,) above 0 [mm]
    energy : (3,) light that leaves anywhere, per light that enters [-]
    """
    size = np.maximum(np.asarray(size_mm, np.float64), 1e-9)

    def within(radius_mm: Floats) -> Floats:
        columns = [shape(radius_mm / one) for shape, one in zip(shapes, size, strict=True)]
        return np.stack(columns, axis=-1)

    return Curve.of(within, energy)


def fit_size(curve: Curve, shapes: Sequence[Shape]) -> Floats:
    """Sizes (3,) at which the cumulative profile is nearest: least squares over radius [mm]."""
    return np.array([_fit(curve, channel, shape) for channel, shape in enumerate(shapes)])


def _fit(curve: Curve, channel: int, shape: Shape) -> float:
    from scipy.optimize import minimize_scalar

    median = float(curve.radius_of(0.5)[channel])
    r = median * np.linspace(_LEAST, _MOST, _NODES)
    true = curve.within(r)[:, channel]

    def error(log_size: float) -> float:
        return float(((shape(r * np.exp(-log_size)) - true) ** 2).sum())

    guess = np.log(median) + np.linspace(-np.log(_REACH), np.log(_REACH), 21)
    best = int(np.argmin([error(one) for one in guess]))
    around = guess[max(best - 1, 0)], guess[min(best + 1, len(guess) - 1)]
    found = minimize_scalar(error, bounds=around, method="bounded", options={"xatol": 1e-7})
    return float(np.exp(found.x))
