"""Triangles of half a bust, and which of their edges can be changed at the same time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Surface:
    """Points (n, 3) [mm] and triangles (m, 3), counter-clockwise outside."""

    points: Doubles
    triangles: Index

    @property
    def on_border(self) -> Flags:
        """(n,) whether a point lies in the plane of symmetry."""
        return np.asarray(self.points[:, 0] == 0)


def face_normals(p: Doubles, t: Index) -> Doubles:
    """Unit normals (m, 3) of triangles."""
    normals = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def apart(rank: Index, ends: Index, triangles: Index, count: int) -> Flags:
    """Many ranked edges that are safe to change at once: those that come first, and again among the rest."""
    chosen, waiting = np.zeros(len(ends), dtype=bool), np.arange(len(ends))
    for _ in range(3):
        won = waiting[wins(rank[waiting], ends[waiting], triangles, count)]
        chosen[won] = True
        touched, around = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        touched[ends[won]] = True
        around[triangles[touched[triangles].any(axis=1)]] = True
        waiting = waiting[~around[ends[waiting]].any(axis=1)]
    return chosen


def wins(rank: Index, ends: Index, triangles: Index, count: int) -> Flags:
    """Which ranked edges come first among all within one triangle of their ends: safe to change at once."""
    at_point = np.full(count, np.iinfo(np.int64).max)
    np.minimum.at(at_point, ends.ravel(), np.repeat(rank, 2))
    at_triangle = at_point[triangles].min(axis=1)
    around = at_point.copy()
    np.minimum.at(around, triangles.ravel(), np.repeat(at_triangle, 3))
    return np.asarray((around[ends[:, 0]] == rank) & (around[ends[:, 1]] == rank))
