"""Painted maps of a human's skin: colour, gloss and relief at rest, and what expressions change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from dermis.base.disk import Arrays, array_key, find, stored
from dermis.base.errors import refuse
from dermis.base.progress import preparing
from dermis.frame.features.surface import mips as map_mips
from dermis.frame.programs import FEATURES, HALVES, each, program, shader_folders
from dermis.gpu import (
    Bindings,
    Buffer,
    CommandList,
    Device,
    Graph,
    MutableBindings,
    Record,
    Recorder,
    Texture,
    make_texture,
    upload,
)
from dermis.gpu.program import source_of
from dermis.gpu.shader_types import record_of, struct_dtype
from dermis.gpu.textures import download
from dermis.gpu.wgsl_source import Member
from dermis.human.skin import face, textures
from dermis.human.skin.face import AMOUNTS, DEGREES, FOLDING, sizes
from dermis.human.skin.look import SkinLook
from dermis.human.skin.painted import colour_tables
from dermis.human.skin.surface import Painting
from dermis.human.skin.textures import DOTS, GROUNDS, NOISES, TILE_MM, WANDERING, noise_table
from dermis.mesh.maps import Maps
from dermis.scene.skin import USUAL_RHO_S

_NAMES: dict[str, Sequence[str]] = {
    "noises": [noise.name for noise in NOISES],
    "dots": [dots.name for dots in DOTS],
    "amounts": list(AMOUNTS),
    "grounds": list(GROUNDS),
}
SKIN, OWNER = "surface/painting/skin.wgsl", "surface/painting/owner.wgsl"
_MOST_TRIANGLES = 1 << 20  # that painted_surface.wgsl has bits for
_TEXEL = 4  # floats of a vector
_FOLDER = "painted"
_WORD = 4  # bytes
_MAPS = ("colour", "specular", "roughness")
_FOLDING = FOLDING + 1  # numbers of the shader's record, the last of which is the flush


def texture_names() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """Lists of the names of noises, dots, amounts and grounds, numbered in order."""
    return {name: _members(names) for name, names in _NAMES.items()}


def painting_numbers() -> dict[str, float]:
    """Numbers that the shaders fill in."""
    names = {name: len(names) for name, names in _NAMES.items()}
    own = {"degrees": float(DEGREES), "tile_mm": TILE_MM, "folding": FOLDING}
    rows = {"noise_rows": len(noise_table()), "wander_rows": WANDERING, "amount_rows": len(AMOUNTS) // 4}
    return own | names | sizes() | rows


def _members(names: Sequence[str]) -> Callable[[], Sequence[Member]]:
    return lambda: [Member(name, Path()) for name in names]


class Given(NamedTuple):
    """What the shaders read.

    paint, tables : their records of numbers
    colours : (2, n, n, 3) of the face's skin and of the lips'
    """

    paint: Record
    tables: NDArray[np.float32]
    colours: NDArray[np.float32]
    surface: Painting


def given_for(surface: Painting, look: SkinLook, side: int) -> Given:
    """What maps of a look are painted from.

    side : of the maps [texels]

    Raises DermisError for too many triangles.
    """
    if surface.count >= _MOST_TRIANGLES:
        came = f"{surface.count:,} came"
        refuse("painted skin", f"fewer than {_MOST_TRIANGLES:,} triangles", came, "Subdivide less")
    text = _text(SKIN)
    names = set(struct_dtype(text, "Paint").names or ()) & set(vars(look))
    paint = record_of(text, "Paint", side=side, **{name: getattr(look, name) for name in names})
    tables = np.ndarray((), struct_dtype(text, "Tables"), _face(look.recession))
    return Given(paint, tables, colour_tables(look), surface)


def key_of(given: Given, driver: str) -> str:
    """The key of what a driver's shaders paint."""
    form = "\n".join((driver, _text(SKIN), _text(OWNER)))
    records = (np.frombuffer(record.tobytes(), np.uint8) for record in (given.paint, given.tables))
    return array_key([*records, given.colours, given.surface.vertices, given.surface.triangles], form)


@cache
def _text(shader: str) -> str:
    return source_of(FEATURES / shader, shader_folders()).text


def _face(recession: float) -> bytes:
    """Noises, dots, zones, folds and the edge of the hair, as spot.wgsl reads them."""
    folds, edge = face.folds(), face.hairline(recession)
    ends = np.column_stack([folds.first[:-1], folds.first[1:] - 1]).astype(np.float32)
    curves = np.pad(np.hstack([folds.curves, ends]), ((0, 0), (0, _TEXEL - 2)))
    hairline = np.pad(np.column_stack([edge, np.append(edge[1:], edge[-1])]), ((0, 0), (0, _TEXEL - 2)))
    tables = (
        textures.noise_table(),
        textures.dot_table(),
        face.zones(recession),
        curves,
        folds.knots,
        hairline,
    )
    return b"".join(table.tobytes() for table in tables)


class Resting(NamedTuple):
    """Textures of which only the finest mip is filled, a buffer of heights, and what movements add to them.

    moved : None unless requested
    """

    colour: map_mips.Mipped
    specular: map_mips.Mipped
    roughness: map_mips.Mipped
    heights: Buffer
    moved: Texture | None


def resting(device: Device, given: Given, side: int, moving: bool = False) -> Resting:
    """The maps, found on disk by software adapters, which take a second to paint them.

    Only what a device paints first is kept there: who draws many people rarely comes back to one.

    moving : whether to include what movements add
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
    owned: Bindings = {"paint": given.paint, **_owned(device, given, side)}
    maps = {name: map_mips.empty(device, (side, side)) for name in _MAPS}
    heights = device.space(_WORD * (side + 2) ** 2)
    moved = make_texture(device, (side, side), HALVES, layers=2)
    into = {name: one.levels[0] for name, one in maps.items()}
    tables: Bindings = {
        "tables": given.tables,
        "colour_tables": _colours(device, given),
        "heights": heights,
        "moved": moved,
    }
    frame = CommandList(device, timed=False)
    frame.compute("maps", program(device, SKIN), {**owned, **tables, **into}, (side, side))
    frame.submit()
    return Resting(**maps, heights=heights, moved=moved)


def _owned(device: Device, given: Given, side: int) -> dict[str, Buffer]:
    """Buffers of the surface, and of whose each texel is; made once for all people with its layout."""
    surface = given.surface
    known = device.shared("painted surfaces", WeakKeyDictionary[Painting, dict[int, dict[str, Buffer]]])
    sides: dict[int, dict[str, Buffer]] = known.setdefault(surface, {})
    if side not in sides:
        sides.clear()
        made = {
            "vertices": device.buffer(surface.vertices, "STORAGE"),
            "triangles": device.buffer(surface.triangles, "STORAGE"),
            "owners": device.space(_WORD * side * side),
        }
        frame = CommandList(device, timed=False)
        bound: Bindings = {"paint": given.paint, **made}
        frame.dispatch("maps", program(device, OWNER), bound, each(surface.count))
        frame.submit()
        sides[side] = made
    return sides[side]


def _colours(device: Device, given: Given) -> Texture:
    nodes = given.colours.shape[1]
    texture = make_texture(device, (nodes, nodes), "rgba32float", layers=len(given.colours), use="map")
    for layer, table in enumerate(given.colours):
        upload(device, texture, np.dstack([table, np.ones((nodes, nodes, 1), np.float32)]), layer=layer)
    return texture


def _downloaded(device: Device, made: Resting, moving: bool) -> Arrays:
    found = {name: download(device, getattr(made, name).texture) for name in _MAPS}
    found["heights"] = np.frombuffer(device.handle.queue.read_buffer(made.heights), np.float32)
    if moving and made.moved is not None:
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


@dataclass(frozen=True, eq=False)
class Face:
    """What expressions change, by the names in the shaders.

    bound : of expression.wgsl
    heights : buffer that relief is taken from
    colour, relief : textures with all their mips
    """

    bound: MutableBindings
    heights: Buffer
    colour: map_mips.Mipped
    relief: map_mips.Mipped


def make_face(
    device: Device,
    resting: Texture,
    at_rest: Buffer,
    moved: Texture,
    into: tuple[map_mips.Mipped, map_mips.Mipped],
) -> Face:
    """Space for a face that moves.

    resting, at_rest, moved : colour and heights at rest, and what full movements do to them
    into : textures of colour and relief
    """
    colour, relief = into
    heights = device.space(at_rest.size)
    bound: MutableBindings = {"resting": resting, "at_rest": at_rest, "moved": moved, "heights": heights}
    return Face(bound | {"colour": colour.levels[0]}, heights, colour, relief)


def draw_expression(graph: Graph, face: Face, made: NDArray[np.float32]) -> None:
    """Change colour and relief.

    made : (9,) how far each movement is made, see `movements`
    """
    shader, side = program(graph.device, "surface/painting/expression.wgsl"), face.colour.size[0]
    folding = made[:_FOLDING].reshape(2, 4)
    record = shader.record("Expression", folding=folding, pressed=made[_FOLDING], side=side)
    graph.compute("maps", shader, face.bound | {"expression": record}, (side, side))
    graph.repeat(_maps, face)


def _maps(graph: Recorder, face: Face) -> None:
    """Mips of the colour, and the relief from the heights."""
    map_mips.halve(graph, face.colour)
    map_mips.relieve(graph, face.relief, face.heights)


class PaintedTextures(NamedTuple):
    """Textures with all their mips, as skin.wgsl of the frame reads them."""

    colour: Texture
    specular: Texture
    roughness: Texture
    relief: Texture
    face: Face | None


class PaintedTexels(NamedTuple):
    """What is painted, as skin.wgsl of the painting keeps it.

    colour, specular, roughness : (n, n, 4); beside the specular how much there is of pores, and the binary
        logarithm of the mm in a unit of uv; beside the roughness furrows, and shares of melanin and of blood
    height_mm : (n, n)
    """

    colour: NDArray[np.float32]
    specular: NDArray[np.float32]
    roughness: NDArray[np.float32]
    height_mm: NDArray[np.float32]


def draw(
    device: Device, painting: Painting, look: SkinLook, side: int, moving: bool = False
) -> PaintedTextures:
    """Paint the maps.

    side : of the maps [texels]
    moving : whether expressions change colour and relief: `expression.draw` fills these in then
    """
    made = resting(device, given_for(painting, look, side), side, moving)
    colour = map_mips.empty(device, (side, side)) if moving else made.colour
    frame = CommandList(device, timed=False)
    for one in (made.specular, made.roughness) if moving else (colour, made.specular, made.roughness):
        map_mips.halve(frame, one)
    frame.submit()
    gloss = made.specular.texture, made.roughness.texture
    if not moving or made.moved is None:
        relief = map_mips.relief_of(device, [made.heights], (side, side), side)
        return PaintedTextures(colour.texture, *gloss, relief, None)
    raised = map_mips.empty(device, (side, side))
    face = make_face(device, made.colour.texture, made.heights, made.moved, (colour, raised))
    return PaintedTextures(colour.texture, *gloss, raised.texture, face)


def painted_maps(device: Device, painting: Painting, look: SkinLook, side: int) -> Maps:
    """The same as arrays, for what reads no textures; without the detail that is finer than maps.

    Heights run out beside the charts, where nothing is drawn.
    """
    found = painted_texels(device, painting, look, side)
    rho_s = USUAL_RHO_S * found.specular[..., 0]
    return Maps(
        colour=np.ascontiguousarray(found.colour[..., :3]),
        height=found.height_mm,
        specular=np.clip(rho_s, 0.0, 1.0),
        roughness=np.ascontiguousarray(found.roughness[..., 0]),
    )


def painted_texels(device: Device, painting: Painting, look: SkinLook, side: int) -> PaintedTexels:
    """All that is painted, as arrays."""
    made = painted(device, given_for(painting, look, side), side)
    textures = made.colour, made.specular, made.roughness
    colour, specular, roughness = (download(device, one.texture).astype(np.float32) for one in textures)
    raw = np.frombuffer(device.handle.queue.read_buffer(made.heights), np.float32)
    height = np.ascontiguousarray(raw.reshape(side + 2, side + 2)[1:-1, 1:-1])
    return PaintedTexels(colour, specular, roughness, height)
