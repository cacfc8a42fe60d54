"""Hair of the head and beards: tens of thousands of hairs, each of which stands for some."""

from __future__ import annotations

import numpy as np

from dermis.human.hair import hairy_skin
from dermis.human.hair.combing import Combed, along_skin, combed
from dermis.human.hair.growth import Roughness, grown, guides, radii
from dermis.human.hair.grown import Grown
from dermis.human.hair.look import HairLook
from dermis.human.hair.skin import Skin
from dermis.mesh.head import Head
from dermis.mesh.strands import Doubles, finer_roots, frames, points_of

MOST_PER_CM2 = 200.0
"""Hairs of the densest heads."""
_DRAWN_PER_CM2 = 75.0  # each of which stands for some
_STRAIGHT_KNOTS, _BENT_KNOTS = 5, 7
_GUIDES_PER_CM2 = 1.6
_BEARD_PER_CM2 = 60.0
_BEARD_DRAWN_PER_CM2 = 60.0


def knots_of(look: HairLook) -> int:
    """Of each hair: few for what is hardly bent."""
    return _BENT_KNOTS if look.style == "short" or look.curl > 0.5 or look.beard_mm > 8.0 else _STRAIGHT_KNOTS


def scalp_hair(head: Head, plain: Head, levels: int, look: HairLook, skin: Skin) -> list[Grown]:
    """The hair of the head; none for a bald one."""
    if look.style == "none":
        return []
    rng, knots = np.random.default_rng((look.seed, 3)), knots_of(look)
    where = hairy_skin.scalp(look.recession)
    drawn = _DRAWN_PER_CM2 * (0.3 + 0.7 * look.density)
    bundle = MOST_PER_CM2 * look.density / drawn
    few = hairy_skin.rooted(plain.mesh, where, _GUIDES_PER_CM2, rng)
    many = hairy_skin.rooted(plain.mesh, where, drawn, rng)
    points = points_of(head.mesh)
    few_mm, frame = frames(head.mesh, finer_roots(plain.mesh, few.roots, levels), points)
    ways = guides(skin, few_mm, combed(few.places, frame[:, 2], look), knots)
    roots = finer_roots(plain.mesh, many.roots, levels)
    root, frame = frames(head.mesh, roots, points)
    found = grown(root, frame[:, 2], few_mm, ways, _roughness(look), rng)
    t = np.linspace(0.0, 1.0, knots)
    radius = radii(len(root), t, bundle, rng)
    return [Grown(roots, root[:, None] + found, radius, 1.0, bundle, _cover(found, radius, drawn))]


def beard_hair(head: Head, plain: Head, levels: int, look: HairLook, skin: Skin) -> list[Grown]:
    """The beard; none for a shaved one."""
    if look.beard_mm == 0.0:
        return []
    rng, knots = np.random.default_rng((look.seed, 4)), knots_of(look)
    few = hairy_skin.rooted(plain.mesh, hairy_skin.beard, _GUIDES_PER_CM2, rng)
    many = hairy_skin.rooted(plain.mesh, hairy_skin.beard, _BEARD_DRAWN_PER_CM2, rng)
    points = points_of(head.mesh)
    few_mm, frame = frames(head.mesh, finer_roots(plain.mesh, few.roots, levels), points)
    n = len(few_mm)
    outwards = np.sign(few.places[:, 0]) * np.minimum(np.abs(few.places[:, 0]) / 25.0, 1.0)
    down = np.stack([0.4 * outwards, np.full(n, -1.0), np.zeros(n)], axis=1)
    way = along_skin(down, frame[:, 2])
    lie = Combed(way, np.full(n, look.beard_mm), np.full(n, 0.85), np.full(n, 0.35))
    ways = guides(skin, few_mm, lie, knots)
    roots = finer_roots(plain.mesh, many.roots, levels)
    root, frame = frames(head.mesh, roots, points)
    found = grown(root, frame[:, 2], few_mm, ways, Roughness(0.3, 0.22, 0.15, 0.05), rng)
    bundle = _BEARD_PER_CM2 / _BEARD_DRAWN_PER_CM2
    t = np.linspace(0.0, 1.0, knots)
    radius = 1.4 * radii(len(root), t, bundle, rng)
    cover = _cover(found, radius, _BEARD_DRAWN_PER_CM2)
    return [Grown(roots, root[:, None] + found, radius, 1.0, 1.4 * bundle, cover)]


def _cover(ways: Doubles, radius: Doubles, per_cm2: float) -> float:
    """What hairs cover of a place among them, over each other: their mean area seen from the side, halved for their tilt."""
    length = np.linalg.norm(np.diff(ways, axis=1), axis=2).sum(axis=1)
    return float(0.5 * per_cm2 / 100.0 * np.mean(2.0 * radius.mean(axis=1) * length))


def _roughness(look: HairLook) -> Roughness:
    if look.style == "cropped":
        tight = max(look.curl - 0.5, 0.0) * 2
        return Roughness(0.25, 0.12, 0.1, 0.05 + 0.1 * look.curl, 0.9 * tight, 2.0)
    return Roughness(0.14, 0.14, 0.5, 0.03 + 0.12 * look.curl, 1.6 * max(look.curl - 0.4, 0.0), 2.0)
