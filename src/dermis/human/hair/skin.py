"""The skin that hairs grow on: places on its quads, and heights over it."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Doubles, Roots, corners

Index = NDArray[np.int64]
_NEAR = 6  # vertices that a place's tangent plane is the mean of


class Skin:
    """A surface, by its vertices with their normals.

    mesh : as it is drawn
    """

    def __init__(self, mesh: Mesh) -> None:
        self._places, self._normals = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)

    def foot(self, places_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Where places (n, 3) are on the skin when put there along its normal, and that normal [mm]."""
        distance, near = self._tree.query(places_mm, k=_NEAR)
        share = 1.0 / (distance**2 + 0.05)
        share /= share.sum(axis=1, keepdims=True)
        normal = np.einsum("nk,nkc->nc", share, self._normals[near])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        over = ((places_mm[:, None] - self._places[near]) * self._normals[near]).sum(axis=2)
        return places_mm - (share * over).sum(axis=1)[:, None] * normal, normal

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._places)


def front_places(mesh: Mesh, points_mm: Doubles, x: Doubles, y: Doubles) -> tuple[Roots, NDArray[np.bool_]]:
    """Roots on what faces the viewer at places of the front plane (n,), and which of them there are.

    mesh : of quads, control points at points_mm (p, 3)
    """
    around = corners(mesh, np.arange(len(mesh.quads)))
    flat = points_mm[around][..., :2]
    low, high = flat.min(axis=1), flat.max(axis=1)
    box = (x.min(), y.min()), (x.max(), y.max())
    near = np.flatnonzero(((high >= box[0]) & (low <= box[1])).all(axis=1))
    quad, place = np.zeros(len(x), np.int32), np.zeros((len(x), 2), np.float32)
    best = np.full(len(x), -np.inf)
    ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    for index in near:
        for half in ([0, 1, 2], [2, 3, 0]):
            a, b, c = points_mm[around[index, half]]
            det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            if det <= 1e-9:  # seen from behind
                continue
            v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / det
            w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / det
            share = np.stack([1 - v - w, v, w], axis=-1)
            z = share @ np.array([a[2], b[2], c[2]])
            won = (share >= -1e-9).all(axis=1) & (z > best)
            best[won], quad[won] = z[won], index
            place[won] = np.clip(share[won] @ ends[half], 0.0, 1.0)
    return Roots(quad, place), np.isfinite(best)


def beside_edges(
    mesh: Mesh, points_mm: Doubles, loop: Index, u: Doubles, across: Doubles, away_mm: Doubles
) -> Roots:
    """Roots along a row of edges, on the quads beside it that are farther from a place.

    loop : (m,) control points in a row
    u : (n,) how far along it, from 0 to 1 by length
    across : (n,) how far from the edge into the quad, 0 to 1
    away_mm : (3,)
    """
    around = corners(mesh, np.arange(len(mesh.quads)))
    run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points_mm[loop], axis=0), axis=1))])
    at = np.clip(np.searchsorted(run, u * run[-1], "right") - 1, 0, len(loop) - 2)
    part = (u * run[-1] - run[at]) / (run[at + 1] - run[at])
    ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    quads, frames = [], []
    for a, b in pairwise(loop.tolist()):
        both = np.flatnonzero((around == a).any(axis=1) & (around == b).any(axis=1))
        quad = max(both, key=lambda q: np.linalg.norm(points_mm[around[q]].mean(axis=0) - away_mm))
        i, j = (int(np.flatnonzero(around[quad] == p)[0]) for p in (a, b))
        quads.append(quad)
        frames.append(ends[[i, j, (2 * i - j) % 4, (2 * j - i) % 4]])  # beside a, beside b
    quad, frame = np.array(quads)[at], np.array(frames)[at]
    low = (1 - part)[:, None] * frame[:, 0] + part[:, None] * frame[:, 1]
    high = (1 - part)[:, None] * frame[:, 2] + part[:, None] * frame[:, 3]
    place = (1 - across)[:, None] * low + across[:, None] * high
    return Roots(quad.astype(np.int32), place.astype(np.float32))


def mirrored(points_mm: Doubles, index: Index) -> Index:
    """Points opposite to some of a symmetric head."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points_mm).query(points_mm[index] * [-1, 1, 1])[1], np.int64)
