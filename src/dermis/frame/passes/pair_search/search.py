"""Translucent pairs of a surface, found on the device: tiles that face each other, then cells, then places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import BESIDE, TILE, Cells
from dermis.frame.passes import program
from dermis.frame.passes.translucency_points import (
    RECEIVER_BYTES,
    SOURCE_BYTES,
    draw_receivers,
    draw_sources,
    room,
    space,
    workgroups,
)
from dermis.gpu import Constants, Device, Frame

Words = NDArray[np.uint32]
Index = NDArray[np.int64]
_BOUNDS_BYTES = 48  # as in bounds.wgsl
_PAIR_BYTES = 12
_COPIES = 8  # in gutters, of each source at most, as in map_places.wgsl
_MOST_BLOCKS = 40  # along a side
_LISTED: Constants = (("LISTED", 1),)


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
    pairs: Any


@dataclass(frozen=True, eq=False)
class _Facing:
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


@dataclass(frozen=True, eq=False)
class _Places:
    """Cells in tiles that may have pairs, one tile after the other.

    receiver : (r,) among the cells that take light
    source : (s,) cells that give it
    receiver_points, source_points : buffers of where they lie
    looks : buffer, of each receiver: first and end in the list of tiles, and its first word of hits
    sources_of : buffer of the first and the end of each tile's sources
    words : of hits
    """

    receiver: Index
    source: Index
    receiver_points: Any
    source_points: Any
    looks: Any
    sources_of: Any
    words: int


class _Passes:
    """Takes passes of a search, with what all of them are told."""

    def __init__(self, device: Device, cells: Cells) -> None:
        block = -(-cells.tiles // _MOST_BLOCKS)
        self.device, self.frame = device, Frame(device, timed=False)
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

    def add(self, name: str, count: int, bound: dict[str, Any], constants: Constants = ()) -> None:
        """A pass of a number of invocations."""
        shader = program(self.device, f"pair_search/{name}.wgsl", constants)
        record = shader.record("Search", **self._told, count=count, room=room(count))
        self.frame.dispatch("pair search", shader, {**bound, "search": record}, workgroups(count))

    def read(self, buffer: Any) -> Words:
        """What the passes so far leave there."""
        self.frame.submit()
        self.frame = Frame(self.device, timed=False)
        return np.frombuffer(self.device.handle.queue.read_buffer(buffer), np.uint32)


def search(device: Device, surface: dict[str, Any], cells: Cells) -> Found | None:
    """All pairs that may ever let light pass that counts; None where memory does not hold them.

    surface : resources of geometry.wgsl that hold the shape to search on, and those of the atlas
    """
    passes = _Passes(device, cells)
    facing = _facing(passes, surface, cells)
    places = _places(passes, surface, cells, facing)
    if 4 * places.words > device.max_storage_bytes:
        return None
    hits, counts = space(device, places.words), space(device, len(places.receiver))
    found = {
        "looks": places.looks,
        "facing": facing.listed,
        "sources_of": places.sources_of,
        "hits": hits,
    }
    points = {"receiver_points": places.receiver_points, "source_points": places.source_points}
    count = len(places.receiver)
    passes.add("hits", count, {**found, **points, "tiles": facing.bounds, "counts": counts})
    number = passes.read(counts)[:count].astype(np.int64)
    if _PAIR_BYTES * number.sum() > device.max_storage_bytes:
        return None
    first = np.concatenate([[0], np.cumsum(number)])
    pairs, used = space(device, int(first[-1]), _PAIR_BYTES), space(device, len(places.source))
    begins = device.buffer(first.astype(np.uint32), "STORAGE")
    passes.add("pairs", count, {**found, "first": begins, "pairs": pairs, "used": used})
    taken, given = number > 0, passes.read(used)[: len(places.source)] > 0
    numbers = {
        "number_of_receiver": _numbered(device, taken),
        "number_of_source": _numbered(device, given),
        "copies": _copies(passes, cells, places.source, places.source_points),
        "sheet_map": surface["sheet_map"],
    }
    passes.add("offsets", int(first[-1]), {**points, **numbers, "pairs": pairs})
    passes.frame.submit()
    kept = np.concatenate([[0], np.cumsum(number[taken])])
    return Found(places.receiver[taken], kept, places.source[given], pairs)


def _facing(passes: _Passes, surface: dict[str, Any], cells: Cells) -> _Facing:
    """Which tiles may have pairs with which."""
    device, count, blocks = passes.device, cells.tiles**2, passes.blocks**2
    words = blocks * -(-blocks // 32)
    tiles, boxes = space(device, count, _BOUNDS_BYTES), space(device, blocks, _BOUNDS_BYTES)
    near, counts = space(device, words), space(device, count)
    shown = [device.buffer(array, "STORAGE") for array in (cells.triangle_first, cells.triangle)]
    listed = {**surface, "triangle_first": shown[0], "triangles": shown[1]}
    passes.add("tiles", count, {**listed, "tiles": tiles})
    passes.add("blocks", blocks, {"tiles": tiles, "blocks": boxes})
    passes.add("near", words, {"blocks": boxes, "near": near})
    every = np.zeros((count, 2), np.uint32)
    every[:, 0] = np.arange(count)
    bound = {"tiles": tiles, "near": near}
    passes.add("facing", count, {**bound, "asked": device.buffer(every, "STORAGE"), "facing": counts})
    number = passes.read(counts)[:count].astype(np.int64)
    tile = np.flatnonzero(number)
    first = np.concatenate([[0], np.cumsum(number[tile])])
    asked = device.buffer(_columns(tile, first[:-1]), "STORAGE")
    found = space(device, int(first[-1]))
    passes.add("facing", len(tile), {**bound, "asked": asked, "facing": found}, _LISTED)
    return _Facing(tiles, tile, first, found)


def _places(passes: _Passes, surface: dict[str, Any], cells: Cells, facing: _Facing) -> _Places:
    """The cells of tiles that may have pairs, and where they lie."""
    device, side = passes.device, cells.tiles
    row = np.full(side * side, -1)
    row[facing.tile] = np.arange(len(facing.tile))
    receiver = np.flatnonzero(row[cells.tile] >= 0)
    receiver = receiver[np.argsort(cells.tile[receiver], kind="stable")]
    y, x = np.nonzero(cells.own)
    tile = y // TILE * side + x // TILE
    source = np.flatnonzero(row[tile] >= 0)
    source = source[np.argsort(tile[source], kind="stable")]
    sources_of = np.searchsorted(tile[source], np.arange(side * side + 1))
    first, end = (facing.first[part][row[cells.tile[receiver]]] for part in (slice(-1), slice(1, None)))
    word = np.concatenate([[0], np.cumsum(end - first)])
    taken, given = (space(device, len(a), b) for a, b in ((receiver, RECEIVER_BYTES), (source, SOURCE_BYTES)))
    cell = y[source] * cells.side + x[source]
    draw_receivers(passes.frame, surface, cells, upload_receivers(device, cells, receiver), taken, True)
    draw_sources(passes.frame, surface, cells, upload_sources(device, cells, cell), given)
    looks = device.buffer(_columns(first, end, word[:-1], 0 * first), "STORAGE")
    ranges = device.buffer(_columns(sources_of[:-1], sources_of[1:]), "STORAGE")
    return _Places(receiver, cell, taken, given, looks, ranges, int(word[-1]))


def upload_receivers(device: Device, cells: Cells, receiver: Index) -> tuple[Any, int]:
    """Buffer of triangles, weights and cells of some of the cells that take light, and how many there are."""
    place = cells.middle[receiver]
    return device.buffer(_columns(*place.T, cells.taking[receiver], 0 * receiver), "STORAGE"), len(receiver)


def upload_sources(device: Device, cells: Cells, cell: Index) -> tuple[Any, int]:
    """Buffer of cells that give light, and how many there are."""
    packed = cell % cells.side | (cell // cells.side << 16)
    return device.buffer(_columns(packed), "STORAGE"), len(cell)


def _columns(*columns: NDArray[np.integer]) -> Words:
    """(n, k) words; zeros where there are no rows."""
    made = np.stack(columns, axis=-1).astype(np.uint32)
    return made if len(made) else np.zeros((1, len(columns)), np.uint32)


def _numbered(device: Device, kept: NDArray[np.bool_]) -> Any:
    """Buffer of the number of each among those that are kept."""
    return device.buffer(_columns(np.maximum(np.cumsum(kept) - 1, 0)), "STORAGE")


def _copies(passes: _Passes, cells: Cells, source: Index, points: Any) -> Any:
    """Buffer of the places in gutters that show the cells.

    points : buffer of the sources
    """
    device, side = passes.device, cells.side
    y, x = source // side, source % side
    rows = [np.clip(y + by, 0, side - 1) * side for by in (-1, 0, 1)]
    first = [cells.copy_first[row + np.maximum(x - 1, 0)] for row in rows]
    end = [cells.copy_first[row + np.minimum(x + 1, side - 1) + 1] for row in rows]
    for row, outside in ((0, y == 0), (2, y == side - 1)):
        end[row] = np.where(outside, first[row], end[row])
    ranges = np.stack([part for pair in zip(first, end, strict=True) for part in pair], axis=-1)
    gutters = cells.copy if len(cells.copy) else np.zeros((1, 2), np.uint32)
    copies = space(device, _COPIES * len(source))
    bound = {"rows": device.buffer(_columns(*ranges.T), "STORAGE"), "gutters": device.buffer(gutters, "STORAGE")}
    passes.add("copies", len(source), {"source_points": points, **bound, "copies": copies})
    return copies
