"""Painted maps and eyes of a head as arrays, to be written to files for programs without painting shaders."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from dermis.base.errors import refuse
from dermis.frame.features.surface.painting import paint
from dermis.frame.features.surface.record import fill_eye_records
from dermis.frame.programs import program
from dermis.gpu import CommandList, Device, download, make_texture
from dermis.human.living.zones import eye_redness
from dermis.human.skin.painted import MAX_SIDE, MIN_SIDE, PaintedMaps
from dermis.human.skin.surface import painted_surface
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import UV_RADIUS_FALLOFF_RADIANS, UV_RADIUS_OF_BACK, EyeTextures
from dermis.mesh.head import Head
from dermis.scene.living import SkinState

EYE_PICTURE_SIDE = 1024
"""Side of the pictures [texels]; a texel of the iris is 0.025 mm wide."""


def paint_eye(device: Device, look: EyeLook, picture_side: int = EYE_PICTURE_SIDE) -> EyeTextures:
    """Paint pictures of an eye as seen from its front, for programs without the eye shader.

    picture_side : side of the pictures [pixels]
    """
    shader = program(device, "surface/painting/eye_pictures.wgsl")
    picture = shader.make_record("EyePicture", rim=UV_RADIUS_OF_BACK, falling=UV_RADIUS_FALLOFF_RADIANS)
    fill_eye_records(picture["eye"], look)
    textures = {
        name: make_texture(device, (picture_side, picture_side), "rgba32float")
        for name in ("colours", "normals")
    }
    frame = CommandList(device, timed=False)
    frame.compute("paint", shader, {"picture": picture, **textures}, (picture_side, picture_side))
    frame.submit()
    colours, normals = (download(device, texture)[..., :3] for texture in textures.values())
    return EyeTextures(np.ascontiguousarray(colours, np.float32), np.ascontiguousarray(normals, np.float32))


def paint_head(
    device: Device, head: Head, map_side: int, skin_state: SkinState | None = None
) -> tuple[Head, EyeTextures | None]:
    """Return a copy of a head with its painted maps as arrays, and pictures of the eyes if they are modelled.

    map_side : side of the painted maps, a power of two from 256 to 4096 [texels]
    skin_state : state and pulse of the skin, None for skin at rest
    """
    eyes = None if head.eyes is None else paint_eye(device, reddened(head.eyes.look, skin_state))
    return with_painted_maps(device, head, map_side, skin_state), eyes


def reddened(look: EyeLook, skin_state: SkinState | None) -> EyeLook:
    """Return the look of eyes whose white is reddened by a state of the skin."""
    redness = eye_redness(skin_state.weights) if skin_state else 0.0
    return replace(look, redness=min(look.redness + redness, 1.0)) if redness else look


def with_painted_maps(device: Device, head: Head, map_side: int, skin_state: SkinState | None = None) -> Head:
    """Return a copy of a head with its painted maps as arrays.

    Maps from files are kept. A head without painted maps is returned unchanged.

    map_side : side of the painted maps, a power of two from 256 to 4096 [texels]
    skin_state : state and pulse of the skin, None for skin at rest

    Raises DermisError for an invalid side.
    """
    if not MIN_SIDE <= map_side <= MAX_SIDE or map_side & (map_side - 1):
        expected = f"a power of two from {MIN_SIDE} to {MAX_SIDE}"
        refuse("size of the maps", expected, f"got {map_side}", "Take 1024, 2048 or 4096")
    maps = head.maps
    if not isinstance(maps, PaintedMaps):
        return head
    painted = paint.paint_arrays(
        device, painted_surface(head.mesh, head.control_rig.stencils), maps.look, map_side, skin_state
    )
    given_maps = {field.name: getattr(maps, field.name) for field in fields(painted)}
    if given_maps["normal"] is not None:
        painted = replace(painted, height=None)
    return replace(head, maps=replace(painted, **{k: v for k, v in given_maps.items() if v is not None}))
