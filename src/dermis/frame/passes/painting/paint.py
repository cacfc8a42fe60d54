"""Colour, gloss and relief of a human's skin, painted by the device."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.passes import map_mips
from dermis.frame.passes.painting.expression import Face, make_face
from dermis.frame.passes.painting.given import given_for
from dermis.frame.passes.painting.resting import painted, resting
from dermis.gpu import CommandList, Device
from dermis.gpu.textures import download
from dermis.human.skin.look import SkinLook
from dermis.human.skin.surface import Painting
from dermis.mesh.maps import Maps
from dermis.scene.skin import USUAL_RHO_S

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
    if not moving:
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
