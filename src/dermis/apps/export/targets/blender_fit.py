"""The length of a curve of one known shape that brings it nearest to the true one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dermis.optics.curve import Curve
from dermis.optics.media import Floats

_LEAST, _MOST, _NODES = 1e-2, 60.0, 400  # radii that a fit is judged at, by the true median
_KNOWN = np.geomspace(1e-4, 1e4, 2000)
_SPAN, _EXACT = (
    2.0,
    1e-4,
)  # logarithms of lengths: around the one of the same median, and as far as they matter


def fit_length(curve: Curve, channel: int, within: Callable[[Floats], Floats]) -> float:
    """The length by which a cumulative profile is nearest to one channel's: least squares over log r [mm].

    within : share of what leaves anywhere, within radii (n,) of a length of 1
    """
    from scipy.optimize import minimize_scalar

    median = float(curve.radius_of(0.5)[channel])
    r = median * np.geomspace(_LEAST, _MOST, _NODES)
    true = curve.within(r)[:, channel]
    middle = np.log(median / float(np.interp(0.5, within(_KNOWN), _KNOWN)))

    def error(length: float) -> float:
        return float(((within(r / np.exp(length)) - true) ** 2).sum())

    bounds = middle - _SPAN, middle + _SPAN
    found = minimize_scalar(error, bounds=bounds, method="bounded", options={"xatol": _EXACT})
    return float(np.exp(found.x))
