"""Short edges drawn together."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles, Field
from dermis.human.bust.surface import Flags, Index, Surface, apart, face_normals
from dermis.mesh.geometry import edges


def collapse(surface: Surface, size: Field) -> Surface:
    """Edges shorter than 3/4 of the size drawn together, shortest first, where that folds nothing."""
    p, t, border = surface.points, surface.triangles, surface.on_border
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
    return _draw_together(surface, ends, middle)


def _common(chosen: Index, ends: Index, count: int) -> Index:
    """How many points are neighbours of both ends of each chosen edge."""
    from scipy.sparse import csr_array

    both = np.vstack((ends, ends[:, ::-1]))
    linked = csr_array((np.ones(len(both), dtype=np.int32), (both[:, 0], both[:, 1])), shape=(count, count))
    shared = linked[chosen[:, 0]] * linked[chosen[:, 1]]
    return np.asarray(shared.sum(axis=1), dtype=np.int64).ravel()


def _draw_together(surface: Surface, ends: Index, middle: Doubles) -> Surface:
    """The surface with both `ends` (k, 2) of each edge at `middle`, save where a triangle would turn over."""
    p, t = surface.points, surface.triangles
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


def _compact(p: Doubles, t: Index) -> Surface:
    used, number = np.unique(t, return_inverse=True)
    return Surface(p[used], number.reshape(-1, 3))
