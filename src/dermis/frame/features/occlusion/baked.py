"""Ambient occlusion at rest: visible fraction of the sky at texels and vertices, computed with depth maps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import cached_occlusion
from dermis.base.progress import logged_step
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import evaluate_rest_shape, shape_tables
from dermis.frame.features.visibility.layers import draw_layers, make_layers
from dermis.frame.programs import program
from dermis.frame.projection import ShadowView, parallel_shadow_view, shadow_map_views
from dermis.gpu import (
    Bindings,
    CommandList,
    ComputeProgram,
    Device,
    Texture,
    UniformRecord,
    make_texture,
)
from dermis.gpu.textures import texture_from_array
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head

SKY_DIRECTION_COUNT = 128
"""Number of directions from which a depth map of the head is drawn."""
DEPTH_MAP_SIDE = 512
"""Side of a depth map [texels]."""
OCCLUSION_CACHE_VERSION = f"1 {SKY_DIRECTION_COUNT} {DEPTH_MAP_SIDE}"
"""Version of baked maps on disk; change it when baking gives other results."""
_DEPTH_MAPS_PER_BATCH = 32  # number of depth maps that are drawn at a time
_MAX_OCCLUSION_MAP_SIDE = (
    1024  # largest side of an occlusion map [texels]; its texels are smaller than a millimetre
)


def bake_occlusion(
    device: Device,
    head: Head,
    atlas: Atlas,
    bindings: Bindings,
    surface_texels: Texture,
    result_side: int,
    direction_count: int = SKY_DIRECTION_COUNT,
    depth_map_side: int = DEPTH_MAP_SIDE,
) -> NDArray[np.float32]:
    """Return the cosine-weighted visible fraction of the sky at texels and vertices, (rows, result_side) [-].

    Depth maps of the head are drawn from directions all around it. For each point, the cosines of the
    directions from which the point is visible are summed, and divided by the sum of all cosines. The first
    `result_side` rows of the result are the texels of the atlas, NaN where there is no surface; the other
    rows hold the vertices of the mesh.

    bindings : resources that lighting shaders read; the bake replaces the geometry and the lights among them
    surface_texels : texture that maps each atlas texel to a surface point
    result_side : side of the atlas in the result [texels]
    direction_count : number of depth maps
    depth_map_side : side of a depth map [texels]
    """
    mesh, commands = head.mesh, CommandList(device)
    shape = evaluate_rest_shape(device, shape_tables(device, head), head.control_rig.positions_mm)
    geometry = upload_geometry(device, mesh, atlas, shape)
    shader, to_sky = program(device, "occlusion/occlusion.wgsl"), fibonacci_sphere(direction_count)
    rows = result_side - (-len(mesh.positions) // result_side)
    sums = device.buffer(np.zeros((rows, result_side, 2), np.float32), "STORAGE")
    layers = make_layers(
        device, (depth_map_side, depth_map_side), _DEPTH_MAPS_PER_BATCH, store_triangles=False
    )
    for first in range(0, len(to_sky), _DEPTH_MAPS_PER_BATCH):
        views = [
            parallel_shadow_view(-d, mesh.outline, depth_map_side)
            for d in to_sky[first : first + _DEPTH_MAPS_PER_BATCH]
        ]
        draw_layers(commands, "occlusion", layers, shadow_map_views(views), geometry)
        sky = shader.make_record("Sky", directions=len(views), side=result_side, vertices=len(mesh.positions))
        lights: Bindings = {
            "lights": _depth_views_as_lights(shader, views),
            "shadow_maps": layers.texture,
            "sky": sky,
        }
        resources: Bindings = {
            **bindings,
            **geometry.resources,
            **lights,
            "atlas": surface_texels,
            "sums": sums,
        }
        commands.compute("occlusion", shader, resources, (result_side, rows))
    commands.submit()
    raw = np.frombuffer(device.handle.queue.read_buffer(sums), np.float32).reshape(rows, result_side, 2)
    with np.errstate(invalid="ignore"):
        return np.asarray(raw[..., 0] / raw[..., 1])


def _depth_views_as_lights(shader: ComputeProgram, shadow_views: list[ShadowView]) -> UniformRecord:
    record = shader.make_record("Lights")
    for layer, view in enumerate(shadow_views):
        light = record["light"][layer]
        light["parallel"], light["layer"], light["half_width"] = 1, layer, 1
        light["direction"] = np.cross(view.up, view.right)
        light["to_map"], light["texel"] = view.clip.T, view.texel
    return record


def fill_occlusion_gaps(baked_occlusion: NDArray[np.float32], result_side: int) -> NDArray[np.float32]:
    """Return a baked occlusion map whose empty texels have the value of the nearest texel on the surface.

    The map consists of rows of atlas texels, followed by rows with one value for each vertex of the mesh. The
    last row of texels is repeated between the two, so that texture filtering at the edge of the atlas does
    not mix in values of vertices.

    baked_occlusion : (rows, result_side) result of `bake_occlusion`, NaN where there is no surface
    result_side : side of the atlas in the result [texels]
    """
    from scipy.ndimage import distance_transform_edt

    texels = baked_occlusion[:result_side]
    empty = np.isnan(texels)
    if not empty.all():
        nearest = distance_transform_edt(empty, return_distances=False, return_indices=True)
        texels = texels[tuple(nearest)]
    return np.nan_to_num(np.vstack([texels, texels[-1:], baked_occlusion[result_side:]]), nan=1.0)


def cached_occlusion_map(
    device: Device,
    head: Head,
    atlas: Atlas,
    bindings: Bindings,
    surface_texels: Texture,
) -> Texture:
    """Return a texture of the visible fraction of the sky at texels and vertices, baked or read from disk.

    bindings : resources that lighting shaders read; the bake replaces the geometry and the lights among them
    surface_texels : texture that maps each atlas texel to a surface point
    """
    side = min(atlas.size, _MAX_OCCLUSION_MAP_SIDE)

    @logged_step("computing the ambient occlusion")
    def bake_as_integers() -> NDArray[np.uint16]:
        baked = bake_occlusion(device, head, atlas, bindings, surface_texels, side)
        integers: NDArray[np.uint16] = np.rint(65535.0 * fill_occlusion_gaps(baked, side)).astype(np.uint16)
        return integers

    integers = cached_occlusion(head.mesh, atlas, f"{OCCLUSION_CACHE_VERSION} {side}", bake_as_integers)
    visible = integers / np.float32(65535.0)
    return texture_from_array(device, visible, "r32float")


def placeholder_occlusion(device: Device) -> Texture:
    """Return the 1 x 1 texture to bind in place of the occlusion map for scenes without occlusion."""
    return device.cached(
        "no occlusion", lambda: make_texture(device, (1, 1), "r32float", content_source="map")
    )
