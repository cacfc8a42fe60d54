"""Edges turned to the other diagonal of the two triangles beside them."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles
from dermis.human.bust.surface import Flags, Index, Surface, face_normals, wins
from dermis.mesh.geometry import edges


def flip(surface: Surface) -> Surface:
    """Edges turned to the other diagonal where the angles across them are too wide (Delaunay)."""
    p, t, border = surface.points, surface.triangles, surface.on_border
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
    return Surface(p, t)


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
