"""Thin parts once more in numpy float64: rays through the flesh, and what comes through."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.special import ndtr, ndtri

from dermis.assets.atlas import Atlas
from dermis.assets.mesh import Mesh
from dermis.assets.smooth_normals import smooth_normals

Floats = NDArray[np.float64]
RAYS, FEW, LEAST_FACING, SLACK, ASTRAY = 64, 8, 0.7, 1e-5, 1.5
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def beside(n: Floats) -> Floats:
    """(..., 2, 3) unit vectors at right angles to n and to each other [Duff2017]."""
    s = np.where(n[..., 2] >= 0, 1.0, -1.0)
    a = -1.0 / (s + n[..., 2])
    b = n[..., 0] * n[..., 1] * a
    first = np.stack([1 + s * n[..., 0] ** 2 * a, s * b, -s * n[..., 0]], axis=-1)
    second = np.stack([b, s + n[..., 1] ** 2 * a, -n[..., 1]], axis=-1)
    return np.stack([first, second], axis=-2)


Exit = tuple[Floats, NDArray[np.int64], Floats]


def spread_to(sigma: float, axes: Floats, index: int, share: float) -> Floats:
    """(n, 3) one of many places around points that are spread like a Gaussian."""
    far = sigma * np.sqrt(-2 * np.log(1 - share))
    return np.asarray(far * (np.cos(GOLDEN * index) * axes[:, 0] + np.sin(GOLDEN * index) * axes[:, 1]))


def first_hit(mesh: Mesh, limit: float, entering: bool = False) -> Callable[[Floats, Floats], Exit]:
    """Finds distance (inf without one), triangle and weights (n, 3) of where rays leave, or also enter."""
    corners = mesh.positions[mesh.triangles].astype(float)
    a, e1, e2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]

    def find(origin: Floats, way: Floats) -> Exit:
        best, owner = np.full(len(origin), np.inf), np.zeros(len(origin), np.int64)
        weights = np.zeros((len(origin), 3))
        for k in range(len(a)):
            p = np.cross(way, e2[k])
            leaves = (p @ e1[k] < 0) | (entering & (p @ e1[k] != 0))
            det = np.where(leaves, p @ e1[k], 1.0)
            s = origin - a[k]
            u = (s * p).sum(-1) / det
            q = np.cross(s, e1[k])
            v, t = (way * q).sum(-1) / det, q @ e2[k] / det
            better = (
                leaves
                & (np.minimum(u, v) >= -SLACK)
                & (u + v <= 1 + SLACK)
                & (t >= 0)
                & (t < np.minimum(best, limit))
            )
            best[better], owner[better] = t[better], k
            weights[better] = np.stack([1 - u - v, u, v], axis=-1)[better]
        return best, owner, weights

    return find


def is_beyond(
    mesh: Mesh, meets: Callable[[Floats, Floats], Exit], above: Floats, down: Floats, limit: float
) -> Floats:
    """(n,) 1 where there is no flesh under places, down to the limit."""
    t, triangle, _ = meets(above, down)
    corners = mesh.positions[mesh.triangles[triangle]].astype(float)
    enters = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * down).sum(-1) < 0
    return np.asarray(~np.isfinite(t) | (enters & (t > limit)), float)


def opposite(mesh: Mesh, atlas: Atlas, points: Floats, normals: Floats, widest: float) -> Floats:
    """(n, 5) of places of the surface: place opposite (u, v), thickness, distances to the rim here and there.

    Infinite where it is thick; widest : standard deviation of the widest Gaussian [mm]
    """
    exits, sigma = first_hit(mesh, 4.0 * widest), 0.7 * widest

    smooth = smooth_normals(mesh, 1.0)

    def unit(x: Floats) -> Floats:
        return np.asarray(x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-30))

    def normal_at(triangle: NDArray[np.int64], w: Floats) -> Floats:
        return unit(np.einsum("nk,nkc->nc", w, smooth[mesh.triangles[triangle]]))

    share, depth, few = np.zeros(len(points)), np.zeros(len(points)), np.zeros(len(points))
    to, towards = np.zeros((2, len(points), 3))
    most, best = np.zeros(len(points)), np.zeros((len(points), 2))
    axes, beyond = beside(normals), np.zeros(len(points))
    meets = first_hit(mesh, 16.0 * widest, entering=True)
    for i in range(RAYS):
        reversed_ = int(f"{i:06b}"[::-1], 2) / 64
        aside = spread_to(sigma, axes, i, reversed_ + 0.5 / RAYS)
        t, triangle, w = exits(points + aside + 0.1 * sigma * normals, -normals)
        missed = ~np.isfinite(t)
        beyond[missed] += (
            is_beyond(mesh, meets, (points + aside + sigma * normals)[missed], -normals[missed], 4.0 * widest)
            / RAYS
        )
        normal = normal_at(triangle, w)
        facing = -(normals * normal).sum(-1)
        good = np.isfinite(t) & (facing > 0)
        t = np.where(good, t - 0.1 * sigma, 0.0)
        weight = good * np.exp(-0.5 * (t / sigma) ** 2) / np.maximum(facing, LEAST_FACING)
        share, depth = share + weight, depth + weight * t
        to = to + weight[:, None] * (aside - t[:, None] * normals)
        towards = towards + weight[:, None] * normal
        few = share.copy() if i < FEW else few
        places = np.einsum("nk,nkc->nc", w, atlas.place[triangle].astype(float))
        best = np.where((weight > most)[:, None], places, best)
        most = np.maximum(weight, most)
    some = few > 0
    sum_ = np.maximum(share, 1e-30)
    beneath = unit(towards)
    t, triangle, w = exits(points, unit(to))
    good = t < ASTRAY * np.linalg.norm(to, axis=-1) / sum_
    facing = np.maximum(-(normals * beneath).sum(-1), 0)
    x = -sigma * ndtri(np.clip(beyond, 1e-12, 0.5))
    passed = np.clip(share / RAYS / np.maximum(1 - beyond, 1e-9), 1e-300, 1)
    thickness = sigma * np.sqrt(-2 * np.log(passed))
    thickness = np.maximum(thickness, facing * depth / sum_)
    middle = np.einsum("nk,nkc->nc", w, atlas.place[triangle].astype(float))
    place = np.where(good[:, None], middle, best)
    found = np.column_stack([place, thickness, x, facing * x])
    return np.where(some[:, None], found, np.inf)


def transmitted(levels: Floats, found: Floats, variance: Floats, weight: Floats) -> Floats:
    """(n, n, 3) of levels (k, n, n, 3) and (n, n, 5) of what `opposite` finds."""
    size = levels.shape[1]
    place = np.where(np.isfinite(found[..., :2]), found[..., :2], 0.0)
    at = [place[..., 1] * size - 0.5, place[..., 0] * size - 0.5]
    total = np.zeros(levels.shape[1:])
    for level, v, w in zip(levels, variance, weight, strict=True):
        there = np.stack(
            [map_coordinates(level[..., c], at, order=1, mode="nearest") for c in range(3)], axis=-1
        )
        d, near, far = np.moveaxis(found[..., 2:], -1, 0) / np.sqrt(v)
        over = ndtr(-near)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = (np.exp(-0.5 * d**2) * ndtr(far) - over) / np.maximum(1 - 2 * over, 1e-4)
        share = np.where(d < 4, np.clip(share, 0, 1), 0.0)
        total += w * share[..., None] * np.maximum(0, (1 - over)[..., None] * there - over[..., None] * level)
    return total
