"""The search for translucent pairs: tiles that face each other, cells in them, then pairs of places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import BESIDE, TILE, Cells
from dermis.frame.features.translucency.passes import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    draw_receivers,
    draw_sources,
    space,
)
from dermis.frame.programs import each, program
from dermis.gpu import Bindings, Buffer, CommandList, Constants, Device

Words = NDArray[np.uint32]
Index = NDArray[np.int64]
_MOST_BLOCKS = 40  # along a side
_BOUNDS_BYTES = 48  # as in bounds.wgsl
_LISTED: Constants = (("LISTED", 1),)
_COPIES = 8  # in gutters, of each source at most, as in map_positions.wgsl
_PAIR_BYTES = 12


@dataclass(frozen=True, eq=False)
class CellTables:
    """What all searches on an atlas read of its cells, as buffers.

    every : all tiles, as tile_pairs.wgsl reads them
    triangle_first, triangles : as tiles.wgsl reads them
    gutters : as gutter_copies.wgsl reads it
    """

    every: Buffer
    triangle_first: Buffer
    triangles: Buffer
    gutters: Buffer


def cell_tables(device: Device, cells: Cells) -> CellTables:
    """The tables of an atlas' cells."""
    count = cells.tiles**2
    lists = (np.arange(count), np.zeros(count, np.int64)), (cells.triangle_first,), (cells.triangle,)
    return CellTables(*(upload_words(device, *columns) for columns in (*lists, cells.copy.T)))


class SearchPasses:
    """Passes that run at once, for what they count decides the next ones.

    frame : that they are recorded in
    blocks : of tiles, along a side of the atlas
    """

    def __init__(self, device: Device, cells: Cells) -> None:
        block = -(-cells.tiles // _MOST_BLOCKS)
        self.device, self.frame = device, CommandList(device, timed=False)
        self.blocks = -(-cells.tiles // block)
        self._told = {
            "radius_mm": cells.radius_mm,
            "variance_mm2": cells.widest_mm**2,
            "tile": TILE / cells.side,
            "beside": BESIDE / cells.size,
            "tiles": cells.tiles,
            "blocks": self.blocks,
            "block": block,
        }

    def add(self, name: str, count: int, bound: Bindings, constants: Constants = ()) -> None:
        """Add a pass of `count` invocations; its shader reads the parameters of the search."""
        shader = program(self.device, f"translucency/pair_search/{name}.wgsl", constants)
        record = shader.record("Search", **self._told, count=count)
        self.frame.dispatch("pair search", shader, {**bound, "search": record}, each(count))

    def read(self, buffer: Buffer, count: int) -> Index:
        """The first words that the passes so far leave there."""
        self.frame.submit()
        self.frame = CommandList(self.device, timed=False)
        words = np.frombuffer(self.device.handle.queue.read_buffer(buffer), np.uint32)
        return words[:count].astype(np.int64)

    def upload(self, *columns: NDArray[np.integer]) -> Buffer:
        """Buffer of a table of words, with zeros where there are no rows."""
        return upload_words(self.device, *columns)


def upload_words(device: Device, *columns: NDArray[np.integer]) -> Buffer:
    """Buffer of a table of words, given by its columns; one row of zeros where there are none."""
    table = np.zeros((max(1, len(columns[0])), len(columns)), np.uint32)
    for k, column in enumerate(columns):
        table[: len(column), k] = column
    return device.buffer(table, "STORAGE")


def starts(counts: Index) -> Index:
    """(n + 1,) where each of some lists begins in all of them, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(counts)])


@dataclass(frozen=True, eq=False)
class Facing:
    """Tiles that may have pairs.

    bounds : buffer of boxes and cones of all tiles
    tile : (t,) those that face any
    first : (t + 1,) where the list of each begins
    listed : buffer of the tiles that they face
    """

    bounds: Buffer
    tile: Index
    first: Index
    listed: Buffer


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


def _near(passes: SearchPasses, surface: Bindings, tables: CellTables, tiles: Buffer, count: int) -> Buffer:
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


def draw_copies(passes: SearchPasses, cells: Cells, source: Index, bound: Bindings) -> Buffer:
    """Buffer of the places in gutters that show sources, as gutter_copies.wgsl writes it.

    source : (n,) cells
    bound : what gutter_copies.wgsl reads besides
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


def upload_receivers(device: Device, cells: Cells, receiver: Index) -> tuple[Buffer, int]:
    """Buffer of triangles, weights and cells of some of the cells that take light, and how many there are."""
    columns = *cells.middle[receiver].T, cells.taking[receiver], np.zeros(len(receiver), np.int64)
    return upload_words(device, *columns), len(receiver)


def upload_sources(device: Device, cells: Cells, cell: Index) -> tuple[Buffer, int]:
    """Buffer of cells that give light, and how many there are."""
    return upload_words(device, cell % cells.side | (cell // cells.side << 16)), len(cell)


@dataclass(frozen=True, eq=False)
class Found:
    """Pairs, and what they join.

    receiver : (m,) those that have any, among the cells that take light
    first : (m + 1,) where the pairs of each begin
    source : (n,) cells that give light
    pairs : buffer of three words each: source, receiver, offset in the map
    """

    receiver: Index
    first: Index
    source: Index
    pairs: Buffer


def search(device: Device, surface: Bindings, cells: Cells, tables: CellTables) -> Found | None:
    """All pairs that let light pass that counts; None where a buffer cannot hold them.

    surface : resources of geometry.wgsl, for the shape to search on, and of the atlas
    """
    passes = SearchPasses(device, cells)
    facing = find_facing(passes, surface, cells, tables)
    places = places_of(cells, facing)
    seen, words = looks(passes, places)
    count = len(places.receiver)
    if max(4 * words, RECEIVER_BYTES * count) > device.max_storage_bytes:
        return None
    points = draw_places(passes, surface, cells, places)
    hits, counts = space(device, words), space(device, count)
    seen = {**seen, "facing": facing.listed, "hits": hits}
    passes.add("hits", count, {**seen, **points, "tiles": facing.bounds, "counts": counts})
    number = passes.read(counts, count)
    if _PAIR_BYTES * number.sum() > device.max_storage_bytes:
        return None
    bound = {**points, "reach_map": surface["reach_map"], "gutters": tables.gutters}
    return _listed(passes, cells, places, number, seen, bound)


def _listed(
    passes: SearchPasses, cells: Cells, places: Places, number: Index, seen: Bindings, bound: Bindings
) -> Found:
    """The hits as pairs, without the cells that have none.

    number : (r,) pairs of each receiver
    seen : what hits.wgsl has read and written
    bound : what gutter_copies.wgsl and offsets.wgsl read besides
    """
    device, sources, first = passes.device, len(places.source), starts(number)
    count, begins = int(first[-1]), passes.upload(first)
    pairs, used = space(device, count, _PAIR_BYTES), space(device, sources)
    passes.add("pairs", len(number), {**seen, "first": begins, "pairs": pairs, "used": used})
    taken, given = number > 0, passes.read(used, sources) > 0
    asked = np.flatnonzero(given)
    looked_up = {**bound, "asked": passes.upload(asked)}
    numbers = {
        "number_of_receiver": passes.upload(np.cumsum(taken) - taken),
        "number_of_source": passes.upload(np.cumsum(given) - given),
        "copies": draw_copies(passes, cells, places.source[asked], looked_up),
    }
    passes.add("offsets", count, {**bound, **numbers, "pairs": pairs})
    passes.frame.submit()
    return Found(places.receiver[taken], starts(number[taken]), places.source[asked], pairs)
