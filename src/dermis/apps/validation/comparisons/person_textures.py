"""What the frame paints on a person, as pictures for a path tracer."""

from __future__ import annotations

from functools import partial
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
from dermis.mesh.eyeball import SCLERA_MM, iris_mm
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
_TEXTURE_SIDE = 1024
"""Of the pictures of eyes and teeth [texels]."""
_PARTS = ("iris", "white", "upper teeth", "lower teeth")  # numbered as in person_paint.wgsl
_MIN_ROUGHNESS = 0.05
_DENSITY_RANGE = 5.0, 14.0  # binary logarithms of mm in a unit of uv
_SETTINGS = Settings(size=(16, 16), atlas=64, samples=1, shadow_size=64)


def person_textures(renderer: Renderer, scene: Scene, side: int = 2048) -> SkinTextures:
    """Return the colours, roughness and relief that frames of the scene show, at rest.

    side : of the maps of the skin, a power of two from 256 to 4096 [texels]

    Raises DermisError for heads that are no painted people.
    """
    head = scene.head
    if not isinstance(head.maps, PaintedMaps) or head.eyes is None:
        refuse(head.name, "a head of the parametric human with painted skin", "it is none", "Load human")
    return renderer.reopening_device.run(partial(_paint_textures, renderer, scene, head.maps.look, side))


def _paint_textures(renderer: Renderer, scene: Scene, look: SkinLook, side: int) -> SkinTextures:
    head = scene.head
    surface, device = painted_surface(head.mesh, head.control.stencils), renderer.device
    colour, gloss, rough, height = paint.paint_raw_arrays(device, surface, look, side)
    height = height + _detail_heights_mm(gloss[..., 1], rough[..., 1], gloss[..., 2])
    roughness = np.maximum(scene.skin.smoothing * rough[..., 0], _MIN_ROUGHNESS)
    reach = float(np.sqrt(SCLERA_MM**2 - iris_mm() ** 2))
    iris, white, upper, lower = (_eye_texture(renderer, scene, part, reach) for part in range(len(_PARTS)))
    return SkinTextures(np.ascontiguousarray(colour[..., :3]), roughness, height, iris, reach, white, (upper, lower))


def _detail_heights_mm(pores: Floats, furrows: Floats, density: Floats) -> Floats:
    """Return (n, n) heights of detail finer than the maps, tiled as skin.wgsl does [mm].

    pores, furrows : how much there is of each
    density : binary logarithm of the mm in a unit of uv
    """
    side = len(pores)
    density = np.clip(density, *_DENSITY_RANGE)  # beside the charts it may be anything
    level = density - np.log2(TILE_LENGTH_MM)
    whole = np.floor(level)
    part = np.clip((level - whole - 0.4) / 0.2, 0.0, 1.0)
    part = part * part * (3.0 - 2.0 * part)
    uv = (np.arange(side, dtype=np.float32) + 0.5) / side
    found = np.zeros((side, side), np.float32)
    for further, share in ((0, 1.0 - part), (1, part)):
        tiles = np.exp2(whole + further)
        # Heights keep their slopes: a tile that is laid smaller or larger is as much lower or higher.
        mm = np.exp2(density) / tiles / TILE_LENGTH_MM
        pits, nets = (
            _sample_tile(tile - np.median(tile), tiles * uv, tiles * uv[:, None]) for tile in detail_heights_mm()
        )
        found += (share * mm * (pores * pits + furrows * nets)).astype(np.float32)
    return found


def _sample_tile(tile: Floats, u: Any, v: Any) -> Floats:
    """Return a periodic tile at (n, n) places, in units of tiles, interpolated bilinearly."""
    from scipy.ndimage import map_coordinates

    rows, columns = tile.shape
    places = np.stack([np.mod(v, 1.0) * rows - 0.5, np.mod(u, 1.0) * columns - 0.5])
    return np.asarray(map_coordinates(tile, places, order=1, mode="grid-wrap"), np.float32)


def _eye_texture(renderer: Renderer, scene: Scene, part: int, reach: float) -> Floats:
    """Return the picture (n, n, 3) of eyes or teeth."""
    inputs, device = renderer.prepare(scene, _SETTINGS), renderer.device
    shader = program(device, Path(__file__).parent / "person_paint.wgsl")
    painted = make_texture(device, (_TEXTURE_SIDE, _TEXTURE_SIDE), "rgba32float")
    asked = shader.record("Asked", part=part, reach_mm=reach, ball_mm=SCLERA_MM)
    eye = inputs.view["eyes"][0]
    for name in ("eumelanin", "pupil_mm", "redness", "seed"):
        asked["eye"][name] = eye[name]
    frame = CommandList(device, timed=False)
    frame.compute("paint", shader, {**inputs.bindings, "asked": asked, "painted": painted}, (_TEXTURE_SIDE, _TEXTURE_SIDE))
    frame.submit()
    return np.ascontiguousarray(download(device, painted)[..., :3], np.float32)
