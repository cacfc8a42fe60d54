"""A human's skin at rest: its maps without mips, painted by the device or found on disk."""

from __future__ import annotations

from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from dermis.base.disk import Arrays, find, stored
from dermis.base.progress import preparing
from dermis.frame.levels import HALVES
from dermis.frame.passes import each, map_mips, program
from dermis.frame.passes.painting.given import OWNER, SKIN, Given, key_of
from dermis.gpu import CommandList, Device, make_texture, upload
from dermis.gpu.textures import download
from dermis.human.skin.surface import Painting

_FOLDER = "painted"
_WORD = 4  # bytes
_MAPS = ("colour", "specular", "roughness")


class Resting(NamedTuple):
    """Textures of which only the finest mip is filled, a buffer of heights, and what movements add to them.

    moved : None where nobody asked for it
    """

    colour: map_mips.Mipped
    specular: map_mips.Mipped
    roughness: map_mips.Mipped
    heights: Any
    moved: Any


def resting(device: Device, given: Given, side: int, moving: bool = False) -> Resting:
    """The maps, found on disk by software adapters, which take a second to paint them.

    Only what a device paints first is kept there: who draws many people rarely comes back to one.

    moving : whether what movements add is asked for
    """
    if device.adapter.kind != "CPU":
        return painted(device, given, side)
    key, names = key_of(given, f"{device.adapter.name} {device.adapter.driver}"), [*_MAPS, "heights"]
    names += ["moved"] if moving else []
    found = find(_FOLDER, key, names)
    if found is not None:
        return _uploaded(device, found, side)
    made = painted(device, given, side)
    if device.shared("first painted", lambda: key) == key:
        stored(_FOLDER, key, names, lambda: _downloaded(device, made, moving))
    return made


@preparing("painting the skin")
def painted(device: Device, given: Given, side: int) -> Resting:
    """The maps, painted."""
    owned = {"paint": given.paint} | _owned(device, given, side)
    maps = {name: map_mips.empty(device, (side, side)) for name in _MAPS}
    heights = device.space(_WORD * (side + 2) ** 2)
    moved = make_texture(device, (side, side), HALVES, layers=2)
    into = {name: one.levels[0] for name, one in maps.items()} | {"heights": heights, "moved": moved}
    tables = {"tables": given.tables, "colour_tables": _colours(device, given)}
    frame = CommandList(device, timed=False)
    frame.compute("maps", program(device, SKIN), owned | tables | into, (side, side))
    frame.submit()
    return Resting(**maps, heights=heights, moved=moved)


def _owned(device: Device, given: Given, side: int) -> dict[str, Any]:
    """Buffers of the surface, and of whose each texel is; made once for all people with its layout."""
    surface = given.surface
    known = device.shared("painted surfaces", WeakKeyDictionary[Painting, dict[int, dict[str, Any]]])
    sides: dict[int, dict[str, Any]] = known.setdefault(surface, {})
    if side not in sides:
        sides.clear()
        made = {
            "vertices": device.buffer(surface.vertices, "STORAGE"),
            "triangles": device.buffer(surface.triangles, "STORAGE"),
            "owners": device.space(_WORD * side * side),
        }
        frame = CommandList(device, timed=False)
        frame.dispatch("maps", program(device, OWNER), {"paint": given.paint} | made, each(surface.count))
        frame.submit()
        sides[side] = made
    return sides[side]


def _colours(device: Device, given: Given) -> Any:
    nodes = given.colours.shape[1]
    texture = make_texture(device, (nodes, nodes), "rgba32float", layers=len(given.colours), use="map")
    for layer, table in enumerate(given.colours):
        upload(device, texture, np.dstack([table, np.ones((nodes, nodes, 1), np.float32)]), layer=layer)
    return texture


def _downloaded(device: Device, made: Resting, moving: bool) -> Arrays:
    found = {name: download(device, getattr(made, name).texture) for name in _MAPS}
    found["heights"] = np.frombuffer(device.handle.queue.read_buffer(made.heights), np.float32)
    if moving:
        found["moved"] = np.stack([download(device, made.moved, layer=layer) for layer in range(2)])
    return found


def _uploaded(device: Device, found: Arrays, side: int) -> Resting:
    maps = {name: map_mips.empty(device, (side, side)) for name in _MAPS}
    for name, one in maps.items():
        upload(device, one.texture, found[name])
    moved = None
    if "moved" in found:
        moved = make_texture(device, (side, side), HALVES, layers=2)
        for layer, texels in enumerate(found["moved"]):
            upload(device, moved, texels, layer=layer)
    return Resting(**maps, heights=device.buffer(found["heights"], "STORAGE"), moved=moved)
