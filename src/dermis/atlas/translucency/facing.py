"""Triangles that may belong to translucent pairs: most of a head does not, and need not be searched."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh

if TYPE_CHECKING:
    from dermis.atlas.translucency.kernels.facing import Patches

Index = NDArray[np.int64]
Floats = NDArray[np.float64]
_PATCHES = 3.0  # along a radius, into which fine triangles are put together
_MOST_CELLS = 2**21  # of a grid


def facing(mesh: Mesh, shown: NDArray[np.bool_], radius_mm: float) -> NDArray[np.bool_]:
    """(f,) triangles that may have a pair across the flesh; all that have one are among them.

    shown : (f,) those that light passes through
    radius_mm : how far apart two places are at most
    """
    from dermis.atlas.translucency.kernels.facing import Cells, face

    found = np.zeros(len(shown), bool)
    if not shown.any():
        return found
    of, patches = _patches(mesh, np.flatnonzero(shown), radius_mm / _PATCHES)
    low = patches.low.min(axis=0)
    cell_mm = _cell_mm(patches.high.max(axis=0) - low, radius_mm)
    first, last = (((at - low) / cell_mm).astype(np.int64) for at in (patches.low, patches.high))
    size = last.max(axis=0) + 1
    cell, patch = _boxed(first, last, size)
    order = np.argsort(cell, kind="stable")
    begin = np.searchsorted(cell[order], np.arange(size.prod() + 1))
    cells = Cells(low, cell_mm, size, begin, patch[order])
    found[shown] = face(patches, cells, radius_mm)[of]
    return found


def _patches(mesh: Mesh, chosen: Index, side_mm: float) -> tuple[Index, Patches]:
    """The patch of each chosen triangle, by the cell of a grid that its middle is in, and all patches."""
    from dermis.atlas.translucency.kernels.facing import Patches

    corners = mesh.triangles[chosen]
    position, normal = (values[corners].astype(np.float64) for values in (mesh.positions, mesh.normals))
    middle = position.mean(axis=1)
    low = middle.min(axis=0)
    place = ((middle - low) / _cell_mm(middle.max(axis=0) - low, side_mm)).astype(np.int64)
    size = place.max(axis=0) + 1
    cell = place[:, 0] + size[0] * (place[:, 1] + size[1] * place[:, 2])
    order = np.argsort(cell, kind="stable")
    begins = np.diff(cell[order], prepend=-1) > 0
    of = np.empty(len(chosen), np.int64)
    of[order] = np.cumsum(begins) - 1
    first = np.flatnonzero(begins)
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-30)
    axis = np.add.reduceat(normal.sum(axis=1)[order], first)
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-30)
    least = np.einsum("fkc,fc->fk", normal, axis[of]).min(axis=1)
    cosine = np.clip(np.minimum.reduceat(least[order], first), -1.0, 1.0)
    boxes = (
        np.minimum.reduceat(position.min(axis=1)[order], first),
        np.maximum.reduceat(position.max(axis=1)[order], first),
    )
    return of, Patches(*boxes, axis, cosine, np.sqrt(1.0 - cosine**2))


def _cell_mm(extent_mm: Floats, side_mm: float) -> float:
    """The side of a grid's cells, so large that there are not too many."""
    return max(side_mm, float(np.cbrt(np.maximum(extent_mm, side_mm).prod() / _MOST_CELLS)))


def _boxed(first: Index, last: Index, size: Index) -> tuple[Index, Index]:
    """All pairs of a cell and a patch that reaches into it, from the first to the last along each axis."""
    spans = last - first + 1
    count = spans.prod(axis=1)
    patch = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(patch)) - np.repeat(np.cumsum(count) - count, count)
    wide, deep = spans[patch, 0], spans[patch, 1]
    x, y, z = first[patch].T + np.stack([number % wide, number // wide % deep, number // (wide * deep)])
    return x + size[0] * (y + size[1] * z), patch
