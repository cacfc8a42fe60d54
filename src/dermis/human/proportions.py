"""Random proportions of faces, which vary more among adults than independent morph targets of parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

_TRUNCATION = 2.0  # largest deviation, in standard deviations
_MAX_WEIGHT = 0.7  # of a target, including the weight that it has already


class _Proportion(NamedTuple):
    """Opposite morph targets that change a proportion of the face.

    less, more : names of the targets that together decrease and increase it, with a weight of 1 each
    spread : standard deviation of the weight before truncation [-]
    """

    less: tuple[str, ...]
    more: tuple[str, ...]
    spread: float


_PROPORTIONS = (
    # distance of the inner corners of the eyes: without this entry, the standard deviation within a sex is
    # 1.0 mm; published: 1.5 to 3.2 mm within groups [Bouhadana2022]
    _Proportion(
        ("eyes/l-eye-trans-in", "eyes/r-eye-trans-in"), ("eyes/l-eye-trans-out", "eyes/r-eye-trans-out"), 0.25
    ),
    # width of the mouth: without this entry 2.4 mm; published: 3.3 mm (men) and 4.0 mm (women), table 9 of
    # doi 10.1186/s40902-019-0191-7
    _Proportion(("mouth/mouth-scale-horiz-decr",), ("mouth/mouth-scale-horiz-incr",), 0.25),
)


def with_proportions(rng: np.random.Generator, target_weights: Mapping[str, float]) -> dict[str, float]:
    """Return weights of a person's morph targets with randomly changed proportions of the face.

    target_weights : weights of the person's morph targets by name [-]
    """
    weights = dict(target_weights)
    for proportion in _PROPORTIONS:
        value = proportion.spread * float(np.clip(rng.normal(), -_TRUNCATION, _TRUNCATION))
        for less, more in zip(proportion.less, proportion.more, strict=True):
            present = weights.pop(more, 0.0) - weights.pop(less, 0.0)
            total = float(np.clip(present + value, -_MAX_WEIGHT, _MAX_WEIGHT))
            weights[more if total > 0 else less] = abs(total)
    return weights
