"""Surface points that are visible at pixel centres, and the irradiance at given surface points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.atlas.textures import AtlasTextures, pack_surface_points
from dermis.frame.features.irradiance import irradiance
from dermis.frame.features.shadows import shadows
from dermis.frame.features.shape import shape
from dermis.frame.features.surface import texels as surface_texels
from dermis.frame.features.surface.texels import make_surface_texture
from dermis.frame.features.visibility import layers as visibility_buffer
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download, make_texture
from dermis.gpu.textures import texture_from_array
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class SurfacePoints:
    """Surface points of the head that are visible at the centres of pixels.

    mask : (h, w) mask of the pixels that show the head
    triangle : (n,) indices of the triangles that the n pixels of the mask show, row by row
    barycentric : (n, 3) barycentric weights of the points in these triangles [-]
    """

    mask: NDArray[np.bool_]
    triangle: Index
    barycentric: Floats


def surface_points(renderer: Renderer, scene: Scene, settings: Settings) -> SurfacePoints:
    """Return the surface points at the pixel centres of a picture.

    settings : settings of the picture; technique and samples are ignored
    """
    return renderer.reopening_device.run(partial(_find_surface_points, renderer, scene, settings))


def _find_surface_points(renderer: Renderer, scene: Scene, settings: Settings) -> SurfacePoints:
    single = settings.model_copy(update={"samples": 1, "technique": "none"})
    inputs = renderer.prepare(scene, single)
    frame = CommandList(renderer.device)
    resources = inputs.resources
    shape.draw(frame, resources.shape.shape, inputs.pose_bytes)
    visibility_buffer.draw(frame, resources.visibility, inputs.camera_views, resources.head)
    frame.submit()
    renderer.graph.invalidate()  # this frame bypassed the graph
    visible = download(renderer.device, resources.visibility.texture).astype(np.int64)
    mask = visible > 0
    triangle = visible[mask] - 1
    return SurfacePoints(mask, triangle, _barycentric_weights(scene, inputs.view, triangle, mask))


def _barycentric_weights(
    scene: Scene, shade_record: NDArray[np.void], triangle_index: Index, head_mask: NDArray[np.bool_]
) -> Floats:
    """Return (n, 3) barycentric weights of the points where camera rays meet the triangles, see shade.wgsl.

    shade_record : uniform record of the shading pass
    triangle_index : (n,) indices of the triangles in the pixels of the mask
    head_mask : (h, w) mask of the pixels that show the head
    """
    height, width = head_mask.shape
    rows, columns = np.nonzero(head_mask)
    x, y = 2.0 * (columns + 0.5) / width - 1.0, 1.0 - 2.0 * (rows + 0.5) / height
    names = ("forward", "right", "up", "eye", "shift")
    forward, right, up, eye, shift = (shade_record[name].astype(np.float64) for name in names)
    x, y = x + shift[0], y + shift[1]
    ray = forward + x[:, None] * right + y[:, None] * up
    mesh, pose_arrays = scene.head.mesh, scene.pose_arrays
    points = (
        mesh.positions
        if pose_arrays is None
        else scene.head.control_rig.posed_points_mm(pose_arrays)[mesh.point]
    )
    a, b, c = (points[mesh.triangles[triangle_index, k]].astype(np.float64) - eye for k in range(3))
    sides = (np.cross(b, c), np.cross(c, a), np.cross(a, b))
    weights = np.stack([(side * ray).sum(axis=1) for side in sides], axis=-1)
    weights *= np.sign(weights.sum(axis=1, keepdims=True))  # negative on back faces
    weights = np.clip(weights, 0.0, None)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))


def irradiance_at(
    renderer: Renderer, scene: Scene, settings: Settings, triangle_index: Index, barycentric_weights: Floats
) -> Floats:
    """Return the (n, 3) irradiance at surface points, times the skin colour [-].

    The skin colour is the part of the albedo that is applied before the light scatters.

    scene : scene with neither maps nor an environment, because the positions of the points in the atlas are
        unknown; interreflection is ignored
    triangle_index : (n,) indices of the triangles on which the points lie
    barycentric_weights : (n, 3) barycentric weights of the points
    """
    side = max(1, int(np.ceil(np.sqrt(len(triangle_index)))))
    triangles = np.full(side * side, -1, np.int64)
    triangles[: len(triangle_index)] = triangle_index
    weights = np.zeros((side * side, 2))
    weights[: len(triangle_index)] = barycentric_weights[:, 1:]
    records = pack_surface_points(
        triangles.reshape(side, side), np.rint(65535 * weights).reshape(side, side, 2)
    )
    return renderer.reopening_device.run(partial(_compute_irradiance, renderer, scene, settings, records))[
        : len(triangle_index)
    ]


def _compute_irradiance(
    renderer: Renderer, scene: Scene, settings: Settings, packed_points: NDArray[np.uint32]
) -> Floats:
    """Return the (n * n, 3) irradiance at surface points, times the skin colour [-].

    packed_points : (n, n, 2) packed surface points, arranged like the texels of an atlas
    """
    device, side = renderer.device, len(packed_points)
    inputs = renderer.prepare(scene, settings.model_copy(update={"interreflection": False}))
    first = inputs.layouts[0]
    point_atlas = AtlasTextures({"atlas": texture_from_array(device, packed_points, "rg32uint")})
    entering = make_texture(device, (side, side), "rgba32float")
    frame = CommandList(device)
    resources = inputs.resources
    shape.draw(frame, resources.shape.shape, inputs.pose_bytes)
    shadows.draw(frame, resources.shadow_maps, inputs.shadow_views, resources.head)
    layout = LitAtlas(point_atlas, first.head, first.bindings, make_surface_texture(device, side), entering)
    surface_texels.draw(frame, layout)
    irradiance.draw(frame, layout, inputs.light_constants, entering, side)
    frame.submit()
    renderer.graph.invalidate()  # this frame bypassed the graph
    return download(device, entering).reshape(-1, 4)[:, :3].astype(np.float64)
