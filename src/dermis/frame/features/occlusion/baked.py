"""Ambient occlusion: the share of the sky that each place sees, baked for a mesh and an atlas."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import cached_occlusion
from dermis.base.progress import preparing
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import rest_shape, shape_tables
from dermis.frame.features.visibility.layers import draw_layers, make_layers
from dermis.frame.programs import program
from dermis.frame.projection import ShadowView, parallel_view, shadow_layers
from dermis.gpu import Bindings, CommandList, ComputeProgram, Device, Record, Texture, make_texture
from dermis.gpu.textures import texture_from
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head

DIRECTIONS = 128
MAP_SIZE = 512
FORM = f"1 {DIRECTIONS} {MAP_SIZE}"
"""To be changed when baking gives other results."""
_BATCH = 32  # depth maps at a time
_FINEST_OCCLUSION = 1024  # texels a side: it is smooth, and a texel of it is under a millimetre


def bake_occlusion(
    device: Device,
    head: Head,
    atlas: Atlas,
    lit: Bindings,
    texels: Texture,
    side: int,
    directions: int = DIRECTIONS,
    map_size: int = MAP_SIZE,
) -> NDArray[np.float32]:
    """(rows, side) open share of the sky, weighted by the cosine, 0 to 1; NaN where there is no surface.

    Depth maps are drawn from all around, and each place counts those in which it is visible.

    lit : what the lighting passes read, the surface aside
    texels : texture of the atlas' texels, of which side x side are baked, then the vertices, row by row
    """
    mesh, frame = head.mesh, CommandList(device)
    shape = rest_shape(device, shape_tables(device, head), head.control.positions_mm)
    resting = upload_geometry(device, mesh, atlas, shape)
    shader, towards = program(device, "occlusion/occlusion.wgsl"), fibonacci_sphere(directions)
    rows = side - (-len(mesh.positions) // side)
    sums = device.buffer(np.zeros((rows, side, 2), np.float32), "STORAGE")
    layers = make_layers(device, (map_size, map_size), _BATCH, triangles=False)
    for first in range(0, len(towards), _BATCH):
        views = [parallel_view(-d, mesh.outline, map_size) for d in towards[first : first + _BATCH]]
        draw_layers(frame, "occlusion", layers, shadow_layers(views), resting)
        sky = shader.record("Sky", directions=len(views), side=side, vertices=len(mesh.positions))
        own: Bindings = {"lights": _lights(shader, views), "shadow_maps": layers.texture, "sky": sky}
        bound: Bindings = {**lit, **resting.resources, **own, "atlas": texels, "open": sums}
        frame.compute("occlusion", shader, bound, (side, rows))
    frame.submit()
    raw = np.frombuffer(device.handle.queue.read_buffer(sums), np.float32).reshape(rows, side, 2)
    with np.errstate(invalid="ignore"):
        return np.asarray(raw[..., 0] / raw[..., 1])


def _lights(shader: ComputeProgram, views: list[ShadowView]) -> Record:
    record = shader.record("Lights")
    for layer, view in enumerate(views):
        light = record["light"][layer]
        light["parallel"], light["layer"], light["half_width"] = 1, layer, 1
        light["direction"] = np.cross(view.up, view.right)
        light["to_map"], light["texel"] = view.clip.T, view.texel
    return record


def whole_map(baked: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    """The baked rows as the shader reads them: the atlas without gaps, its last row again, the vertices.

    baked : (rows, side), NaN where there is no surface
    """
    from scipy.ndimage import distance_transform_edt

    texels = baked[:side]
    empty = np.isnan(texels)
    if not empty.all():
        nearest = distance_transform_edt(empty, return_distances=False, return_indices=True)
        texels = texels[tuple(nearest)]
    return np.nan_to_num(np.vstack([texels, texels[-1:], baked[side:]]), nan=1.0)


def occlusion_map(device: Device, head: Head, atlas: Atlas, lit: Bindings, texels: Texture) -> Texture:
    """The open share of the sky of the atlas' texels and of the vertices, baked or read from disk.

    lit : what the lighting passes read, lights aside
    texels : the atlas' texture of texels
    """
    side = min(atlas.size, _FINEST_OCCLUSION)

    @preparing("finding how much of the sky each place sees")
    def bake() -> NDArray[np.uint16]:
        baked = bake_occlusion(device, head, atlas, lit, texels, side)
        levels: NDArray[np.uint16] = np.rint(65535.0 * whole_map(baked, side)).astype(np.uint16)
        return levels

    levels = cached_occlusion(head.mesh, atlas, f"{FORM} {side}", bake)
    return texture_from(device, levels / np.float32(65535.0), "r32float")


def no_occlusion(device: Device) -> Texture:
    """Placeholder for the map where nothing is occluded."""
    return device.shared("no occlusion", lambda: make_texture(device, (1, 1), "r32float", use="map"))
