"""Hair of the head and beards: tens of thousands of hairs, each of which stands for some."""

from __future__ import annotations

from functools import partial

import numpy as np

from dermis.base.arrays import Floats
from dermis.human.hair import hairy_skin
from dermis.human.hair.combing import combed, combed_beard
from dermis.human.hair.grown import Ground, Grown, Rooted
from dermis.human.hair.growth import Roughness, grown
from dermis.human.hair.look import HairLook
from dermis.mesh.geometry import dots

MOST_PER_CM2 = 200.0
"""Hairs of the densest heads."""
BEARD_PER_CM2 = 60.0
"""Hairs of beards."""
_HAIR_MM, _BEARD_MM = 0.034, 0.048  # radius of a hair
_TIP = 0.6  # of that, at the tip
_STRAIGHT_KNOTS, _BENT_KNOTS, _COILED_KNOTS = 5, 7, 9
_TIGHT = 0.5  # curl from which on there are coils
_LONG_BEARD_MM = 8.0


def knots_of(look: HairLook) -> int:
    """Of each hair: few for what is hardly bent."""
    if look.curl > _TIGHT:
        return _COILED_KNOTS
    return _BENT_KNOTS if look.style == "short" or look.beard_mm > _LONG_BEARD_MM else _STRAIGHT_KNOTS


def scalp_hair(ground: Ground, look: HairLook, recession: float) -> list[Grown]:
    """The hair of the head; none for a bald one."""
    if look.style == "none" or look.density == 0.0:
        return []
    rng, drawn = np.random.default_rng((look.seed, 3)), ground.share * (22.0 + 53.0 * look.density)
    roots = hairy_skin.rooted(ground.plain, hairy_skin.scalp(recession), drawn, rng)
    comb = partial(combed, look=look, recession=recession)
    hair, ways = grown(ground, roots, comb, knots_of(look), _roughness(look), rng)
    return [_stranded(hair, ways, drawn, MOST_PER_CM2 * look.density, _HAIR_MM, rng)]


def beard_hair(ground: Ground, look: HairLook) -> list[Grown]:
    """The beard; none for a shaved one."""
    if look.beard_mm == 0.0:
        return []
    rng, drawn = np.random.default_rng((look.seed, 4)), ground.share * BEARD_PER_CM2
    roots = hairy_skin.rooted(ground.plain, hairy_skin.beard(), drawn, rng)
    tight = max(look.curl - _TIGHT, 0.0) * 2
    rough = Roughness(0.3, 0.22, 0.2, 0.05 + 0.1 * look.curl, 0.5 * tight, 1.5)
    hair, ways = grown(ground, roots, partial(combed_beard, look=look), knots_of(look), rough, rng)
    return [_stranded(hair, ways, drawn, BEARD_PER_CM2, _BEARD_MM, rng)]


def _stranded(
    hair: Rooted,
    ways: Floats,
    drawn: float,
    true: float,
    radius_mm: float,
    rng: np.random.Generator,
) -> Grown:
    """Hairs with their width; fewer than there are, and wider.

    ways : (k, 3, n) from `grown`
    drawn, true : how many are made and how many there are on a square centimetre
    """
    bundle, (knots, _, n) = true / drawn, ways.shape
    radius = np.tile((bundle * radius_mm * rng.uniform(0.8, 1.2, (n, 1))).astype(np.float32), knots)
    radius[:, -1] *= np.float32(_TIP)
    steps = np.diff(ways, axis=0)
    length = np.sqrt(dots(steps, steps)).sum(axis=0, dtype=np.float64)
    area = float(np.mean(2.0 * radius.mean(axis=1) * length))  # seen from the side; halved as hair leans
    seen = np.empty((n, knots, 3), np.float32)
    for c in range(3):
        seen[..., c] = dots(ways, hair.along[c]).T
    return Grown(hair.roots, seen, radius, 1.0, bundle, 0.5 * area * drawn / 100.0)


def _roughness(look: HairLook) -> Roughness:
    tight = max(look.curl - _TIGHT, 0.0) * 2
    if look.style == "cropped":
        return Roughness(0.25, 0.12, 0.1 + 0.2 * tight, 0.04 + 0.06 * look.curl, 0.9 * tight, 2.0)
    return Roughness(0.14, 0.14, 0.5, 0.025 + 0.04 * look.curl, 1.6 * tight, 2.0)
