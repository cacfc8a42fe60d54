"""Textures that dermis paints for the skin, eyes and teeth of a person, for a path tracer."""

from __future__ import annotations

from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.person.person import SkinTextures
from dermis.base.errors import refuse
from dermis.frame.features.surface.painting import paint
from dermis.frame.programs import program
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download, make_texture
from dermis.human.skin.look import SkinLook
from dermis.human.skin.painted import PaintedMaps
from dermis.human.skin.surface import painted_surface
from dermis.human.skin.textures import TILE_LENGTH_MM, detail_heights_mm
from dermis.mesh.eyeball import SCLERA_MM, iris_plane_mm
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
_PART_TEXTURE_SIDE = 1024
"""Side of the textures of eyes and teeth [texels]."""
_TEXTURED_PARTS = ("iris", "white", "upper teeth", "lower teeth")  # in the order of person_textures.wgsl
_MIN_ROUGHNESS = 0.05
_LOG2_MM_PER_UV_RANGE = 5.0, 14.0  # binary logarithms of mm per unit of uv
_TURN_STEP = np.pi / 4.0  # as in skin.wgsl [rad]
_SETTINGS = Settings(size=(16, 16), atlas=64, samples=1, shadow_size=64)


def person_textures(renderer: Renderer, scene: Scene, texture_side: int = 2048) -> SkinTextures:
    """Return the textures of a person in the rest pose: colour, roughness and height of skin, eyes and teeth.

    texture_side : side of the skin's maps, a power of two from 256 to 4096 [texel]

    Raises DermisError for heads without painted skin.
    """
    head = scene.head
    if not isinstance(head.maps, PaintedMaps) or head.eyes is None:
        refuse(head.name, "a parametric human with painted skin", "it is another head", "Load human")
    return renderer.reopening_device.run(
        partial(_paint_textures, renderer, scene, head.maps.look, texture_side)
    )


def _paint_textures(renderer: Renderer, scene: Scene, look: SkinLook, texture_side: int) -> SkinTextures:
    head = scene.head
    surface, device = painted_surface(head.mesh, head.control_rig.stencils), renderer.device
    colour, gloss, rough, height = paint.paint_raw_arrays(device, surface, look, texture_side)
    height = height + _detail_heights_mm(gloss[..., 1], rough[..., 1], gloss[..., 2], gloss[..., 3])
    roughness = np.maximum(scene.skin.roughness_factor * rough[..., 0], _MIN_ROUGHNESS)
    strength = np.ascontiguousarray(scene.skin.specular_strength * gloss[..., 0])
    radius = float(np.sqrt(SCLERA_MM**2 - iris_plane_mm() ** 2))
    iris, white, *teeth = (
        _part_texture(renderer, scene, part, radius) for part in range(len(_TEXTURED_PARTS))
    )
    colour = np.ascontiguousarray(colour[..., :3])
    return SkinTextures(colour, roughness, strength, height, iris, radius, white, (teeth[0], teeth[1]))


def _detail_heights_mm(pores: Floats, lines: Floats, log2_mm_per_uv: Floats, tension: Floats) -> Floats:
    """Return the heights (n, n) of pores and fine lines, which are missing in the head's height map [mm].

    The heights are the weighted sum of a pattern of pores and a pattern of lines, tiled as in skin.wgsl.

    pores, lines : (n, n) weights of the two patterns [-]
    log2_mm_per_uv : (n, n) binary logarithm of the length on the surface per unit of uv [mm]
    tension : (n, n) angle of the tension lines, from +u towards the bottom of the map [rad]
    """
    side = len(pores)
    density = np.clip(log2_mm_per_uv, *_LOG2_MM_PER_UV_RANGE)  # undefined outside the charts
    octave, scale_blend = _whole_and_blend(density - np.log2(TILE_LENGTH_MM), 0.1)
    turn, turn_blend = _whole_and_blend(tension / _TURN_STEP, 0.15)
    uv = (np.arange(side, dtype=np.float32) + 0.5) / side
    heights = np.zeros((side, side), np.float32)
    for next_scale, next_turn in product((0, 1), (0, 1)):
        weight = np.abs(1 - next_scale - scale_blend) * np.abs(1 - next_turn - turn_blend)
        tiles, angle = np.exp2(octave + next_scale), _TURN_STEP * (turn + next_turn)
        # Slopes stay the same: the height of a tile is proportional to its length.
        mm = np.exp2(density) / tiles / TILE_LENGTH_MM
        c, s = np.cos(angle), np.sin(angle)
        u, v = tiles * (c * uv + s * uv[:, None]), tiles * (c * uv[:, None] - s * uv)
        pits, nets = (_sample_tile(tile - np.median(tile), u, v) for tile in detail_heights_mm())
        heights += (weight * mm * (pores * pits + lines * nets)).astype(np.float32)
    return heights


def _whole_and_blend(level: Floats, half_width: float) -> tuple[Floats, Floats]:
    """Return the integer part of levels, and the weight of the next integer level, as in skin.wgsl.

    half_width : half the width of the range around a fractional part of 0.5 in which both levels contribute
    """
    whole = np.floor(level)
    blend = np.clip((level - whole - 0.5 + half_width) / (2.0 * half_width), 0.0, 1.0)
    return whole, blend * blend * (3.0 - 2.0 * blend)


def _sample_tile(periodic_pattern: Floats, u: Any, v: Any) -> Floats:
    """Return a periodic pattern at coordinates u, v (n, n), interpolated bilinearly.

    periodic_pattern : (rows, columns) one period of the pattern
    u, v : coordinates in units of the period
    """
    from scipy.ndimage import map_coordinates

    rows, columns = periodic_pattern.shape
    coordinates = np.stack([np.mod(v, 1.0) * rows - 0.5, np.mod(u, 1.0) * columns - 0.5])
    return np.asarray(map_coordinates(periodic_pattern, coordinates, order=1, mode="grid-wrap"), np.float32)


def _part_texture(renderer: Renderer, scene: Scene, part_index: int, iris_radius_mm: float) -> Floats:
    """Return the painted texture (n, n, 3) of a part of the head, such as the iris or the upper teeth.

    part_index : index of the part in person_textures.wgsl
    iris_radius_mm : radius of the iris [mm]
    """
    inputs, device = renderer.prepare(scene, _SETTINGS), renderer.device
    shader = program(device, Path(__file__).parent / "person_textures.wgsl")
    texture = make_texture(device, (_PART_TEXTURE_SIDE, _PART_TEXTURE_SIDE), "rgba32float")
    radii = {"iris_radius_mm": iris_radius_mm, "eyeball_radius_mm": SCLERA_MM}
    request = shader.make_record("PartRequest", part=part_index, **radii)
    eye = inputs.view["eyes"][0]
    for name in ("eumelanin", "pupil_mm", "redness", "seed"):
        request["eye"][name] = eye[name]
    frame = CommandList(device, timed=False)
    bindings = {**inputs.bindings, "part_request": request, "part_texture": texture}
    frame.compute("paint", shader, bindings, (_PART_TEXTURE_SIDE, _PART_TEXTURE_SIDE))
    frame.submit()
    return np.ascontiguousarray(download(device, texture)[..., :3], np.float32)
