"""Triangles of half a bust, and local changes to them: short edges collapsed, others flipped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles, Field
from dermis.mesh.geometry import edges

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class HalfMesh:
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


def collapse(mesh: HalfMesh, size: Field) -> HalfMesh:
    """Edges shorter than 3/4 of the size collapsed, shortest first, where no triangle folds over."""
    p, t, border = mesh.points, mesh.triangles, mesh.on_border
    ends, _, counts = edges(t)
    length = np.linalg.norm(p[ends[:, 0]] - p[ends[:, 1]], axis=1)
    middle = p[ends].mean(axis=1)
    # an inner edge between two border points would pinch the surface
    able = (length < 0.75 * size(middle)) & ~(border[ends].all(axis=1) & (counts == 2))
    able[able] = _common(ends[able], ends, len(p)) == counts[able]
    ends, length, middle = ends[able], length[able], middle[able]
    # by chance within a factor of two: neighbours of nearly equal length would wait for each other
    bucket = np.round(np.log2(np.maximum(length / size(middle), 1e-3)))
    chance = np.random.default_rng(0).permutation(len(ends))
    rank = np.empty(len(ends), dtype=np.int64)
    rank[np.lexsort((chance, bucket))] = np.arange(len(ends))
    chosen = apart(rank, ends, t, len(p))
    ends, middle = ends[chosen], middle[chosen]
    only = border[ends[:, 0]] != border[ends[:, 1]]
    middle[only] = p[np.where(border[ends[:, 0]], ends[:, 0], ends[:, 1])[only]]
    return _merged(mesh, ends, middle)


def _common(chosen: Index, ends: Index, count: int) -> Index:
    """How many points are neighbours of both ends of each chosen edge."""
    from scipy.sparse import csr_array

    both = np.vstack((ends, ends[:, ::-1]))
    linked = csr_array((np.ones(len(both), dtype=np.int32), (both[:, 0], both[:, 1])), shape=(count, count))
    shared = linked[chosen[:, 0]] * linked[chosen[:, 1]]
    return np.asarray(shared.sum(axis=1), dtype=np.int64).ravel()


def _merged(mesh: HalfMesh, ends: Index, middle: Doubles) -> HalfMesh:
    """The mesh with both `ends` (k, 2) of each edge at `middle`, except where a triangle would flip over."""
    p, t = mesh.points, mesh.triangles
    owner = np.full(len(p), -1, dtype=np.int64)
    owner[ends] = np.arange(len(ends))[:, None]
    target, moved = np.arange(len(p)), p.copy()
    target[ends[:, 1]] = ends[:, 0]
    moved[ends] = middle[:, None]
    gone = _degenerate(target[t])
    turned_over = ~gone & (np.einsum("ni,ni->n", face_normals(p, t), face_normals(moved, t)) < 0.5)
    bad = np.zeros(len(ends) + 1, dtype=bool)
    bad[owner[t[turned_over]].ravel()] = True
    keep = ~bad[:-1]
    target, moved = np.arange(len(p)), p.copy()
    target[ends[keep, 1]] = ends[keep, 0]
    moved[ends[keep, 0]] = middle[keep]
    t = target[t]
    return _compact(moved, t[~_degenerate(t)])


def _degenerate(t: Index) -> Flags:
    return np.asarray((t[:, 0] == t[:, 1]) | (t[:, 1] == t[:, 2]) | (t[:, 2] == t[:, 0]))


def _compact(p: Doubles, t: Index) -> HalfMesh:
    used, number = np.unique(t, return_inverse=True)
    return HalfMesh(p[used], number.reshape(-1, 3))


def flip(mesh: HalfMesh) -> HalfMesh:
    """Edges flipped where the angles across them are too wide (Delaunay)."""
    p, t, border = mesh.points, mesh.triangles, mesh.on_border
    ends, of_side, counts = edges(t)
    side = np.argsort(of_side, kind="stable")
    start = np.cumsum(counts) - counts
    inner = np.flatnonzero(counts == 2)
    sides = np.column_stack((side[start[inner]], side[start[inner] + 1]))
    triangle, which = sides % len(t), sides // len(t)
    a, b = t[triangle, which][:, 0], t[triangle, (which + 1) % 3][:, 0]
    c, d = t[triangle[:, 0], (which[:, 0] + 2) % 3], t[triangle[:, 1], (which[:, 1] + 2) % 3]
    excess = _angle(p, c, a, b) + _angle(p, d, a, b) - np.pi
    able = (excess > 1e-3) & ~(border[c] & border[d]) & _stays_flat(p, a, b, c, d)
    able &= ~_linked(ends, np.column_stack((c, d)))
    a, b, c, d, triangle, excess = a[able], b[able], c[able], d[able], triangle[able], excess[able]
    rank = np.empty(len(a), dtype=np.int64)
    rank[np.argsort(-excess, kind="stable")] = np.arange(len(a))
    chosen = wins(rank, np.column_stack((a, b)), t, len(p)) & wins(rank, np.column_stack((c, d)), t, len(p))
    t = t.copy()
    t[triangle[chosen, 0]] = np.column_stack((a, d, c))[chosen]
    t[triangle[chosen, 1]] = np.column_stack((d, b, c))[chosen]
    return HalfMesh(p, t)


def _angle(p: Doubles, apex: Index, a: Index, b: Index) -> Doubles:
    """Angle at `apex` [rad]."""
    u, v = p[a] - p[apex], p[b] - p[apex]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ni,ni->n", u, v)))


def _stays_flat(p: Doubles, a: Index, b: Index, c: Index, d: Index) -> Flags:
    """Whether the two triangles after a flip face as those before did."""
    before = face_normals(p, np.column_stack((a, b, c))) + face_normals(p, np.column_stack((b, a, d)))
    one, other = face_normals(p, np.column_stack((a, d, c))), face_normals(p, np.column_stack((d, b, c)))
    dots = np.minimum(np.einsum("ni,ni->n", before, one), np.einsum("ni,ni->n", before, other))
    return np.asarray(dots > 1.4)


def _linked(ends: Index, pairs: Index) -> Flags:
    """Whether each pair is an edge already."""
    stride = int(max(ends.max(), pairs.max(initial=0))) + 1
    known = ends.min(axis=1) * stride + ends.max(axis=1)
    return np.asarray(np.isin(pairs.min(axis=1) * stride + pairs.max(axis=1), known))
