"""The cells in tiles that may have translucent pairs: where they lie, and where gutters show them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.atlas.translucency.cells import Cells
from dermis.frame.passes.pair_search.facing import Facing
from dermis.frame.passes.pair_search.passes import Index, SearchPasses, starts, upload_words
from dermis.frame.passes.translucency_points import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    draw_receivers,
    draw_sources,
    space,
)
from dermis.gpu import Bindings, Device

_COPIES = 8  # in gutters, of each source at most, as in map_places.wgsl


@dataclass(frozen=True, eq=False)
class Places:
    """Cells in tiles that may have pairs, one tile after the other.

    receiver : (r,) among the cells that take light
    source : (s,) cells that give it
    first, end : (r,) where each receiver's tile begins and ends in the list of the tiles that it faces
    sources_first, sources_end : (t,) those of each tile of the atlas
    """

    receiver: Index
    source: Index
    first: Index
    end: Index
    sources_first: Index
    sources_end: Index


def places_of(cells: Cells, facing: Facing) -> Places:
    """The cells of tiles that face others."""
    tile = facing.tile
    receiver, of = _runs(cells.taking_first, tile)
    source, _ = _runs(cells.giving_first, tile)
    count = np.zeros(cells.tiles**2, np.int64)
    count[tile] = cells.giving_first[tile + 1] - cells.giving_first[tile]
    end = np.cumsum(count)
    ranges = facing.first[:-1][of], facing.first[1:][of]
    return Places(receiver, cells.giving[source], *ranges, end - count, end)


def _runs(first: Index, chosen: Index) -> tuple[Index, Index]:
    """All numbers of some of the runs that begin and end there, and which of those each belongs to."""
    count = first[chosen + 1] - first[chosen]
    of = np.repeat(np.arange(len(chosen)), count)
    return np.arange(len(of)) + np.repeat(first[chosen] - starts(count)[:-1], count), of


def draw_places(passes: SearchPasses, surface: Bindings, cells: Cells, places: Places) -> Bindings:
    """Buffers of where receivers and sources lie, by the names in the shaders.

    surface : resources of geometry.wgsl and of the atlas
    """
    device, frame = passes.device, passes.frame
    taken = space(device, len(places.receiver), RECEIVER_BYTES)
    given = space(device, len(places.source), SOURCE_BYTES)
    receivers = upload_receivers(device, cells, places.receiver)
    draw_receivers(frame, surface, cells, receivers, taken, facets=True)
    draw_sources(frame, surface, cells, upload_sources(device, cells, places.source), given)
    return {"receiver_points": taken, "source_points": given}


def looks(passes: SearchPasses, places: Places) -> tuple[Bindings, int]:
    """Buffers of what each receiver looks at, as hits.wgsl reads them, and how many words its hits take."""
    word = starts(places.end - places.first)
    none = np.zeros(len(places.receiver), np.int64)
    ranges = places.sources_first, places.sources_end
    bound = {
        "looks": passes.upload(places.first, places.end, word[:-1], none),
        "sources_of": passes.upload(*ranges),
    }
    return bound, int(word[-1])


def draw_copies(passes: SearchPasses, cells: Cells, source: Index, bound: Bindings) -> Any:
    """Buffer of the places in gutters that show sources, as copies.wgsl writes it.

    source : (n,) cells
    bound : what copies.wgsl reads besides
    """
    side, ranges = cells.side, list[Index]()
    y, x = np.divmod(source, side)
    for row in (y - 1, y, y + 1):
        within = (row >= 0) & (row < side)
        begin = np.clip(row, 0, side - 1) * side
        first = cells.copy_first[begin + np.maximum(x - 1, 0)]
        end = cells.copy_first[begin + np.minimum(x + 1, side - 1) + 1]
        ranges += [first, np.where(within, end, first)]
    copies = space(passes.device, _COPIES * len(source))
    passes.add("copies", len(source), {**bound, "rows": passes.upload(*ranges), "copies": copies})
    return copies


def upload_receivers(device: Device, cells: Cells, receiver: Index) -> tuple[Any, int]:
    """Buffer of triangles, weights and cells of some of the cells that take light, and how many there are."""
    columns = *cells.middle[receiver].T, cells.taking[receiver], np.zeros(len(receiver), np.int64)
    return upload_words(device, *columns), len(receiver)


def upload_sources(device: Device, cells: Cells, cell: Index) -> tuple[Any, int]:
    """Buffer of cells that give light, and how many there are."""
    return upload_words(device, cell % cells.side | (cell // cells.side << 16)), len(cell)
