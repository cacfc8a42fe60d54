"""Search for pairs of surface cells on opposite sides of thin tissue, through which light passes.

The cells are grouped into tiles, and tiles into blocks. Only pairs of tiles with opposed normals are
searched.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import CELLS_PER_TILE_SIDE, TILE_MARGIN_TEXELS, Cells
from dermis.frame.features.translucency.passes import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    draw_cell_points,
    make_element_buffer,
)
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Bindings, Buffer, CommandList, Constants, Device

Words = NDArray[np.uint32]
Index = NDArray[np.int64]
_MAX_BLOCKS_PER_SIDE = 40  # limit of blocks along a side of the atlas
_TILE_BOUNDS_BYTES = 48  # size of the struct Bounds of bounds.wgsl
_MAX_GUTTER_COPIES = 8  # COPIES of map_positions.wgsl
_PAIR_BYTES = 12


class SearchPasses:
    """Passes of the search for cell pairs.

    They are submitted in batches, because the sizes of later passes depend on earlier results.

    commands : command list of the passes that are not yet submitted
    blocks : number of blocks along a side of the atlas; a block is a square of tiles, and a tile is a square
        of cells
    """

    def __init__(self, device: Device, cells: Cells) -> None:
        block = -(-cells.tiles_per_side // _MAX_BLOCKS_PER_SIDE)
        self.device, self.commands = device, CommandList(device, timed=False)
        self.blocks = -(-cells.tiles_per_side // block)
        self._parameters = {
            "radius_mm": cells.radius_mm,
            "variance_mm2": cells.max_sigma_mm**2,
            "tile": CELLS_PER_TILE_SIDE / cells.side,
            "margin": TILE_MARGIN_TEXELS / cells.size,
            "tiles": cells.tiles_per_side,
            "blocks": self.blocks,
            "block": block,
        }

    def add_pass(
        self, shader_name: str, invocation_count: int, bindings: Bindings, constants: Constants = ()
    ) -> None:
        """Add a pass with one shader invocation for each of `invocation_count` elements.

        shader_name : name of the shader in this folder, without its suffix
        """
        shader = program(self.device, f"translucency/pair_search/{shader_name}.wgsl", constants)
        record = shader.make_record("Search", **self._parameters, count=invocation_count)
        self.commands.dispatch(
            "pair search", shader, {**bindings, "search": record}, workgroup_grid(invocation_count)
        )

    def submit_and_read(self, buffer: Buffer, word_count: int) -> Index:
        """Submit all passes that were added, and return the first `word_count` words of a buffer."""
        self.commands.submit()
        self.commands = CommandList(self.device, timed=False)
        words = np.frombuffer(self.device.handle.queue.read_buffer(buffer), np.uint32)
        return words[:word_count].astype(np.int64)

    def upload_columns(self, *columns: NDArray[np.integer]) -> Buffer:
        """Upload integer columns as a table of 32-bit words; an empty table becomes one row of zeros."""
        return upload_words(self.device, *columns)


def upload_words(device: Device, *columns: NDArray[np.integer]) -> Buffer:
    """Upload integer columns as a table of 32-bit words; an empty table becomes one row of zeros."""
    table = np.zeros((max(1, len(columns[0])), len(columns)), np.uint32)
    for k, column in enumerate(columns):
        table[: len(column), k] = column
    return device.buffer(table, "STORAGE")


def list_offsets(list_lengths: Index) -> Index:
    """Return the offsets of n lists that are stored one after another, and their total length, (n + 1,).

    list_lengths : (n,) lengths of the lists
    """
    return np.concatenate([[0], np.cumsum(list_lengths)])


@dataclass(frozen=True, eq=False)
class TilePairs:
    """Pairs of tiles that may be on opposite sides of thin tissue.

    A tile is a square of cells of the atlas.

    bounds : buffer of the bounding box and normal cone of each tile
    tile : (t,) indices of the tiles that are in at least one pair
    first : (t + 1,) offsets into `partners`; the partners of tile[i] are from first[i] up to first[i + 1]
    partners : buffer of the indices of the tiles that form pairs with each tile
    """

    bounds: Buffer
    tile: Index
    first: Index
    partners: Buffer


def find_tile_pairs(passes: SearchPasses, surface_bindings: Bindings, cells: Cells) -> TilePairs:
    """Find the pairs of tiles that may be on opposite sides of thin tissue.

    A tile is a square of cells of the atlas.

    surface_bindings : resources of geometry.wgsl
    """
    device, count = passes.device, cells.tiles_per_side**2
    tiles, counts = make_element_buffer(device, count, _TILE_BOUNDS_BYTES), make_element_buffer(device, count)
    bindings = {"tiles": tiles, "block_pairs": _find_block_pairs(passes, surface_bindings, cells, tiles)}
    every_tile = passes.upload_columns(np.arange(count), np.zeros(count, np.int64))
    passes.add_pass("tile_pairs", count, {**bindings, "queries": every_tile, "partners": counts})
    partner_count = passes.submit_and_read(counts, count)
    tile = np.flatnonzero(partner_count)
    first = list_offsets(partner_count[tile])
    partners = make_element_buffer(device, int(first[-1]))
    bindings |= {"queries": passes.upload_columns(tile, first[:-1]), "partners": partners}
    passes.add_pass("tile_pairs", len(tile), bindings, (("LISTED", 1),))
    return TilePairs(tiles, tile, first, partners)


def _find_block_pairs(
    passes: SearchPasses, surface_bindings: Bindings, cells: Cells, tile_bounds: Buffer
) -> Buffer:
    """Return a buffer with one bit for each pair of blocks, set if light may pass between them.

    A tile is a square of cells of the atlas, and a block is a square of tiles.

    tile_bounds : buffer to fill with the bounding box and normal cone of each tile
    """
    blocks = passes.blocks**2
    words = blocks * -(-blocks // 32)
    bounds = make_element_buffer(passes.device, blocks, _TILE_BOUNDS_BYTES)
    block_pairs = make_element_buffer(passes.device, words)
    triangles = {
        "triangle_first": passes.upload_columns(cells.triangle_first),
        "triangles": passes.upload_columns(cells.triangles),
    }
    passes.add_pass("tiles", cells.tiles_per_side**2, {**surface_bindings, **triangles, "tiles": tile_bounds})
    passes.add_pass("blocks", blocks, {"tiles": tile_bounds, "blocks": bounds})
    passes.add_pass("block_pairs", words, {"blocks": bounds, "block_pairs": block_pairs})
    return block_pairs


@dataclass(frozen=True, eq=False)
class CandidateCells:
    """Cells that may be on opposite sides of thin tissue, ordered by the tiles that contain them.

    receiver : (r,) cells that receive light, as indices into `Cells.receivers`
    source : (s,) indices of the cells that emit light
    first : (r,) for each receiver, index in `TilePairs.partners` where the partners of its tile start
    end : (r,) for each receiver, index where these partners end
    sources_first : (t,) for each of the t tiles of the atlas, index in `source` where its sources start
    sources_end : (t,) for each of these tiles, index where its sources end
    """

    receiver: Index
    source: Index
    first: Index
    end: Index
    sources_first: Index
    sources_end: Index


def candidate_cells(cells: Cells, tile_pairs: TilePairs) -> CandidateCells:
    """Return the cells of all tiles that `find_tile_pairs` paired with at least one tile."""
    tile = tile_pairs.tile
    receiver, receiver_tile = _expand_ranges(cells.receiver_first, tile)
    source, _ = _expand_ranges(cells.source_first, tile)
    count = np.zeros(cells.tiles_per_side**2, np.int64)
    count[tile] = cells.source_first[tile + 1] - cells.source_first[tile]
    end = np.cumsum(count)
    ranges = tile_pairs.first[:-1][receiver_tile], tile_pairs.first[1:][receiver_tile]
    return CandidateCells(receiver, cells.sources[source], *ranges, end - count, end)


def _expand_ranges(range_starts: Index, chosen_ranges: Index) -> tuple[Index, Index]:
    """Return all integers in the chosen ranges and, for each integer, an index into `chosen_ranges`.

    The index tells which of the chosen ranges contains the integer.

    range_starts : start of each range; a range ends where the next range starts
    chosen_ranges : indices of the chosen ranges in `range_starts`
    """
    count = range_starts[chosen_ranges + 1] - range_starts[chosen_ranges]
    position = np.repeat(np.arange(len(chosen_ranges)), count)
    integers = np.arange(len(position)) + np.repeat(
        range_starts[chosen_ranges] - list_offsets(count)[:-1], count
    )
    return integers, position


def compute_positions(
    passes: SearchPasses, surface_bindings: Bindings, cells: Cells, candidates: CandidateCells
) -> Bindings:
    """Compute the positions and normals of the candidate cells.

    Return a dictionary from names in shaders to the buffers of the results.

    surface_bindings : resources of geometry.wgsl and of the atlas
    """
    device, commands = passes.device, passes.commands
    receiver_points = make_element_buffer(device, len(candidates.receiver), RECEIVER_BYTES)
    source_points = make_element_buffer(device, len(candidates.source), SOURCE_BYTES)
    receivers = upload_receivers(device, cells, candidates.receiver)
    draw_cell_points(
        commands, "receiver", surface_bindings, cells, receivers, receiver_points, metric_from_triangles=True
    )
    draw_cell_points(
        commands,
        "source",
        surface_bindings,
        cells,
        upload_sources(device, cells, candidates.source),
        source_points,
    )
    return {"receiver_points": receiver_points, "source_points": source_points}


def upload_hit_ranges(passes: SearchPasses, candidates: CandidateCells) -> tuple[Bindings, int]:
    """Upload the ranges of source cells that hits.wgsl tests for each receiver cell.

    Return a dictionary from names in hits.wgsl to the buffers of the ranges, and the number of words that
    hits.wgsl writes. A tile is a square of cells. There is one word for each receiver cell and each tile that
    is tested for it, and a word has one bit for each source cell in the tile.
    """
    word = list_offsets(candidates.end - candidates.first)
    unused = np.zeros(len(candidates.receiver), np.int64)
    ranges = candidates.sources_first, candidates.sources_end
    bindings = {
        "receiver_ranges": passes.upload_columns(candidates.first, candidates.end, word[:-1], unused),
        "source_ranges": passes.upload_columns(*ranges),
    }
    return bindings, int(word[-1])


def list_gutter_copies(passes: SearchPasses, cells: Cells, source_cells: Index, bindings: Bindings) -> Buffer:
    """Add the pass that lists, for each source cell, the gutter positions to which its light is copied.

    The positions to which light of neighbouring cells is copied are included. Return the buffer of all
    these positions.

    source_cells : (n,) indices of cells that emit light
    bindings : further resources of gutter_copies.wgsl
    """
    side, ranges = cells.side, list[Index]()
    y, x = np.divmod(source_cells, side)
    for row in (y - 1, y, y + 1):
        within = (row >= 0) & (row < side)
        begin = np.clip(row, 0, side - 1) * side
        first = cells.gutter_copy_first[begin + np.maximum(x - 1, 0)]
        end = cells.gutter_copy_first[begin + np.minimum(x + 1, side - 1) + 1]
        ranges += [first, np.where(within, end, first)]
    copies = make_element_buffer(passes.device, _MAX_GUTTER_COPIES * len(source_cells))
    resources = {**bindings, "rows": passes.upload_columns(*ranges), "copies": copies}
    passes.add_pass("gutter_copies", len(source_cells), resources)
    return copies


def upload_receivers(device: Device, cells: Cells, receiver_index: Index) -> tuple[Buffer, int]:
    """Upload the surface point and the cell of each receiver; return the buffer and its number of rows.

    receiver_index : (n,) indices into `Cells.receivers`, the cells that receive light
    """
    columns = (
        *cells.receiver_points[receiver_index].T,
        cells.receivers[receiver_index],
        np.zeros(len(receiver_index), np.int64),
    )
    return upload_words(device, *columns), len(receiver_index)


def upload_sources(device: Device, cells: Cells, source_cells: Index) -> tuple[Buffer, int]:
    """Upload the packed (x, y) of cells that emit light; return the buffer and its number of rows.

    source_cells : (n,) indices of these cells; the cells of the atlas are numbered row by row
    """
    return upload_words(device, source_cells % cells.side | (source_cells // cells.side << 16)), len(
        source_cells
    )


@dataclass(frozen=True, eq=False)
class PairTable:
    """Pairs of a source cell and a receiver cell on opposite sides of thin tissue, ordered by receiver.

    receiver : (m,) cells that receive light from at least one source, as indices into `Cells.receivers`
    first : (m + 1,) offsets into `pairs`; the pairs of receiver[i] are from first[i] up to first[i + 1]
    source : (n,) indices of the cells that emit light in at least one pair
    pairs : buffer of three words for each pair: source, receiver, and the offset in the atlas between the two
    """

    receiver: Index
    first: Index
    source: Index
    pairs: Buffer


def search_pairs(device: Device, surface_bindings: Bindings, cells: Cells) -> PairTable | None:
    """Return all pairs of cells that exchange enough light, None if a buffer is too small.

    surface_bindings : resources of geometry.wgsl and of the atlas, for the shape that is searched
    """
    passes = SearchPasses(device, cells)
    tile_pairs = find_tile_pairs(passes, surface_bindings, cells)
    candidates = candidate_cells(cells, tile_pairs)
    ranges, words = upload_hit_ranges(passes, candidates)
    count = len(candidates.receiver)
    if max(4 * words, RECEIVER_BYTES * count) > device.max_storage_bytes:
        return None
    points = compute_positions(passes, surface_bindings, cells, candidates)
    hits, counts = make_element_buffer(device, words), make_element_buffer(device, count)
    hit_bindings = {**ranges, "partners": tile_pairs.partners, "hits": hits}
    passes.add_pass("hits", count, {**hit_bindings, **points, "tiles": tile_pairs.bounds, "counts": counts})
    pair_count = passes.submit_and_read(counts, count)
    if _PAIR_BYTES * pair_count.sum() > device.max_storage_bytes:
        return None
    gutters = passes.upload_columns(*cells.gutter_copies.T)
    gutter_copy_bindings = {**points, "reach_map": surface_bindings["reach_map"], "gutters": gutters}
    return _make_pair_table(passes, cells, candidates, pair_count, hit_bindings, gutter_copy_bindings)


def _make_pair_table(
    passes: SearchPasses,
    cells: Cells,
    candidates: CandidateCells,
    pair_count: Index,
    hit_bindings: Bindings,
    gutter_copy_bindings: Bindings,
) -> PairTable:
    """Convert the bits that hits.wgsl wrote to a table of cell pairs, and drop the cells that are in no pair.

    pair_count : (r,) number of pairs of each receiver
    hit_bindings : resources that hits.wgsl and pairs.wgsl share
    gutter_copy_bindings : resources that gutter_copies.wgsl and offsets.wgsl share
    """
    device, sources, first = passes.device, len(candidates.source), list_offsets(pair_count)
    count, first_pair = int(first[-1]), passes.upload_columns(first)
    pairs, used = make_element_buffer(device, count, _PAIR_BYTES), make_element_buffer(device, sources)
    passes.add_pass(
        "pairs", len(pair_count), {**hit_bindings, "first": first_pair, "pairs": pairs, "used": used}
    )
    is_receiver, is_source = pair_count > 0, passes.submit_and_read(used, sources) > 0
    chosen = np.flatnonzero(is_source)
    copy_bindings = {**gutter_copy_bindings, "queries": passes.upload_columns(chosen)}
    bindings = {
        **gutter_copy_bindings,
        "receiver_index": passes.upload_columns(np.cumsum(is_receiver) - is_receiver),
        "source_index": passes.upload_columns(np.cumsum(is_source) - is_source),
        "copies": list_gutter_copies(passes, cells, candidates.source[chosen], copy_bindings),
        "pairs": pairs,
    }
    passes.add_pass("offsets", count, bindings)
    passes.commands.submit()
    receiver = candidates.receiver[is_receiver]
    return PairTable(receiver, list_offsets(pair_count[is_receiver]), candidates.source[chosen], pairs)
