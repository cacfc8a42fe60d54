"""Hairs between guides: a few hundred of these follow the skin, and tens of thousands of hairs go along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.human.hair.combing import Combed, along_skin
from dermis.human.hair.rooting import Index
from dermis.human.hair.skin import Skin
from dermis.mesh.mesh import Floats
from dermis.mesh.strands import Doubles

_BESIDE = 4  # guides that a hair goes along with
_TUFT_MM = 2.2  # between tufts
_RAGGED = 0.3  # of that, by which tufts mix with those beside them
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
) -> Floats:
    """(n, k, 3) ways from the roots of hairs to their knots [mm].

    root_mm, normal : (n, 3) of the hairs
    guide_mm, ways : (g, 3) and (g, k, 3) of the guides
    """
    t = np.linspace(0.0, 1.0, ways.shape[1], dtype=np.float32)
    up = normal.astype(np.float32)
    first, tuft = _tufts(root_mm, rng)
    found = _astray(_between(root_mm[first], guide_mm, ways)[tuft], up, rough, rng)
    _draw_together(found, root_mm.astype(np.float32), first[tuft], (rough.tufts, t), rng)
    size = rough.frizz * np.linalg.norm(found[:, -1], axis=1)
    found += _waves(size, t, rng)
    if rough.coil_mm:
        found += _coils(found[:, -1], t, rough, rng)
    return _over_skin(found, up, t)


def _tufts(root_mm: Doubles, rng: np.random.Generator) -> tuple[Index, Index]:
    """A hair of each tuft (m,), and the tuft of each hair (n,): hairs of a tuft have their way in common.

    They are cells of a grid, whose borders nobody sees, as hairs beside them are of one or the other.
    """
    cell = np.floor(root_mm / _TUFT_MM + rng.normal(0.0, _RAGGED, root_mm.shape)).astype(np.int64)
    cell -= cell.min(axis=0)
    wide, high, deep = (cell.max(axis=0) + 1).tolist()
    number = np.ravel_multi_index(cell.T, (wide, high, deep))
    _, first, tuft = np.unique(number, return_index=True, return_inverse=True)
    return first, tuft


def _between(root_mm: Doubles, guide_mm: Doubles, ways: Doubles) -> Floats:
    """Means of the nearest guides' ways."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    n, g = len(root_mm), len(guide_mm)
    far, near = cKDTree(guide_mm).query(root_mm, k=_BESIDE)
    share = 1.0 / (np.asarray(far) ** 2 + 4.0)
    share /= share.sum(axis=1, keepdims=True)
    first = np.arange(0, _BESIDE * n + 1, _BESIDE)
    shares = csr_array((share.ravel(), np.asarray(near).ravel(), first), shape=(n, g))
    found = np.asarray(shares @ ways.reshape(g, -1))
    return found.reshape(n, *ways.shape[1:]).astype(np.float32)


def _astray(ways: Floats, normal: Floats, rough: Roughness, rng: np.random.Generator) -> Floats:
    """Turned about the skin's normal, each as a whole, leaning more or less, and longer or shorter."""
    n = len(ways)
    angle, lean = rough.astray * rng.standard_t(4, size=n), 1.0 + rough.astray * rng.normal(size=n)
    length = np.clip(1.0 + rough.uneven * rng.normal(size=n), 0.35, 1.2)
    cos, sin = np.cos(angle), np.sin(angle)
    along, cos, sin = ((length * one).astype(np.float32) for one in (lean - cos, cos, sin))
    turn = normal[:, :, None] * (along[:, None] * normal)[:, None, :]
    turn += cos[:, None, None] * np.eye(3, dtype=np.float32)
    x, y, z = sin * normal.T
    for i, j, part in ((1, 0, -z), (2, 0, y), (2, 1, -x)):  # transposed: ways are rows
        turn[:, i, j] += part
        turn[:, j, i] -= part
    return ways @ turn


def _draw_together(
    ways: Floats, root_mm: Floats, which: Index, much: tuple[float, Floats], rng: np.random.Generator
) -> None:
    """Draw tips to those of others.

    which : (n,) of each hair, the hair that it is drawn to
    much : how much, and places along a hair (k,)
    """
    share = (much[0] * rng.uniform(0.3, 1.0, len(ways))).astype(np.float32)[:, None] * much[1] ** 1.3
    apart = ways[which] - ways
    apart += (root_mm[which] - root_mm)[:, None]
    apart *= share[:, :, None]
    ways += apart


def _waves(size: Floats, t: Floats, rng: np.random.Generator) -> Floats:
    """(n, k, 3) smooth, 0 at roots; size : (n,)."""
    n, fade, parts, basis = len(size), np.minimum(2 * t, 1.0), list[Doubles](), list[Doubles]()
    for waves in (0.5, 1.1):
        phase, much = rng.uniform(0, 2 * np.pi, (n, 3)), rng.uniform(-1, 1, (n, 3))
        phase, much = phase.astype(np.float32), (much * size[:, None] / waves).astype(np.float32)
        parts += [much * np.cos(phase), much * np.sin(phase)]  # of a sum of angles
        basis += [fade * np.sin(2 * np.pi * waves * t), fade * (np.cos(2 * np.pi * waves * t) - 1.0)]
    return np.asarray(np.stack(basis, axis=-1) @ np.stack(parts, axis=1), np.float32)


def _coils(tips: Floats, t: Floats, rough: Roughness, rng: np.random.Generator) -> Floats:
    """(n, k, 3) turns around the ways to tips (n, 3), from the root on."""
    n = len(tips)
    along = tips / np.maximum(np.linalg.norm(tips, axis=1, keepdims=True), 1e-9)
    side = along_skin(rng.normal(size=tips.shape), along).astype(np.float32)
    turns = rough.coils * rng.uniform(0.8, 1.2, (n, 1)) * t + rng.random((n, 1))
    turns = (2 * np.pi * turns).astype(np.float32)
    radius = (rough.coil_mm * rng.uniform(0.6, 1.2, (n, 1))).astype(np.float32) * np.minimum(4 * t, 1.0)
    x, y = radius * np.cos(turns), radius * np.sin(turns)
    return np.asarray(x[..., None] * side[:, None] + y[..., None] * np.cross(along, side)[:, None])


def _over_skin(ways: Floats, normal: Floats, t: Floats) -> Floats:
    """Lifted where a knot would be in the skin, taken as round as a head."""
    height = (ways @ normal[:, :, None])[..., 0]
    flat2 = np.einsum("nkc,nkc->nk", ways, ways) - height**2
    least = _LEAST_OVER_MM * np.minimum(3 * t, 1.0) - flat2 / (2 * _HEAD_MM)
    ways += np.maximum(least - height, 0.0)[..., None] * normal[:, None]
    return ways
