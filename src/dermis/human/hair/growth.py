"""Hairs between guides: these follow the skin from corners of quads, and tens of thousands go along."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.human.hair.combing import Combed, along_skin
from dermis.human.hair.grown import Ground, Rooted
from dermis.human.hair.hairy_skin import told
from dermis.human.hair.skin import Skin
from dermis.mesh.geometry import compacted, crosses, dots
from dermis.mesh.strands import Roots, corners, weights

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


def grown(
    ground: Ground,
    roots: Roots,
    comb: Callable[[Doubles, Doubles], Combed],
    knots: int,
    rough: Roughness,
    rng: np.random.Generator,
) -> tuple[Rooted, Floats]:
    """Hairs on the head, and (k, 3, n) ways from their roots to their knots [mm].

    roots : on quads of the plain mesh, at whose corners the guides of their hairs grow
    comb : how guides lie, by their places on the average person and the skin's normals, both (g, 3)

    Hairs come last in all arrays here, so that what is done to one is done to all at once. What must be the
    same on all machines is so: sines are taken of doubles, and floats are only added and multiplied.
    """
    hair, around = ground.rooted(roots), corners(ground.plain, roots.quad)
    point, near = compacted(around)
    root_mm = ground.points_mm[point]
    foot, normals = ground.skin.foot(root_mm)
    ways = _guides(ground.skin, root_mm, foot, normals, comb(told()[point, :3], normals), knots)
    t, normal = np.linspace(0.0, 1.0, knots)[:, None], hair.along[2]
    found = _astray(_between(weights(roots.place), near, ways), normal, rough, rng)
    _draw_together(found, hair.places, t, rough.tufts, rng)
    tips = found[-1]
    size = np.asarray(rough.frizz * np.sqrt(dots(tips, tips)), np.float32)
    for fade, part in _waves(size, t, rng):
        found += fade[..., None].astype(np.float32) * part
    if rough.coil_mm:
        found += _coils(found[-1], t, rough, rng)
    return hair, _over_skin(found, normal, t.astype(np.float32))


def _guides(
    skin: Skin, root_mm: Doubles, foot: Doubles, normal: Doubles, combed: Combed, knots: int
) -> Doubles:
    """(g, k, 3) ways from roots to knots, over the skin [mm].

    root_mm, foot, normal : (g, 3) with what `Skin.foot` says of them
    """
    off = root_mm - foot  # as far as the skin of few vertices is from the surface
    way, height, step = combed.way, np.zeros(len(root_mm)), combed.length_mm / (knots - 1)
    found = [np.zeros_like(root_mm)]
    for k in range(1, knots):
        rise = combed.rise + (combed.last_rise - combed.rise) * (k - 0.5) / (knots - 1)
        height = np.maximum(height + step * np.sin(rise), _LEAST_OVER_MM)
        way = along_skin(way, normal)
        foot, normal = skin.foot(foot + (step * np.cos(rise))[:, None] * way)
        found.append(foot + off + height[:, None] * normal - root_mm)
    return np.stack(found, axis=1)


def _between(share: Doubles, near: NDArray[np.int64], ways: Doubles) -> Floats:
    """(k, 3, n) means of guides' ways.

    share, near : (n, 4) of which guides
    """
    from scipy.sparse import csr_array

    first = np.arange(0, share.size + 1, share.shape[1])
    shares = csr_array((share.ravel().astype(np.float32), near.ravel(), first), (len(share), len(ways)))
    found = shares @ ways.reshape(len(ways), -1).astype(np.float32)
    return np.ascontiguousarray(found.T).reshape(*ways.shape[1:], len(share))


def _astray(ways: Floats, normal: Floats, rough: Roughness, rng: np.random.Generator) -> Floats:
    """Turned about the skin's normal, each as a whole, leaning more or less, and longer or shorter."""
    n = ways.shape[-1]
    angle, lean = rough.astray * rng.standard_t(4, size=n), 1.0 + rough.astray * rng.normal(size=n)
    length = np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.2)
    stay, turn = length * np.cos(angle), length * np.sin(angle)
    stay, turn, rise = (one.astype(np.float32) for one in (stay, turn, length * lean - stay))
    found: Floats = turn * crosses(normal, ways)
    found += (rise * dots(ways, normal))[:, None] * normal
    found += stay * ways
    return found


def _draw_together(ways: Floats, root_mm: Doubles, t: Doubles, much: float, rng: np.random.Generator) -> None:
    """Draw tips to those of a few, in tufts."""
    places = np.ascontiguousarray(root_mm.T)
    cell = np.zeros(len(root_mm), np.int64)
    for at in np.floor(places / _TUFT_MM).astype(np.int64):
        at -= at.min()
        cell *= at.max() + 1
        cell += at
    hair = np.empty(cell.max() + 1, np.int64)
    hair[cell] = np.arange(len(cell))  # one of those in each
    which = hair[cell]
    drawn = (much * rng.uniform(0.3, 1.0, len(root_mm)) * t**1.3).astype(np.float32)
    apart = ways.take(which, axis=-1)
    apart -= ways
    apart += (places.take(which, axis=-1) - places).astype(np.float32)
    apart *= drawn[:, None]
    ways += apart


def _waves(size: Floats, t: Doubles, rng: np.random.Generator) -> Iterator[tuple[Doubles, Floats]]:
    """Smooth ways whose sum is 0 at roots: how much (k, 1) of each of some (3, n); size : (n,)."""
    fade = np.minimum(2 * t, 1.0)
    for waves in (0.5, 1.1):
        for shape in (np.sin(2 * np.pi * waves * t), np.cos(2 * np.pi * waves * t) - 1.0):
            much = rng.random((3, len(size)), np.float32) - np.float32(0.5)
            yield np.sqrt(2.0) / waves * fade * shape, much * size


def _coils(tips: Floats, t: Doubles, rough: Roughness, rng: np.random.Generator) -> Floats:
    """(k, 3, n) turns around the ways to tips (3, n), from the root on."""
    n = tips.shape[-1]
    along = np.asarray(tips / np.maximum(np.sqrt(dots(tips, tips)), _LEAST), np.float32)
    side: Floats = rng.normal(size=tips.shape).astype(np.float32)
    side -= dots(side, along) * along
    side /= np.maximum(np.sqrt(dots(side, side)), _LEAST)
    step = 2 * np.pi * t[1] * rough.coils * rng.uniform(0.8, 1.2, n)
    turn = np.asarray(2 * np.pi * rng.random(n))
    radius = rough.coil_mm * rng.uniform(0.6, 1.2, n) * np.minimum(4 * t, 1.0)
    x, y = ((radius * one)[:, None].astype(np.float32) for one in _turned(turn, step, len(t)))
    return np.asarray(x * side + y * crosses(along, side))


def _turned(turn: Doubles, step: Doubles, knots: int) -> tuple[Doubles, Doubles]:
    """Cosines and sines (k, n) of angles (n,) that grow by equal steps, of which only the first are taken."""
    x, y = np.empty((knots, len(turn))), np.empty((knots, len(turn)))
    x[0], y[0], more, across = np.cos(turn), np.sin(turn), np.cos(step), np.sin(step)
    for k in range(1, knots):
        x[k] = x[k - 1] * more - y[k - 1] * across
        y[k] = y[k - 1] * more + x[k - 1] * across
    return x, y


def _over_skin(ways: Floats, normal: Floats, t: Floats) -> Floats:
    """Lifted where a knot would be in the skin, taken as round as a head."""
    height = dots(ways, normal)
    flat2 = dots(ways, ways) - height**2
    least = _LEAST_OVER_MM * np.minimum(3 * t, 1.0) - flat2 / (2 * _HEAD_MM)
    ways += np.maximum(least - height, 0.0)[:, None] * normal
    return ways
