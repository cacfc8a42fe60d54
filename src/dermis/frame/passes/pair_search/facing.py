"""Tiles of the atlas whose places may be translucent pairs: near enough, and turned away from each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.atlas.translucency.cells import Cells
from dermis.frame.passes.pair_search.passes import CellTables, Index, SearchPasses, starts
from dermis.frame.passes.translucency_points import space
from dermis.gpu import Bindings, Constants

_BOUNDS_BYTES = 48  # as in bounds.wgsl
_LISTED: Constants = (("LISTED", 1),)


@dataclass(frozen=True, eq=False)
class Facing:
    """Tiles that may have pairs.

    bounds : buffer of boxes and cones of all tiles
    tile : (t,) those that face any
    first : (t + 1,) where the list of each begins
    listed : buffer of the tiles that they face
    """

    bounds: Any
    tile: Index
    first: Index
    listed: Any


def find_facing(passes: SearchPasses, surface: Bindings, cells: Cells, tables: CellTables) -> Facing:
    """Which tiles may have pairs with which.

    surface : resources of geometry.wgsl
    """
    device, count = passes.device, cells.tiles**2
    tiles, counts = space(device, count, _BOUNDS_BYTES), space(device, count)
    bound = {"tiles": tiles, "near": _near(passes, surface, tables, tiles, count)}
    passes.add("facing", count, {**bound, "asked": tables.every, "facing": counts})
    number = passes.read(counts, count)
    tile = np.flatnonzero(number)
    first = starts(number[tile])
    asked, listed = passes.upload(tile, first[:-1]), space(device, int(first[-1]))
    passes.add("facing", len(tile), {**bound, "asked": asked, "facing": listed}, _LISTED)
    return Facing(tiles, tile, first, listed)


def _near(passes: SearchPasses, surface: Bindings, tables: CellTables, tiles: Any, count: int) -> Any:
    """Buffer of the blocks of tiles that may have pairs with each other.

    tiles, count : buffer to fill with the bounds of tiles, and how many there are
    """
    blocks = passes.blocks**2
    words = blocks * -(-blocks // 32)
    boxes, near = space(passes.device, blocks, _BOUNDS_BYTES), space(passes.device, words)
    shown = {"triangle_first": tables.triangle_first, "triangles": tables.triangles}
    passes.add("tiles", count, {**surface, **shown, "tiles": tiles})
    passes.add("blocks", blocks, {"tiles": tiles, "blocks": boxes})
    passes.add("near", words, {"blocks": boxes, "near": near})
    return near
