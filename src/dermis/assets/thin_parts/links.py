"""Pairs of places that light passes between through thin parts; found once for a mesh and an atlas."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.mesh import Mesh
from dermis.assets.thin_parts.samples import Samples, giving, shown, taking, texel_mm

if TYPE_CHECKING:
    from dermis.assets.thin_parts.compiled.linking import Sources

Found = tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float32]]
FORM = 10
"""Differs when finding gives other results."""
_REACH = 3.2  # standard deviations of the widest Gaussian that two places are apart at most
_SPACING = 0.36  # of the places, in the same unit: what is read between them is smooth
_WIDEST_MM = 10.0  # pairs through wax, which spreads light farther, would be too many
_MOST_CELLS = 2**21  # of the grid that is searched; narrow profiles would ask for thousands of times more
_PARTS = 16  # of the search, shared by the processor's cores


@dataclass(frozen=True)
class Links:
    """What lies opposite through the flesh, in cells of a coarse atlas.

    side : cells of the coarse atlas along a side, which no array says
    receiver : (side, side) int32 0 without surface, 1 where it is thick, from 2 on thin places in order
    first : (m + 3,) uint32 where the links of 0, 1, 2, ... begin; 0 and 1 have none
    source : (l,) uint32 the place that each link takes light from
    lie : (l, 4) uint16 depth under its tangent plane, distance beside its normal, and along the surface
        [1/65535 of the radius; 65535 where no blur leads]; share that counts [1/65535]
    texel : (n, 2) uint16 of the sources, x and y in the atlas
    area_mm2 : (n,) float32 of the sources
    radius_mm, spacing_mm : () how far pairs are apart at most, and places usually
    """

    receiver: NDArray[np.int32]
    first: NDArray[np.uint32]
    source: NDArray[np.uint32]
    lie: NDArray[np.uint16]
    texel: NDArray[np.uint16]
    area_mm2: NDArray[np.float32]
    radius_mm: NDArray[np.float64]
    spacing_mm: NDArray[np.float64]


def find_links(mesh: Mesh, atlas: Atlas, widest_mm: float) -> Links:
    """All pairs of places that face away from each other and are near enough.

    widest_mm : standard deviation of the widest Gaussian; 3.2 of them is near enough, 32 mm at most [mm]
    """
    widest = min(widest_mm, _WIDEST_MM)
    radius, fine = _REACH * widest, texel_mm(atlas)
    side = min(atlas.size, int(np.ceil(atlas.size * fine / (_SPACING * widest))))
    given = giving(mesh, atlas, side)
    taken = taking(mesh, atlas, given)
    found = _search(atlas, given, taken, radius)
    return _packed(given, taken, *found, radius, fine * atlas.size / side)


def _search(atlas: Atlas, given: Samples, taken: Samples, radius_mm: float) -> Found:
    """How many links each place has that takes light, where they begin, and how they lie."""
    from dermis.assets.thin_parts.compiled.linking import Map, Receivers, link

    receivers = Receivers(taken.position, taken.normal, taken.texel)
    sources = _in_cells(given, radius_mm / 3.0)
    stretch, shear = atlas.stretch.astype(np.float32), atlas.shear.astype(np.float32)
    flat = Map(stretch, shear, atlas.reach.astype(np.int32), shown(atlas, given))
    count = np.zeros(len(taken.cell), np.int64)
    ends = [len(count) * k // _PARTS for k in range(_PARTS + 1)]
    # The compiled loop releases the interpreter, so that threads share the work.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        parts = list(
            pool.map(lambda part: link(receivers, part, sources, flat, radius_mm, count), pairwise(ends))
        )
    index, lie = zip(*parts, strict=True)
    return count, np.concatenate(index), np.concatenate(lie)


def _packed(
    given: Samples,
    taken: Samples,
    count: NDArray[np.int64],
    index: NDArray[np.int32],
    lie: NDArray[np.float32],
    radius_mm: float,
    spacing_mm: float,
) -> Links:
    """The links without what nobody uses."""
    used, source = np.unique(index, return_inverse=True)
    thin = count > 0
    receiver = np.zeros((given.side, given.side), np.int32)
    receiver[taken.cell[:, 1], taken.cell[:, 0]] = np.where(thin, np.cumsum(thin) + 1, 1)
    first = np.concatenate([[0, 0, 0], np.cumsum(count[thin])])
    unit = np.array([radius_mm, radius_mm, radius_mm, 1.0])
    return Links(
        receiver,
        first.astype(np.uint32),
        source.astype(np.uint32),
        np.rint(np.minimum(lie / unit, 1.0) * 65535.0).astype(np.uint16),
        given.texel[used].astype(np.uint16),
        given.area_mm2[used].astype(np.float32),
        np.array(radius_mm),
        np.array(spacing_mm),
    )


def _in_cells(given: Samples, cell_mm: float) -> Sources:
    """The places in the cells of a grid, x fastest."""
    from dermis.assets.thin_parts.compiled.linking import Sources

    if not len(given.position):
        none, nobody = np.zeros((0, 3)), np.zeros(0, np.int64)
        return Sources(none, none, np.zeros(3), cell_mm, np.ones(3, np.int64), np.zeros(2, np.int64), nobody)
    low = given.position.min(axis=0)
    extent = np.maximum(given.position.max(axis=0) - low, cell_mm)
    cell_mm = max(cell_mm, float(np.cbrt(extent.prod() / _MOST_CELLS)))
    place = ((given.position - low) / cell_mm).astype(np.int64)
    size = place.max(axis=0) + 1
    index = place[:, 0] + size[0] * (place[:, 1] + size[1] * place[:, 2])
    order = np.argsort(index, kind="stable")
    first = np.searchsorted(index[order], np.arange(size.prod() + 1))
    return Sources(given.position, given.normal, low, cell_mm, size, first, order)
