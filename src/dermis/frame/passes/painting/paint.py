"""Colour, gloss and relief of a human's skin, painted by the device."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.levels import HALVES
from dermis.frame.passes import each, map_mips, program
from dermis.frame.passes.painting.expression import Face, make_face
from dermis.gpu import Device, Frame, make_texture, upload
from dermis.gpu.program import Resources
from dermis.gpu.shader_types import struct_dtype
from dermis.gpu.textures import download
from dermis.human.skin import face, textures
from dermis.human.skin.colours import colour_tables
from dermis.human.skin.look import SkinLook
from dermis.human.skin.surface import Painting
from dermis.mesh.maps import Maps
from dermis.scene.skin import Skin

_MOST_TRIANGLES = 1 << 20  # that painted_surface.wgsl has bits for
_TEXEL = 4  # floats of a vector, which the tables' size is a multiple of
LEAST, MOST = 256, 4096
"""Sides of the maps [texels]."""


class PaintedTextures(NamedTuple):
    """Textures with all their mips, as skin.wgsl of the frame reads them."""

    colour: Any
    specular: Any
    roughness: Any
    relief: Any
    face: Face | None


class PaintedTexels(NamedTuple):
    """What is painted, as skin.wgsl of the painting keeps it.

    colour, specular, roughness : (n, n, 4) with how much there is of pores and of furrows, and the binary
        logarithm of the mm in a unit of uv, in the channels beside
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
    (resting, specular, roughness), heights, moved = _paint(device, painting, look, side)
    colour = map_mips.empty(device, (side, side)) if moving else resting
    frame = Frame(device, timed=False)
    for one in (specular, roughness) if moving else (colour, specular, roughness):
        map_mips.halve(frame, one)
    frame.submit()
    gloss = specular.texture, roughness.texture
    if not moving:
        relief = map_mips.relief_of(device, [heights], (side, side), side)
        return PaintedTextures(colour.texture, *gloss, relief, None)
    raised = map_mips.empty(device, (side, side))
    face = make_face(device, resting.texture, heights, moved, (colour, raised))
    return PaintedTextures(colour.texture, *gloss, raised.texture, face)


def painted_maps(device: Device, painting: Painting, look: SkinLook, side: int) -> Maps:
    """The same as arrays, for what reads no textures; without the detail that is finer than maps.

    Heights run out beside the charts, where nothing is drawn.
    """
    found = painted_texels(device, painting, look, side)
    rho_s = _usual_strength() * found.specular[..., 0]
    return Maps(
        colour=np.ascontiguousarray(found.colour[..., :3]),
        height=found.height_mm,
        specular=np.clip(rho_s, 0.0, 1.0),
        roughness=np.ascontiguousarray(found.roughness[..., 0]),
    )


def painted_texels(device: Device, painting: Painting, look: SkinLook, side: int) -> PaintedTexels:
    """All that is painted, as arrays."""
    textures, heights, _ = _paint(device, painting, look, side)
    colour, specular, roughness = (download(device, one.texture).astype(np.float32) for one in textures)
    raw = np.frombuffer(device.handle.queue.read_buffer(heights), np.float32)
    height = np.ascontiguousarray(raw.reshape(side + 2, side + 2)[1:-1, 1:-1])
    return PaintedTexels(colour, specular, roughness, height)


def _paint(
    device: Device, painting: Painting, look: SkinLook, side: int
) -> tuple[list[map_mips.Mipped], Any, Any]:
    """Colour, specular and roughness without mips, a buffer of heights, and what movements add to them."""
    if painting.count >= _MOST_TRIANGLES:
        came = f"{painting.count:,} came"
        refuse("painted skin", f"fewer than {_MOST_TRIANGLES:,} triangles", came, "Subdivide less")
    shader = program(device, "painting/skin.wgsl")
    bound = {**_surface(device, painting, look, side), **_tables(device, look)}
    made = [map_mips.empty(device, (side, side)) for _ in range(3)]
    heights = device.buffer(np.zeros((side + 2) ** 2, np.float32), "STORAGE")
    moved = make_texture(device, (side, side), HALVES, layers=2)
    stored = zip(("colour", "specular", "roughness"), (one.levels[0] for one in made), strict=True)
    frame = Frame(device, timed=False)
    owner = {name: bound[name] for name in ("paint", "vertices", "triangles", "owners")}
    frame.dispatch("maps", program(device, "painting/owner.wgsl"), owner, each(painting.count))
    frame.compute("maps", shader, bound | dict(stored) | {"heights": heights, "moved": moved}, (side, side))
    frame.submit()
    return made, heights, moved


def _usual_strength() -> float:
    """rho_s that a factor of 1 stands for."""
    return float(Skin.model_fields["rho_s"].default)


def _surface(device: Device, painting: Painting, look: SkinLook, side: int) -> Resources:
    shader = program(device, "painting/skin.wgsl")
    names = set(struct_dtype(shader.source.text, "Paint").names or ()) & set(vars(look))
    numbers = {name: getattr(look, name) for name in names}
    return {
        "paint": shader.record("Paint", side=side, usual_strength=_usual_strength(), **numbers),
        "vertices": device.buffer(painting.vertices, "STORAGE"),
        "triangles": device.buffer(painting.triangles, "STORAGE"),
        "owners": device.buffer(np.zeros(side * side, np.uint32), "STORAGE"),
    }


def _tables(device: Device, look: SkinLook) -> Resources:
    folds = face.folds()
    tables = [textures.noise_table(), textures.dot_table(), face.zones(), folds.curves, folds.knots]
    tables += [folds.first.astype(np.float32), face.hairline()]
    data = np.concatenate([table.ravel() for table in tables])
    padded = np.pad(data, (0, -len(data) % _TEXEL))
    colours = colour_tables(look)
    nodes = colours.shape[1]
    texture = make_texture(device, (nodes, nodes), "rgba32float", layers=len(colours), use="map")
    for layer, table in enumerate(colours):
        upload(device, texture, np.dstack([table, np.ones((nodes, nodes, 1), np.float32)]), layer=layer)
    return {"tables": device.buffer(padded, "STORAGE"), "colour_tables": texture}
