"""Hair, beard, brows and lashes of a person, rooted in the same places of everyone's skin."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair import brows, lashes
from dermis.human.hair.brows import BrowSkin
from dermis.human.hair.grown import Ground, Grown, Rooted, Skin
from dermis.human.hair.hairy_skin import skin_beside
from dermis.human.hair.head_hair import beard_hair, scalp_hair
from dermis.human.hair.look import HairLook
from dermis.human.hair.rooting import SIDES, Rooting, eye_middles
from dermis.mesh.head import Head
from dermis.mesh.strands import Roots, Strands, seen_in
from dermis.specular.hair import absorption_per_mm

_LASHES_DARKER = 1.6
_ALIKE = 5  # hairs of head and beard whose mean one that is drawn has the colour of
_LEAST_EUMELANIN = 0.07  # white hair is not quite white


def groomed(
    head: Head,
    plain: Head,
    rooting: Rooting,
    look: HairLook,
    recession: float = 0.0,
    hairs: float = 1.0,
) -> Head:
    """The head with hair, beard, brows and lashes.

    plain : the head before it was subdivided
    rooting : on the person whose brows are where the artist has them
    recession : see `SkinLook`
    hairs : share of those of head and beard that grows, each as much wider
    """
    skin = Skin(head.mesh, skin_beside(rooting, look.beard_mm > 0.0))
    ground = Ground(head, plain.mesh, skin, hairs)
    rngs = [np.random.default_rng((look.seed, int(side > 0))) for side in SIDES]
    left, right = _brows(ground, rooting, look, rngs)
    rows = list(_lashes(ground, rooting, eye_middles(plain.mesh), rngs))
    parts = [left, *rows[:2], right, *rows[2:]]
    head = replace(head, strands=_joined(parts, _absorption(parts, look)))
    hair = [*scalp_hair(ground, look, recession), *beard_hair(ground, look)]
    if not hair:
        return head
    joined = _joined(hair, _mixed_absorption(hair, look))
    return replace(head, hair=_shuffled(joined, look.seed))


def _shuffled(strands: Strands, seed: int) -> Strands:
    """The same hairs in no order, so that the first few are like all."""
    order = np.random.default_rng((seed, 5)).permutation(len(strands))
    roots = Roots(strands.roots.quad.take(order), strands.roots.place.take(order, axis=0))
    names = "knots_mm", "radius_mm", "absorption", "cover"
    parts = {name: getattr(strands, name).take(order, axis=0) for name in names}
    return replace(strands, roots=roots, **parts)


def _brows(
    ground: Ground, rooting: Rooting, look: HairLook, rngs: list[np.random.Generator]
) -> Iterator[Grown]:
    """The left and the right brow, grown at once: for so few hairs each step costs what it costs for one."""
    roots, told = [], []
    for side, rng in zip(SIDES, rngs, strict=True):
        u, v, x, y = brows.places(rng)
        found, there = rooting.in_front(side * x, y)
        kept = np.flatnonzero(there)[: brows.count(look)]
        roots.append(Roots(found.quad[kept], found.place[kept]))
        shape = brows.shapes(u[kept], v[kept], rng, look)
        told.append(np.vstack([np.full(len(kept), side), x[kept], y[kept], shape]))
    where, hair = ground.rooted(_roots(roots)), np.concatenate(told, axis=1)
    skin = BrowSkin(*ground.skin.foot(ground.rooted(rooting.around_brows).places))
    both = _grown(where, *brows.grown(skin, where.places, hair[0], hair[1:3], hair[3:]), 1.0)
    yield from _parted(both, [len(part.quad) for part in roots])


def _lashes(
    ground: Ground, rooting: Rooting, eyes: Doubles, rngs: list[np.random.Generator]
) -> Iterator[Grown]:
    """The upper and the lower lashes of the left eye, then those of the right one, grown at once too.

    eyes : (2, 3) middles
    """
    roots, told, before = [], [], 0
    for side, eye, rng in zip(SIDES, eyes, rngs, strict=True):
        for lid in (lashes.UPPER, lashes.LOWER):
            u, across = lashes.places(lid, rng)
            roots.append(rooting.beside_lid(lid, side, u, across))
            shape = lashes.shapes(lid, u, rng, before)
            told.append(np.vstack([np.full((len(u), 4), [side, *eye]).T, shape]))
            before += len(u) + 1
    where, hair = ground.rooted(_roots(roots)), np.concatenate(told, axis=1)
    grown = lashes.grown(where.places, hair[1:4].T, hair[0], hair[4:])
    yield from _parted(_grown(where, *grown, _LASHES_DARKER), [len(part.quad) for part in roots])


def _parted(hair: Grown, counts: list[int]) -> Iterator[Grown]:
    """So many of some hairs after the other."""
    for end, count in zip(np.cumsum(counts).tolist(), counts, strict=True):
        part = slice(end - count, end)
        roots = Roots(hair.roots.quad[part], hair.roots.place[part])
        yield hair._replace(roots=roots, knots=hair.knots[part], radius=hair.radius[part])


def _grown(where: Rooted, knots_mm: Doubles, radius_mm: Doubles, darker: float) -> Grown:
    """Hairs whose knots (n, k, 3) are told in the space of the person."""
    ways = seen_in(where.frame, knots_mm - where.places[:, None])
    return Grown(where.roots, ways, radius_mm.astype(np.float32), darker)


def _joined(parts: list[Grown], absorption: Doubles) -> Strands:
    """All hairs of some kinds.

    absorption : (n, 3) of single hairs [1/mm]
    """
    roots = _roots(part.roots for part in parts)
    ways, radius = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    bundle, cover = (_each(parts, name) for name in ("bundle", "cover"))
    return Strands(
        roots, ways, radius, (absorption / bundle[:, None]).astype(np.float32), cover.astype(np.float32)
    )


def _roots(parts: Iterable[Roots]) -> Roots:
    quads, places = zip(*parts, strict=True)
    return Roots(np.concatenate(quads), np.concatenate(places))


def _each(parts: list[Grown], name: str) -> Doubles:
    """(n,) a number of the kinds, for each of their hairs."""
    return np.concatenate([np.full(len(part.radius), getattr(part, name)) for part in parts])


def _absorption(parts: list[Grown], look: HairLook) -> Doubles:
    """(n, 3) of brows and lashes, of which some have no pigment [1/mm]."""
    rng, darker = np.random.default_rng((look.seed, 2)), _each(parts, "darker")
    n = len(darker)
    much = darker * rng.lognormal(0.0, 0.15, n) * (rng.random(n) >= look.grey)
    return absorption_per_mm(much * look.eumelanin, much * look.pheomelanin)


def _mixed_absorption(parts: list[Grown], look: HairLook) -> Doubles:
    """(n, 3) of hairs that stand for some, of which some have no pigment [1/mm].

    The mean of white and of brown hairs is grey, where brown hair with less pigment would be blond.
    """
    rng, n = np.random.default_rng((look.seed, 6)), sum(len(part.radius) for part in parts)
    white = rng.binomial(_ALIKE, look.grey, n)[:, None] / _ALIKE
    much = rng.lognormal(0.0, 0.12, n)
    dark = absorption_per_mm(much * look.eumelanin, much * look.pheomelanin)
    mixed = (1.0 - white) * dark + white * dark.mean(axis=1, keepdims=True)
    return np.asarray(np.maximum((1.0 - white) ** 2 * mixed, absorption_per_mm(_LEAST_EUMELANIN, 0.0)))
