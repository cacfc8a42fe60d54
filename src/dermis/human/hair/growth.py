"""Hairs between guides: a few hundred of these follow the skin, and tens of thousands of hairs go along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.human.hair.combing import Combed, along_skin, turned
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
    n, t = len(root_mm), np.linspace(0.0, 1.0, ways.shape[1])
    found = _astray(_between(root_mm, guide_mm, ways), normal, rough, rng)
    found *= np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.2)[:, None, None]
    found = _tufted(root_mm, found, t, rough.tufts, rng)
    size = rough.frizz * np.linalg.norm(found[:, -1], axis=1)
    found = found + size[:, None, None] * _waves(n, t, rng)
    if rough.coil_mm:
        found = found + _coils(found[:, -1], t, rough, rng)
    return _over_skin(found, normal, t)


def _between(root_mm: Doubles, guide_mm: Doubles, ways: Doubles) -> Doubles:
    """Means of the nearest guides' ways."""
    from scipy.spatial import cKDTree

    far, near = cKDTree(guide_mm).query(root_mm, k=_BESIDE)
    share = 1.0 / (np.asarray(far) ** 2 + 4.0)
    share /= share.sum(axis=1, keepdims=True)
    found = np.zeros((len(root_mm), *ways.shape[1:]))
    for beside, which in zip(share.T, np.asarray(near).T, strict=True):
        found += beside[:, None, None] * ways[which]
    return found


def _astray(ways: Doubles, normal: Doubles, rough: Roughness, rng: np.random.Generator) -> Doubles:
    """Turned about the skin's normal, each as a whole, and leaning more or less."""
    n, k, _ = ways.shape
    angle = np.repeat(rough.astray * rng.standard_t(4, size=n), k)
    lean = np.repeat(1.0 + rough.astray * rng.normal(size=n), k)[:, None]
    around, flat = np.repeat(normal, k, axis=0), ways.reshape(-1, 3)
    up = (flat * around).sum(axis=1, keepdims=True) * around
    return np.asarray((lean * up + turned(flat - up, around, angle)).reshape(n, k, 3))


def _tufted(root_mm: Doubles, ways: Doubles, t: Doubles, much: float, rng: np.random.Generator) -> Doubles:
    """Tips drawn to those of a few."""
    from scipy.spatial import cKDTree

    _, first = np.unique(np.floor(root_mm / _TUFT_MM).astype(np.int64), axis=0, return_index=True)
    _, near = cKDTree(root_mm[first]).query(root_mm)
    apart = (root_mm + ways.transpose(1, 0, 2)).transpose(1, 0, 2)
    drawn = much * rng.uniform(0.3, 1.0, len(root_mm))[:, None, None] * (t**1.3)[None, :, None]
    return np.asarray(ways + drawn * (apart[first[near]] - apart))


def _waves(n: int, t: Doubles, rng: np.random.Generator) -> Doubles:
    """(n, k, 3) smooth, 0 at roots."""
    found = np.zeros((n, len(t), 3))
    for waves in (0.5, 1.1):
        phase, size = rng.uniform(0, 2 * np.pi, (n, 1, 3)), rng.uniform(-1, 1, (n, 1, 3))
        found += size * np.sin(2 * np.pi * waves * t[None, :, None] + phase) / waves
    return np.asarray((found - found[:, :1]) * np.minimum(2 * t, 1.0)[None, :, None])


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
    height = (ways * normal[:, None]).sum(axis=2)
    flat = np.linalg.norm(ways - height[..., None] * normal[:, None], axis=2)
    least = _LEAST_OVER_MM * np.minimum(3 * t, 1.0) - flat**2 / (2 * _HEAD_MM)
    return np.asarray(ways + np.maximum(least - height, 0.0)[..., None] * normal[:, None])
