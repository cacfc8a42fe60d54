"""The first triangles of half a bust, where its field changes sign."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.human.bust.fields import Doubles, Field
from dermis.human.bust.surface import Surface

# Stretches along x, y and z: start, end, spacing [mm]; fine where ears and nose are.
_STRETCHES = (
    ((0, 60, 3.0), (60, 105, 1.5), (105, 225, 6.0)),
    ((-275, -120, 6.0), (-120, 45, 2.5), (45, 130, 5.0)),
    ((-125, -60, 5.0), (-60, 25, 2.0), (25, 130, 3.0)),
)
_STRIDE = 3  # nodes of the first, coarse look at the field


def polygonise(field: Field) -> Surface:
    """Marching cubes [Lewiner2003] over an uneven grid for x >= 0, open in the plane x = 0."""
    from skimage import measure

    marching_cubes: Any = measure.marching_cubes
    axes = [_axis(stretches) for stretches in _STRETCHES]
    places, triangles, _, _ = marching_cubes(_sample(field, axes), 0.0)
    points = [np.interp(places[:, k], np.arange(len(axis)), axis) for k, axis in enumerate(axes)]
    return Surface(np.column_stack(points), triangles.astype(np.int64))


def _axis(stretches: tuple[tuple[float, float, float], ...]) -> Doubles:
    """Coordinates along stretches that follow each other [mm]."""
    parts = [np.arange(start, end - 1e-6, step) for start, end, step in stretches]
    return np.concatenate([*parts, [stretches[-1][1]]])


def _sample(field: Field, axes: list[Doubles]) -> Doubles:
    """The field at all nodes: in full near the surface, elsewhere as at the nearest node of a coarse grid."""
    nearest = [np.minimum((np.arange(len(axis)) + 1) // _STRIDE * _STRIDE, len(axis) - 1) for axis in axes]
    grid = _grid(axes)
    away = np.linalg.norm(grid - _grid([axis[k] for axis, k in zip(axes, nearest, strict=True)]), axis=-1)
    kept = [np.unique(k, return_inverse=True) for k in nearest]
    coarse = grid[np.ix_(*[nodes for nodes, _ in kept])]
    values = field(coarse.reshape(-1, 3)).reshape(coarse.shape[:3])[np.ix_(*[back for _, back in kept])]
    near = np.abs(values) < 1.6 * away + 6
    values[near] = field(grid[near])
    return values


def _grid(axes: list[Doubles]) -> Doubles:
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
