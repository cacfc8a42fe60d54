"""Takes the passes of a search for translucent pairs, and reads what they count."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.cells import BESIDE, TILE, Cells
from dermis.frame.passes import each, program
from dermis.gpu import CommandList, Constants, Device

Words = NDArray[np.uint32]
Index = NDArray[np.int64]
_MOST_BLOCKS = 40  # along a side


@dataclass(frozen=True, eq=False)
class CellTables:
    """What all searches on an atlas read of its cells, as buffers.

    every : all tiles, as facing.wgsl reads them
    triangle_first, triangles : as tiles.wgsl reads them
    gutters : as copies.wgsl reads it
    """

    every: Any
    triangle_first: Any
    triangles: Any
    gutters: Any


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

    def add(self, name: str, count: int, bound: dict[str, Any], constants: Constants = ()) -> None:
        """A pass of a number of invocations; its shader is told of the search."""
        shader = program(self.device, f"pair_search/{name}.wgsl", constants)
        record = shader.record("Search", **self._told, count=count)
        self.frame.dispatch("pair search", shader, {**bound, "search": record}, each(count))

    def read(self, buffer: Any, count: int) -> Index:
        """The first words that the passes so far leave there."""
        self.frame.submit()
        self.frame = CommandList(self.device, timed=False)
        words = np.frombuffer(self.device.handle.queue.read_buffer(buffer), np.uint32)
        return words[:count].astype(np.int64)

    def upload(self, *columns: NDArray[np.integer]) -> Any:
        """Buffer of a table of words, with zeros where there are no rows."""
        return upload_words(self.device, *columns)


def upload_words(device: Device, *columns: NDArray[np.integer]) -> Any:
    """Buffer of a table of words, given by its columns; one row of zeros where there are none."""
    table = np.zeros((max(1, len(columns[0])), len(columns)), np.uint32)
    for k, column in enumerate(columns):
        table[: len(column), k] = column
    return device.buffer(table, "STORAGE")


def starts(counts: Index) -> Index:
    """(n + 1,) where each of some lists begins in all of them, and where the last one ends."""
    return np.concatenate([[0], np.cumsum(counts)])
