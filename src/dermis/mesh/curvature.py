"""Curvature of a mesh at its corner vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.disk import cached_array
from dermis.mesh.geometry import Doubles, edges, sum_at, triangle_areas
from dermis.mesh.mesh import Floats, Mesh

SMOOTH_MM = 3.0
"""Standard deviation of the smoothing, about the distance that light travels in skin."""

_MOST_STEPS = 256
_FORM = "curvature 1"  # increment when the same mesh gives other results


def vertex_curvature(mesh: Mesh) -> Floats:
    """Root mean square of the two principal curvatures, smoothed, (v,): 1/r on a sphere [1/mm].

    It is computed once for a mesh and kept on disk.
    """
    sources = mesh.positions, mesh.normals, mesh.triangles, mesh.point
    return cached_array(sources, _FORM, lambda: _curvature(mesh))


def _curvature(mesh: Mesh) -> Floats:
    corners = mesh.point[mesh.triangles]
    area = triangle_areas(mesh.positions[mesh.triangles])
    count = int(mesh.point.max()) + 1
    rows = np.concatenate([area[:, None] * _bend(mesh).reshape(-1, 9), area[:, None]], axis=1)
    summed = sum_at(corners.ravel(), np.repeat(rows, 3, axis=0), count)
    bend = summed[:, :9] / np.maximum(summed[:, 9:], 1e-12)
    curvature = np.linalg.norm(bend, axis=1) / np.sqrt(2.0)
    return _smoothed(curvature, corners, mesh)[mesh.point].astype(np.float32)


def _bend(mesh: Mesh) -> Doubles:
    """(f, 3, 3) change of the normal with position along each triangle [1/mm]; 0 for those without area."""
    p, n = (a[mesh.triangles].astype(np.float64) for a in (mesh.positions, mesh.normals))
    sides, turns = p[:, 1:] - p[:, :1], n[:, 1:] - n[:, :1]
    across = np.cross(sides[:, 0], sides[:, 1])
    square = (across**2).sum(axis=1)[:, None]
    # The dual basis: its rows give 1 on their own side, 0 on the other.
    dual = np.stack([np.cross(sides[:, 1], across), np.cross(across, sides[:, 0])], axis=1)
    dual /= np.where(square > 0, square, np.inf)[..., None]
    bend = np.einsum("fki,fkj->fij", turns, dual)
    unit = across / np.sqrt(np.where(square > 0, square, np.inf))
    flat = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    bend = flat @ bend @ flat
    return np.asarray(0.5 * (bend + bend.transpose(0, 2, 1)))


def _smoothed(values: Doubles, corners: NDArray[np.integer], mesh: Mesh) -> Doubles:
    """Averaged over neighbours repeatedly, until the smoothing reaches `SMOOTH_MM`."""
    pairs, _, _ = edges(corners)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    place = np.zeros((len(values), 3))
    place[mesh.point] = mesh.positions
    square = ((place[pairs[:, 0]] - place[pairs[:, 1]]) ** 2).sum(axis=1)
    degree = 1.0 + np.bincount(both[:, 0], minlength=len(values))
    # A step moves a value by an edge or leaves it; its variance along each of the surface's two axes:
    step = 0.5 * float(np.median(square)) * (1.0 - 1.0 / float(np.median(degree)))
    for _ in range(int(np.clip(np.ceil(SMOOTH_MM**2 / max(step, 1e-12)), 1, _MOST_STEPS))):
        around = np.bincount(both[:, 0], weights=values[both[:, 1]], minlength=len(values))
        values = (values + around) / degree
    return values
