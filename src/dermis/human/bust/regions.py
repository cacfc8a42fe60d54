"""Which part of the face a place of the skin belongs to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust import ears, lips, nose
from dermis.human.bust.fields import Doubles
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.shape import fold
from dermis.human.bust.warp import make_warp

REGIONS = (
    "forehead",
    "brow",
    "eyelid",
    "nose",
    "cheek",
    "upper lip",
    "lips",
    "chin",
    "ear",
    "neck and scalp",
)
"""Names of the labels that `region_of` gives; the sixth is the skin between nose and mouth."""


def region_of(points: Doubles, parameters: BustParameters) -> NDArray[np.int64]:
    """Index into `REGIONS` (n,) of places (n, 3) on or near the skin of a bust [mm]."""
    p = fold(make_warp(parameters).undo(np.asarray(points, dtype=np.float64)))
    tests = {
        "ear": ears.belongs(p, parameters),
        "eyelid": _eyelid(p),
        "brow": _brow(p),
        "nose": nose.belongs(p, parameters),
        "lips": _front(p) & lips.belongs(p),
        "upper lip": _front(p) & lips.above(p),
        "chin": _front(p) & (p[:, 0] < 24) & (p[:, 1] < -66) & (p[:, 1] > _jaw_edge(p)),
        "forehead": (p[:, 1] > 10) & (p[:, 1] < _hairline(p)) & (p[:, 2] > 25),
        "cheek": (p[:, 2] > 0) & (p[:, 1] <= 24) & (p[:, 1] > _jaw_edge(p)),
    }
    return np.select(
        list(tests.values()), [REGIONS.index(name) for name in tests], default=REGIONS.index("neck and scalp")
    )


def _front(p: Doubles) -> NDArray[np.bool_]:
    return np.asarray(p[:, 2] > 55)


def _eyelid(p: Doubles) -> NDArray[np.bool_]:
    x, y, z = p.T
    return np.asarray((((x - 31) / 18) ** 2 + ((y + 0.5) / 12) ** 2 < 1) & (z > 50))


def _brow(p: Doubles) -> NDArray[np.bool_]:
    """The arch where eyebrows grow, thinner outwards."""
    x, y, z = p.T
    middle = 22.5 - ((x - 35) / 10) ** 2 * 1.2
    inside = np.abs(y - middle) < 5.5 - 0.06 * np.maximum(x - 20, 0)
    return np.asarray(inside & (x > 9) & (x < 56) & (z > 40))


def _hairline(p: Doubles) -> Doubles:
    """Height of the hairline, lower at the temples."""
    return 74 - 0.006 * np.maximum(p[:, 0] - 20, 0) ** 2


def _jaw_edge(p: Doubles) -> Doubles:
    """Height of the lower edge of the jaw, which rises to the ear."""
    return -112 + 0.4 * np.maximum(78 - p[:, 2], 0)
