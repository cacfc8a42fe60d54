"""Hairs of head and beard between guides: a few hundred that follow the skin, and tens of thousands that go along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.human.hair.combing import Combed, turned
from dermis.human.hair.skin import Skin
from dermis.mesh.strands import Doubles

_BESIDE = 4  # guides that a hair goes along with
_CLUMP_MM = 2.2  # between tufts
_HAIR_MM = 0.034  # radius of a hair


class Roughness(NamedTuple):
    """By how much hairs differ from their guides.

    astray : angle to the side [rad]
    uneven : of lengths, as a share
    tufts : how much tips are drawn together, 0 to 1
    frizz : of waves over the length
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
    """(n, k, 3) ways from roots to knots, over the skin [mm]."""
    foot, normal = skin.foot(root_mm)
    way, height = combed.way, np.zeros(len(root_mm))
    step = combed.length_mm / (knots - 1)
    found = [root_mm]
    for k in range(1, knots):
        t = (k - 0.5) / (knots - 1)
        rise = combed.rise + (combed.last_rise - combed.rise) * t
        height = np.maximum(height + step * np.sin(rise), 0.35)
        way = way - (way * normal).sum(axis=1, keepdims=True) * normal
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        foot, normal = skin.foot(foot + (step * np.cos(rise))[:, None] * way)
        found.append(foot + height[:, None] * normal)
    return np.stack(found, axis=1) - root_mm[:, None]


def grown(
    root_mm: Doubles, normal: Doubles, guide_mm: Doubles, ways: Doubles, rough: Roughness, rng: np.random.Generator
) -> Doubles:
    """(n, k, 3) ways from the roots of hairs to their knots [mm].

    root_mm, normal : (n, 3) of the hairs
    guide_mm, ways : (g, 3) and (g, k, 3) of the guides
    """
    from scipy.spatial import cKDTree

    n, t = len(root_mm), np.linspace(0.0, 1.0, ways.shape[1])
    far, near = cKDTree(guide_mm).query(root_mm, k=_BESIDE)
    share = 1.0 / (far**2 + 4.0)
    share /= share.sum(axis=1, keepdims=True)
    found = np.zeros((n, *ways.shape[1:]))
    for k in range(_BESIDE):
        found += share[:, k, None, None] * ways[near[:, k]]
    found = _astray(found, normal, rough, rng)
    found *= np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.4)[:, None, None]
    knots = root_mm[:, None] + found
    knots = _tufted(knots, t, rough.tufts, rng)
    knots += _waves(n, t, rng) * (rough.frizz * np.linalg.norm(found[:, -1], axis=1))[:, None, None]
    if rough.coil_mm:
        knots += _coils(found, t, rough, rng)
    return knots - root_mm[:, None]


def _astray(ways: Doubles, normal: Doubles, rough: Roughness, rng: np.random.Generator) -> Doubles:
    """Turned about the skin's normal, each as a whole."""
    n, k, _ = ways.shape
    angle = np.repeat(rough.astray * rng.standard_t(4, size=n), k)
    around = np.repeat(normal, k, axis=0)
    flat = ways.reshape(-1, 3)
    up = (flat * around).sum(axis=1, keepdims=True) * around
    lean = np.repeat(1.0 + rough.astray * rng.normal(size=n), k)[:, None]
    return np.asarray((lean * up + turned(flat - up, around, angle)).reshape(n, k, 3))


def _tufted(knots: Doubles, t: Doubles, much: float, rng: np.random.Generator) -> Doubles:
    """Tips drawn to those of a few."""
    from scipy.spatial import cKDTree

    if much == 0.0:
        return knots
    cell = np.floor(knots[:, 0] / _CLUMP_MM).astype(np.int64)
    _, first = np.unique(cell, axis=0, return_index=True)
    first = np.sort(first)
    _, near = cKDTree(knots[first, 0]).query(knots[:, 0])
    drawn = much * rng.uniform(0.3, 1.0, len(knots))[:, None, None] * (t**1.3)[None, :, None]
    return np.asarray(knots + drawn * (knots[first[near]] - knots))


def _waves(n: int, t: Doubles, rng: np.random.Generator) -> Doubles:
    """(n, k, 3) smooth, 0 at roots."""
    found = np.zeros((n, len(t), 3))
    for waves in (0.7, 1.6):
        phase, size = rng.uniform(0, 2 * np.pi, (2, n, 3))
        found += np.sin(2 * np.pi * waves * t[None, :, None] + phase[:, None]) * (size[:, None] / np.pi - 1.0) / waves
    found -= found[:, :1]
    return found * np.minimum(2 * t, 1.0)[None, :, None]


def _coils(ways: Doubles, t: Doubles, rough: Roughness, rng: np.random.Generator) -> Doubles:
    """Turns around the way, tight from the root on."""
    along = ways[:, -1] / np.maximum(np.linalg.norm(ways[:, -1], axis=1, keepdims=True), 1e-9)
    side = np.cross(along, rng.normal(size=along.shape))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    turn = rng.uniform(0.8, 1.2, len(ways))[:, None] * 2 * np.pi * rough.coils * t + rng.uniform(0, 2 * np.pi, len(ways))[:, None]
    radius = rough.coil_mm * rng.uniform(0.6, 1.2, len(ways))[:, None] * np.minimum(4 * t, 1.0)
    circle = (radius * np.cos(turn))[..., None] * side[:, None] + (radius * np.sin(turn))[..., None] * other[:, None]
    return np.asarray(circle)


def radii(n: int, t: Doubles, bundle: float, rng: np.random.Generator) -> Doubles:
    """(n, k) radius of hairs of which each stands for some [mm]."""
    each = bundle * _HAIR_MM * rng.uniform(0.8, 1.2, n)
    return np.asarray(each[:, None] * np.where(t > 0.99, 0.6, 1.0))
