"""Sampling of an atlas as in shaders, and the surface that its texels represent."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.mesh.geometry import uv_cross
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Points(NamedTuple):
    """Points (n,) of a surface: triangle, and weights (n, 3) of its corners."""

    triangle: Index
    weights: Floats

    def on(self, corners: NDArray[np.floating]) -> Floats:
        """Return the (n, c) values of an attribute (f, 3, c)."""
        return np.asarray(np.einsum("nk,nkc->nc", self.weights, corners[self.triangle].astype(np.float64)))


def shown(atlas: Atlas, mesh: Mesh, own: bool = False) -> Floats:
    """Return the (n, n, 3) position that each texel represents, NaN for none.

    own : only texels whose light is computed
    """
    there = atlas.lit_mask if own else atlas.coverage
    return np.where(there[..., None], atlas.interpolate(mesh, mesh.positions), np.nan)


def read(values: Floats, at: Floats) -> Floats:
    """Return (k, c) bilinear samples of values (n, n, c); NaN of a texel counts only if its weight is not 0.

    at : (k, 2) x and y [texel], integers at texel centres
    """
    last = len(values) - 1
    low = np.clip(np.floor(at).astype(np.int64), 0, last)
    f = np.where(np.abs(at - np.rint(at)) < 1e-3, np.rint(at), at) - low
    total = np.zeros((len(at), values.shape[2]))
    for dy in (0, 1):
        for dx in (0, 1):
            share = np.abs(1 - dx - f[:, 0]) * np.abs(1 - dy - f[:, 1])
            texel = values[np.minimum(low[:, 1] + dy, last), np.minimum(low[:, 0] + dx, last)]
            total += np.where(share[:, None] > 0, share[:, None] * texel, 0.0)
    return total


def lit_at(values: Floats, atlas: Atlas, points: Points) -> Floats:
    """Return the (k, c) samples of values (n, n, c) at the positions of the points in the atlas."""
    return read(values, points.on(atlas.corner_uv) * atlas.size - 0.5)


def random_points(mesh: Mesh, count: int, seed: int = 0) -> Points:
    """Return random points on a mesh, a quarter of them on edges and some at corners of triangles."""
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(3), count)
    weights[: count // 4, 0] = 0
    weights[: count // 16, 1] = 0
    return Points(rng.integers(0, len(mesh.triangles), count), weights / weights.sum(axis=1, keepdims=True))


def seam_points(mesh: Mesh, count: int = 4) -> tuple[Points, Points]:
    """Return the same points along all seams for both sides, where uv is discontinuous or folded."""
    uv, place = mesh.uv[mesh.triangles].astype(np.float64), mesh.point[mesh.triangles]
    cross = uv_cross(uv) > 0
    sides: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for f, k in np.ndindex(len(place), 3):
        ends = place[f, k], place[f, (k + 1) % 3]
        sides.setdefault((int(min(ends)), int(max(ends))), []).append((f, k))
    one, other = [], []
    for pair in sides.values():
        if len(pair) != 2:
            continue
        (f, k), (g, j) = pair
        here, there = uv[f, [k, (k + 1) % 3]], uv[g, [j, (j + 1) % 3]]
        turned = place[f, k] == place[g, j]
        if np.allclose(here, there if turned else there[::-1], atol=1e-6) and cross[f] == cross[g]:
            continue
        one.append((f, k, (k + 1) % 3))
        other.append((g, j, (j + 1) % 3) if turned else (g, (j + 1) % 3, j))
    return _along(np.array(one), count), _along(np.array(other), count)


def _along(sides: Index, count: int) -> Points:
    """Return points on edges (s, 3), given as triangle, corner, corner."""
    t = np.tile((np.arange(count) + 0.5) / count, len(sides))
    triangle, first, second = np.repeat(sides, count, axis=0).T
    weights = np.zeros((len(t), 3))
    weights[np.arange(len(t)), first], weights[np.arange(len(t)), second] = 1 - t, t
    return Points(triangle, weights)
