"""Surface points under pixel centres, and the light that enters the skin at given points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.atlas.textures import AtlasTextures, packed_texels
from dermis.frame.features.irradiance import irradiance
from dermis.frame.features.shadows import shadows
from dermis.frame.features.shape import shape
from dermis.frame.features.surface import texels as surface_texels
from dermis.frame.features.surface.texels import make_surfaces
from dermis.frame.features.visibility import layers as visibility_buffer
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download, make_texture
from dermis.gpu.textures import texture_from
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class SurfacePoints:
    """Points of the head under the centres of pixels.

    mask : (h, w) pixels that see it
    triangle, barycentric : (n,) and (n, 3) of those pixels, row by row
    """

    mask: NDArray[np.bool_]
    triangle: Index
    barycentric: Floats


def surface_points(renderer: Renderer, scene: Scene, settings: Settings) -> SurfacePoints:
    """The points that an image of one sample for each pixel shows.

    settings : technique and samples do not matter
    """
    return renderer.kept_open.run(partial(_surface_points, renderer, scene, settings))


def _surface_points(renderer: Renderer, scene: Scene, settings: Settings) -> SurfacePoints:
    single = settings.model_copy(update={"samples": 1, "technique": "none"})
    inputs = renderer.prepare(scene, single)
    frame = CommandList(renderer.device)
    made = inputs.resources
    shape.draw(frame, made.shape.shape, inputs.motion)
    visibility_buffer.draw(frame, made.visibility, inputs.camera, made.head)
    frame.submit()
    renderer.graph.forget()  # it does not know of this frame
    seen = download(renderer.device, made.visibility.texture).astype(np.int64)
    mask = seen > 0
    triangle = seen[mask] - 1
    return SurfacePoints(mask, triangle, _barycentric(scene, inputs.view, triangle, mask))


def _barycentric(scene: Scene, view: NDArray[np.void], triangle: Index, mask: NDArray[np.bool_]) -> Floats:
    """Weights of where rays through the middles of pixels meet their triangles, as in shade.wgsl."""
    height, width = mask.shape
    rows, columns = np.nonzero(mask)
    x, y = 2.0 * (columns + 0.5) / width - 1.0, 1.0 - 2.0 * (rows + 0.5) / height
    names = ("forward", "right", "up", "eye", "shift")
    forward, right, up, eye, shift = (view[name].astype(np.float64) for name in names)
    x, y = x + shift[0], y + shift[1]
    ray = forward + x[:, None] * right + y[:, None] * up
    mesh, motion = scene.head.mesh, scene.motion
    places = mesh.positions if motion is None else scene.head.control.points_mm(motion)[mesh.point]
    a, b, c = (places[mesh.triangles[triangle, k]].astype(np.float64) - eye for k in range(3))
    sides = (np.cross(b, c), np.cross(c, a), np.cross(a, b))
    weights = np.stack([(side * ray).sum(axis=1) for side in sides], axis=-1)
    weights *= np.sign(weights.sum(axis=1, keepdims=True))  # triangles seen from behind
    weights = np.clip(weights, 0.0, None)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))


def irradiance_at(
    renderer: Renderer, scene: Scene, settings: Settings, triangle: Index, barycentric: Floats
) -> Floats:
    """(n, 3) light that enters the skin at points, times the colour's share before scattering.

    scene : without maps and environment, whose texels and occlusion are looked up by place in the atlas, as
        light from other skin is, which is therefore left out
    triangle, barycentric : (n,) and (n, 3)
    """
    side = max(1, int(np.ceil(np.sqrt(len(triangle)))))
    places = np.full(side * side, -1, np.int64)
    places[: len(triangle)] = triangle
    weights = np.zeros((side * side, 2))
    weights[: len(triangle)] = barycentric[:, 1:]
    records = packed_texels(places.reshape(side, side), np.rint(65535 * weights).reshape(side, side, 2))
    return renderer.kept_open.run(partial(_lit, renderer, scene, settings, records))[: len(triangle)]


def _lit(renderer: Renderer, scene: Scene, settings: Settings, records: NDArray[np.uint32]) -> Floats:
    """(n * n, 3) light at the (n, n) places of an atlas."""
    device, side = renderer.device, len(records)
    inputs = renderer.prepare(scene, settings.model_copy(update={"interreflection": False}))
    first = inputs.layouts[0]
    listed = AtlasTextures({"atlas": texture_from(device, records, "rg32uint")})
    lit = make_texture(device, (side, side), "rgba32float")
    frame = CommandList(device)
    made = inputs.resources
    shape.draw(frame, made.shape.shape, inputs.motion)
    shadows.draw(frame, made.shadow_maps, inputs.shadow_views, made.head)
    layout = LitAtlas(listed, first.head, first.lit, make_surfaces(device, side), lit)
    surface_texels.draw(frame, layout)
    irradiance.draw(frame, layout, inputs.light_constants, lit, side)
    frame.submit()
    renderer.graph.forget()  # it does not know of this frame
    return download(device, lit).reshape(-1, 4)[:, :3].astype(np.float64)
