"""Pairs of places that exchange light through thin parts; found once for a mesh and an atlas."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.translucency.samples import (
    Floats,
    Index,
    Samples,
    giving,
    shown,
    surface,
    taking,
    texel_mm,
    texels,
)
from dermis.mesh.mesh import Mesh

if TYPE_CHECKING:
    from dermis.atlas.translucency.kernels.facing import Patches
    from dermis.atlas.translucency.kernels.pair_search import Sources

Found = tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.uint16]]
FORM = 11
"""To be incremented when the search gives other results."""
_REACH = 3.2  # largest distance of a pair, in standard deviations of the widest Gaussian
_SPACING = 0.36  # of the places, in the same unit: light is smooth between them
_WIDEST_MM = 10.0  # pairs through wax, which spreads light farther, would be too many
_MOST_CELLS = 2**21  # of a grid; narrow profiles would ask for thousands of times more
_ROOM = 3.0  # spacings that a place may be away from the triangle that it stands for
_PARTS = 16  # of the search, shared by the processor's cores
_PATCHES = 3.0  # along a radius, into which fine triangles are grouped


@dataclass(frozen=True)
class TranslucentPairs:
    """Pairs of places that exchange light through the flesh, in cells of a coarse atlas.

    receiver : (side, side) int32 0 without surface, 1 where it is thick, from 2 on thin places in order
    first : (m + 3,) uint32 where the pairs of receivers 0, 1, 2, ... begin; 0 and 1 have none
    source : (l,) uint32 the place that each pair takes light from
    geometry : (l, 4) uint16 depth under its tangent plane, distance beside its normal, and along the surface
        [1/65535 of the radius; 65535 where no blur gets there]; share that counts [1/65535]
    texel : (n, 2) uint16 of the sources, x and y in the atlas
    area_mm2 : (n,) float32 of the sources
    radius_mm, spacing_mm : () largest distance of a pair, and usual distance between sources
    """

    receiver: NDArray[np.int32]
    first: NDArray[np.uint32]
    source: NDArray[np.uint32]
    geometry: NDArray[np.uint16]
    texel: NDArray[np.uint16]
    area_mm2: NDArray[np.float32]
    radius_mm: NDArray[np.float64]
    spacing_mm: NDArray[np.float64]


def find_pairs(mesh: Mesh, atlas: Atlas, widest_mm: float) -> TranslucentPairs:
    """All pairs of places that face away from each other and are near enough.

    widest_mm : standard deviation of the widest Gaussian; pairs are at most 3.2 of them and 32 mm apart [mm]
    """
    widest = min(widest_mm, _WIDEST_MM)
    radius, fine = _REACH * widest, texel_mm(atlas)
    side = min(atlas.size, int(np.ceil(atlas.size * fine / (_SPACING * widest))))
    seen = texels(atlas)
    held = surface(atlas, seen, side)
    spacing = fine * atlas.size / side
    thin = facing(mesh, _mapped(mesh, atlas), radius + _ROOM * spacing)
    given = giving(mesh, atlas, seen, side, thin)
    taken = taking(mesh, atlas, held, thin)
    found = _search(atlas, given, taken, shown(atlas, seen, given), radius)
    return _packed(given, taken, held, *found, radius, spacing)


def _mapped(mesh: Mesh, atlas: Atlas) -> NDArray[np.bool_]:
    """(f,) triangles that the atlas shows."""
    found = np.zeros(len(mesh.triangles) + 1, bool)
    found[atlas.triangle] = True  # the last one for none
    return found[:-1]


def _search(
    atlas: Atlas, given: Samples, taken: Samples, shown: NDArray[np.int32], radius_mm: float
) -> Found:
    """How many pairs each receiver has, their sources, and their geometry."""
    from dermis.atlas.translucency.kernels.pair_search import Map, Receivers, search

    x, y = taken.texel.T
    stretch, shear = (array[y, x].astype(np.float32) for array in (atlas.stretch, atlas.shear))
    receivers = Receivers(taken.position, taken.normal, taken.texel, stretch, shear)
    sources, flat = _in_cells(given, radius_mm / 3.0), Map(atlas.reach, shown)
    count = np.zeros(len(taken.cell), np.int64)
    ends = [len(count) * k // _PARTS for k in range(_PARTS + 1)]
    # the kernel releases the GIL, so that threads share the work
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(
            pool.map(lambda part: search(receivers, part, sources, flat, radius_mm, count), pairwise(ends))
        )
    index, geometry = zip(*parts, strict=True)
    return count, np.concatenate(index), np.concatenate(geometry)


def _packed(
    given: Samples,
    taken: Samples,
    surface: NDArray[np.bool_],
    count: NDArray[np.int64],
    index: NDArray[np.int32],
    geometry: NDArray[np.uint16],
    radius_mm: float,
    spacing_mm: float,
) -> TranslucentPairs:
    """The pairs, without the sources that no receiver sees."""
    asked, thin = np.zeros(len(given.cell), bool), count > 0
    asked[index] = True
    used, number = np.flatnonzero(asked), np.cumsum(asked, dtype=np.uint32) - np.uint32(1)
    receiver = surface.astype(np.int32)
    receiver[taken.cell[thin, 1], taken.cell[thin, 0]] = np.arange(2, 2 + thin.sum())
    first = np.concatenate([[0, 0, 0], np.cumsum(count[thin])])
    return TranslucentPairs(
        receiver,
        first.astype(np.uint32),
        number[index],
        geometry,
        given.texel[used].astype(np.uint16),
        given.area_mm2[used].astype(np.float32),
        np.array(radius_mm),
        np.array(spacing_mm),
    )


def _in_cells(given: Samples, cell_mm: float) -> Sources:
    """The places in the cells of a grid, x fastest."""
    from dermis.atlas.translucency.kernels.pair_search import Sources

    if not len(given.position):
        none, nobody = np.zeros((0, 3)), np.zeros(0, np.int64)
        return Sources(none, none, np.zeros(3), cell_mm, np.ones(3, np.int64), np.zeros(2, np.int64), nobody)
    low = given.position.min(axis=0)
    cell_mm = _cell_mm(given.position.max(axis=0) - low, cell_mm)
    place = ((given.position - low) / cell_mm).astype(np.int64)
    size = place.max(axis=0) + 1
    index = place[:, 0] + size[0] * (place[:, 1] + size[1] * place[:, 2])
    order = np.argsort(index, kind="stable")
    first = np.searchsorted(index[order], np.arange(size.prod() + 1))
    return Sources(given.position[order], given.normal[order], low, cell_mm, size, first, order)


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
