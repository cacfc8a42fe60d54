"""Hairs between guides: a few hundred of these follow the skin, and tens of thousands of hairs go along."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from dermis.human.hair.combing import Combed, along_skin
from dermis.human.hair.grown import Rooted
from dermis.human.hair.skin import Skin
from dermis.mesh.mesh import Floats
from dermis.mesh.strands import Doubles

_BESIDE = 4  # guides that a hair goes along with
_TUFT_MM = 2.2  # between tufts
_LEAST_OVER_MM = 0.35  # the skin
_HEAD_MM = 85.0  # radius
_LEAST = np.float32(1e-9)


class Roughness(NamedTuple):
    """By how much hairs differ from their guides.

    astray : angle to the side [rad]
    uneven : of lengths, as a share
    tufts : how much tips are drawn together, 0 to 1
    frizz : of waves, over the length
    coil_mm : radius of curls
    coils : how many turns
    """

    astray: float
    uneven: float
    tufts: float
    frizz: float
    coil_mm: float = 0.0
    coils: float = 0.0


def guides(skin: Skin, root_mm: Doubles, combed: Combed, knots: int) -> Doubles:
    """(n, k, 3) ways from roots (n, 3) to knots, over the skin [mm]."""
    foot, normal = skin.foot(root_mm)
    off = root_mm - foot  # as far as the skin of few vertices is from the surface
    way, height = combed.way, np.zeros(len(root_mm))
    step = combed.length_mm / (knots - 1)
    found = [root_mm]
    for k in range(1, knots):
        rise = combed.rise + (combed.last_rise - combed.rise) * (k - 0.5) / (knots - 1)
        height = np.maximum(height + step * np.sin(rise), _LEAST_OVER_MM)
        way = along_skin(way, normal)
        foot, normal = skin.foot(foot + (step * np.cos(rise))[:, None] * way)
        found.append(foot + off + height[:, None] * normal)
    return np.stack(found, axis=1) - root_mm[:, None]


def grown(
    hair: Rooted,
    guide_mm: Doubles,
    ways: Doubles,
    rough: Roughness,
    rng: np.random.Generator,
) -> Floats:
    """(k, 3, n) ways from the roots of hairs to their knots [mm].

    guide_mm, ways : (g, 3) and (g, k, 3) of the guides

    Hairs come last in all arrays here, so that what is done to one is done to all at once. What must be the
    same on all machines is so: sines are taken of doubles, and floats are only added and multiplied.
    """
    t, normal = np.linspace(0.0, 1.0, ways.shape[1])[:, None], hair.along[2]
    found = _astray(_between(hair.places, guide_mm, ways), normal, rough, rng)
    _draw_together(found, hair.places, t, rough.tufts, rng)
    tips = found[-1]
    size = rough.frizz * np.sqrt(dots(tips, tips))
    for fade, part in _waves(size, t, rng):
        found += fade[..., None].astype(np.float32) * part
    if rough.coil_mm:
        found += _coils(found[-1], t, rough, rng)
    return _over_skin(found, normal, t.astype(np.float32))


def dots(a: Floats, b: Floats) -> Floats:
    """(..., n) products of vectors (..., 3, n)."""
    x, y, z = (a[..., c, :] * b[..., c, :] for c in range(3))
    return np.asarray(x + y + z)


def _crosses(a: Floats, b: Floats) -> Floats:
    """(..., 3, n) of vectors (3, n) and (..., 3, n)."""
    (ax, ay, az), (bx, by, bz) = a, (b[..., c, :] for c in range(3))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-2)


def _between(root_mm: Doubles, guide_mm: Doubles, ways: Doubles) -> Floats:
    """(k, 3, n) means of the nearest guides' ways."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    n, g = len(root_mm), len(guide_mm)
    far, near = cKDTree(guide_mm).query(root_mm, k=_BESIDE)
    share = 1.0 / (np.asarray(far) ** 2 + 4.0)
    share /= share.sum(axis=1, keepdims=True)
    first = np.arange(0, _BESIDE * n + 1, _BESIDE)
    shares = csr_array((share.ravel().astype(np.float32), np.asarray(near).ravel(), first), shape=(n, g))
    found = shares @ ways.reshape(g, -1).astype(np.float32)
    return np.ascontiguousarray(found.T).reshape(*ways.shape[1:], n)


def _astray(ways: Floats, normal: Floats, rough: Roughness, rng: np.random.Generator) -> Floats:
    """Turned about the skin's normal, each as a whole, leaning more or less, and longer or shorter."""
    n = ways.shape[-1]
    angle, lean = rough.astray * rng.standard_t(4, size=n), 1.0 + rough.astray * rng.normal(size=n)
    length = np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.2)
    stay, turn = length * np.cos(angle), length * np.sin(angle)
    stay, turn, rise = (one.astype(np.float32) for one in (stay, turn, length * lean - stay))
    found = turn * _crosses(normal, ways)
    found += (rise * dots(ways, normal))[:, None] * normal
    found += stay * ways
    return found


def _draw_together(
    ways: Floats, root_mm: Doubles, t: Doubles, much: float, rng: np.random.Generator
) -> None:
    """Draw tips to those of a few, in tufts."""
    from scipy.spatial import cKDTree

    cell = np.floor(root_mm / _TUFT_MM).astype(np.int64)
    cell -= cell.min(axis=0)
    wide, high, deep = (cell.max(axis=0) + 1).tolist()
    _, first = np.unique(np.ravel_multi_index(cell.T, (wide, high, deep)), return_index=True)
    which = first[cKDTree(root_mm[first]).query(root_mm)[1]]
    drawn = (much * rng.uniform(0.3, 1.0, len(root_mm)) * t**1.3).astype(np.float32)
    apart = ways[..., which]
    apart -= ways
    apart += (root_mm[which] - root_mm).T.astype(np.float32)
    apart *= drawn[:, None]
    ways += apart


def _waves(size: Floats, t: Doubles, rng: np.random.Generator) -> Iterator[tuple[Doubles, Floats]]:
    """Smooth ways whose sum is 0 at roots: how much (k, 1) of each of some (3, n); size : (n,)."""
    fade = np.minimum(2 * t, 1.0)
    for waves in (0.5, 1.1):
        phase, much = rng.uniform(0, 2 * np.pi, (3, len(size))), rng.uniform(-1, 1, (3, len(size)))
        much *= size / waves
        yield fade * np.sin(2 * np.pi * waves * t), (much * np.cos(phase)).astype(np.float32)
        yield fade * (np.cos(2 * np.pi * waves * t) - 1.0), (much * np.sin(phase)).astype(np.float32)


def _coils(tips: Floats, t: Doubles, rough: Roughness, rng: np.random.Generator) -> Floats:
    """(k, 3, n) turns around the ways to tips (3, n), from the root on."""
    n = tips.shape[-1]
    along = tips / np.maximum(np.sqrt(dots(tips, tips)), _LEAST)
    side = rng.normal(size=tips.shape).astype(np.float32)
    side -= dots(side, along) * along
    side /= np.maximum(np.sqrt(dots(side, side)), _LEAST)
    turns = 2 * np.pi * (rough.coils * rng.uniform(0.8, 1.2, n) * t + rng.random(n))
    radius = rough.coil_mm * rng.uniform(0.6, 1.2, n) * np.minimum(4 * t, 1.0)
    x, y = ((radius * one)[:, None].astype(np.float32) for one in (np.cos(turns), np.sin(turns)))
    return np.asarray(x * side + y * _crosses(along, side))


def _over_skin(ways: Floats, normal: Floats, t: Floats) -> Floats:
    """Lifted where a knot would be in the skin, taken as round as a head."""
    height = dots(ways, normal)
    flat2 = dots(ways, ways) - height**2
    least = _LEAST_OVER_MM * np.minimum(3 * t, 1.0) - flat2 / (2 * _HEAD_MM)
    ways += np.maximum(least - height, 0.0)[:, None] * normal
    return ways
