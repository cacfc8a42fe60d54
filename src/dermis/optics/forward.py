"""Light that a half-space returns by its directions, where scattering goes forward."""

from __future__ import annotations

from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.directions import (
    KEPT,
    ROWS,
    Directions,
    albedo_returning,
    directions,
    interpolated,
    mean_of_once,
    refracted,
)
from dermis.optics.slabs import NODES, leaving_deep

Floats = NDArray[np.float64]
_NEAR = 3  # cosines by which those beyond the last one are told
_LEAST = 1e-12


def forward_directions(total: ArrayLike, eta: float, g: float) -> Directions:
    """`directions` of half-spaces of the same reduced coefficients whose scattering goes forward.

    To what leaves at a slant there comes what the best fits to all pairs of directions differ by.

    total : (c,) that half-spaces which scatter alike in all directions return [-]
    eta : index of refraction against the air, at least 1 [-]
    g : mean cosine of scattering, 0 or more [-]
    """
    even = directions(total, eta)
    if g == 0.0:
        return even
    shares = np.atleast_1d(np.asarray(total, np.float64))
    found, plain = (
        np.stack([interpolated(partial(_numbers, eta, one), float(share)) for share in shares], axis=-1)
        for one in (g, 0.0)
    )
    once = even.once + found[ROWS + 1] - plain[ROWS + 1]
    return Directions(eta, found[:ROWS], found[ROWS], once, even.mean_once)


@lru_cache(maxsize=KEPT)
def _numbers(eta: float, g: float, total: float) -> Floats:
    """(ROWS + 2,) as `directions` has them."""
    a, share, radiance = leaving_deep(albedo_returning(total, eta), eta, NODES, g)
    returned = share @ radiance
    above = float(_beyond(a, returned, np.ones(1))[0])
    if above <= _LEAST:
        return np.append(np.ones(ROWS + 1), 0.0)
    table = _beyond(a, returned, refracted(np.linspace(0.0, 1.0, ROWS) ** 2, eta))
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    slant, uneven = 1.0 / (a[:, None] + a) - mean_of_once(air, eta), radiance - returned
    weight = np.outer(share, share)
    once = (weight * slant * uneven).sum() / (weight * slant**2).sum()
    return np.concatenate([table, [share @ returned, once]]) / above


def _beyond(known: Floats, values: Floats, cosine: Floats) -> Floats:
    """Values at cosines, between those known and a little beyond."""
    order = np.argsort(known)
    x, y = known[order], values[order]
    found = np.interp(cosine, x, y)
    for end, outside in ((slice(_NEAR), cosine < x[0]), (slice(-_NEAR, None), cosine > x[-1])):
        found = np.where(outside, np.polyval(np.polyfit(x[end], y[end], _NEAR - 1), cosine), found)
    return np.asarray(found)
