"""Hairs between guides: a few hundred of these follow the skin, and tens of thousands of hairs go along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.human.hair.combing import Combed, along_skin
from dermis.human.hair.skin import Skin
from dermis.mesh.strands import Doubles

_BESIDE = 4  # guides that a hair goes along with
_TUFT_MM = 2.2  # between tufts
_LEAST_OVER_MM = 0.35  # the skin
_HEAD_MM = 85.0  # radius


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
    root_mm: Doubles,
    normal: Doubles,
    guide_mm: Doubles,
    ways: Doubles,
    rough: Roughness,
    rng: np.random.Generator,
) -> Doubles:
    """(n, k, 3) ways from the roots of hairs to their knots [mm].

    root_mm, normal : (n, 3) of the hairs
    guide_mm, ways : (g, 3) and (g, k, 3) of the guides
    """
    t = np.linspace(0.0, 1.0, ways.shape[1])
    found = _astray(_between(root_mm, guide_mm, ways), normal, rough, rng)
    found = _tufted(root_mm, found, t, rough.tufts, rng)
    size = rough.frizz * np.linalg.norm(found[:, -1], axis=1)
    found += _waves(size, t, rng)
    if rough.coil_mm:
        found += _coils(found[:, -1], t, rough, rng)
    return _over_skin(found, normal, t)


def _between(root_mm: Doubles, guide_mm: Doubles, ways: Doubles) -> Doubles:
    """Means of the nearest guides' ways."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    n, g = len(root_mm), len(guide_mm)
    far, near = cKDTree(guide_mm).query(root_mm, k=_BESIDE)
    share = 1.0 / (np.asarray(far) ** 2 + 4.0)
    share /= share.sum(axis=1, keepdims=True)
    first = np.arange(0, _BESIDE * n + 1, _BESIDE)
    shares = csr_array((share.ravel(), np.asarray(near).ravel(), first), shape=(n, g))
    return np.asarray(shares @ ways.reshape(g, -1)).reshape(n, *ways.shape[1:])


def _astray(ways: Doubles, normal: Doubles, rough: Roughness, rng: np.random.Generator) -> Doubles:
    """Turned about the skin's normal, each as a whole, leaning more or less, and longer or shorter."""
    n = len(ways)
    angle, lean = rough.astray * rng.standard_t(4, size=n), 1.0 + rough.astray * rng.normal(size=n)
    length = np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.2)[:, None, None]
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = normal.T
    along = normal[:, :, None] * ((lean - cos)[:, None] * normal)[:, None, :]
    across = np.zeros((n, 3, 3))
    for i, j, part in ((0, 1, -z), (0, 2, y), (1, 2, -x)):
        across[:, i, j], across[:, j, i] = sin * part, -sin * part
    turn = length * (along + across + cos[:, None, None] * np.eye(3))
    return np.asarray(ways @ turn.transpose(0, 2, 1))


def _tufted(root_mm: Doubles, ways: Doubles, t: Doubles, much: float, rng: np.random.Generator) -> Doubles:
    """Tips drawn to those of a few."""
    from scipy.spatial import cKDTree

    cell = np.floor(root_mm / _TUFT_MM).astype(np.int64)
    cell -= cell.min(axis=0)
    wide, high, deep = (cell.max(axis=0) + 1).tolist()
    _, first = np.unique(np.ravel_multi_index(cell.T, (wide, high, deep)), return_index=True)
    _, near = cKDTree(root_mm[first]).query(root_mm)
    which = first[near]
    drawn = (much * rng.uniform(0.3, 1.0, len(root_mm)))[:, None] * t**1.3
    apart = ways[which] - ways + (root_mm[which] - root_mm)[:, None]
    apart *= drawn[:, :, None]
    apart += ways
    return np.asarray(apart)


def _waves(size: Doubles, t: Doubles, rng: np.random.Generator) -> Doubles:
    """(n, k, 3) smooth, 0 at roots; size : (n,)."""
    n, fade, parts, basis = len(size), np.minimum(2 * t, 1.0), list[Doubles](), list[Doubles]()
    for waves in (0.5, 1.1):
        phase, much = rng.uniform(0, 2 * np.pi, (n, 3)), rng.uniform(-1, 1, (n, 3))
        much *= size[:, None] / waves
        parts += [much * np.cos(phase), much * np.sin(phase)]  # of a sum of angles
        basis += [fade * np.sin(2 * np.pi * waves * t), fade * (np.cos(2 * np.pi * waves * t) - 1.0)]
    return np.asarray(np.stack(basis, axis=-1) @ np.stack(parts, axis=1))


def _coils(tips: Doubles, t: Doubles, rough: Roughness, rng: np.random.Generator) -> Doubles:
    """(n, k, 3) turns around the ways to tips (n, 3), from the root on."""
    n = len(tips)
    along = tips / np.maximum(np.linalg.norm(tips, axis=1, keepdims=True), 1e-9)
    side = along_skin(rng.normal(size=tips.shape), along)
    turns = rough.coils * rng.uniform(0.8, 1.2, (n, 1)) * t + rng.random((n, 1))
    radius = rough.coil_mm * rng.uniform(0.6, 1.2, (n, 1)) * np.minimum(4 * t, 1.0)
    x, y = radius * np.cos(2 * np.pi * turns), radius * np.sin(2 * np.pi * turns)
    return np.asarray(x[..., None] * side[:, None] + y[..., None] * np.cross(along, side)[:, None])


def _over_skin(ways: Doubles, normal: Doubles, t: Doubles) -> Doubles:
    """Lifted where a knot would be in the skin, taken as round as a head."""
    height = (ways @ normal[:, :, None])[..., 0]
    flat2 = np.einsum("nkc,nkc->nk", ways, ways) - height**2
    least = _LEAST_OVER_MM * np.minimum(3 * t, 1.0) - flat2 / (2 * _HEAD_MM)
    return np.asarray(ways + np.maximum(least - height, 0.0)[..., None] * normal[:, None])
