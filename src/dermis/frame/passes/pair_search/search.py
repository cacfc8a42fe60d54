"""Translucent pairs of a surface, found on the device: tiles that face each other, cells, then places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.atlas.translucency.cells import Cells
from dermis.frame.passes.pair_search.facing import find_facing
from dermis.frame.passes.pair_search.passes import CellTables, Index, SearchPasses, starts
from dermis.frame.passes.pair_search.places import Places, draw_copies, draw_places, looks, places_of
from dermis.frame.passes.translucency_points import RECEIVER_BYTES, space
from dermis.gpu import Bindings, Device

_PAIR_BYTES = 12


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
    bound : what copies.wgsl and offsets.wgsl read besides
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
