"""Passes of the atlas: stretch maps, stitched gutters, and the blend of two atlas layouts."""

from __future__ import annotations

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.atlas.textures import GUTTER_ENTRY_BYTES, AtlasTextures
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.programs import TILE_SIDE, program, workgroup_grid
from dermis.frame.seams import FEATHER_WIDTH_MM
from dermis.gpu import Device, Recorder, Texture, TextureOrView, make_texture

_STRETCH_SOURCE_BYTES = 12  # size of an entry of stretch_sources in stretch_beyond.wgsl
_GUTTER_ENTRIES_PER_ROW = 1024  # ROW of gutter.wgsl


def draw_stretch(graph: Recorder, head: HeadGeometry, atlas: AtlasTextures) -> None:
    """Declare the passes that fill the stretch maps of an atlas, one map for each of its resolutions.

    A stretch map holds, at each texel, the texel densities on the surface along u and v, and the cosine of
    the angle between these two directions.

    head : triangles and vertices of the head
    """
    device, bound, constants = graph.device, {**head.resources, **atlas.resources}, atlas.stretch_constants
    bound.setdefault("edge_map", _placeholder_edge_map(device))
    inside = program(device, "atlas/stretch.wgsl", constants)
    graph.compute("stretch", inside, bound, atlas.resources["atlas"].size[:2])
    if atlas.stretch_sources is not None:
        beyond = program(device, "atlas/stretch_beyond.wgsl", constants)
        listed = bound | {"stretch_sources": atlas.stretch_sources}
        groups = workgroup_grid(atlas.stretch_sources.size // _STRETCH_SOURCE_BYTES)
        graph.dispatch("stretch", beyond, listed, groups, in_place_resource="stretch_map")
    draw_coarser_stretch_maps(graph, atlas)


def draw_coarser_stretch_maps(graph: Recorder, atlas: AtlasTextures) -> None:
    """Declare the passes that compute the stretch map of each coarser resolution from the next finer one."""
    finer, halve = atlas.resources, program(graph.device, "atlas/stretch_halve.wgsl")
    for level in atlas.coarser:
        maps = {"finer": finer["stretch_map"], "reach_map": finer["reach_map"]}
        coarser = level.resources["stretch_map"]
        graph.compute("stretch", halve, maps | {"stretch_map": coarser}, coarser.size[:2], TILE_SIDE)
        finer = level.resources


def _placeholder_edge_map(device: Device) -> Texture:
    """Return a 1 x 1 placeholder for `edge_map`, for shaders that do not read the distances to edges."""
    return device.cached("no edges", lambda: make_texture(device, (1, 1), "r32float", content_source="map"))


def draw_gutters(
    graph: Recorder, stage_name: str, atlas: AtlasTextures, light_texture: TextureOrView, texel_format: str
) -> None:
    """Declare the passes that copy light from across the seams to the gutters of a texture.

    The light is first copied to a buffer, because a pass cannot read and write the same texture.

    stage_name : name of the stage in timings
    light_texture : texture of light over the atlas
    texel_format : texture format of `light_texture`
    """
    if atlas.gutter is None or atlas.gutter_light is None:
        return
    device = graph.device
    gather = program(device, "atlas/stitch_gather.wgsl", source_format=texel_format)
    place = program(device, "atlas/stitch_place.wgsl", store_format=texel_format)
    linear = device.sampler(mag_filter="linear", min_filter="linear")
    size = (_GUTTER_ENTRIES_PER_ROW, -(-atlas.gutter.size // (GUTTER_ENTRY_BYTES * _GUTTER_ENTRIES_PER_ROW)))
    lists = {"gutter": atlas.gutter, "gathered": atlas.gutter_light}
    graph.compute(stage_name, gather, {**lists, "source": light_texture, "linear": linear}, size, TILE_SIDE)
    graph.compute(
        stage_name, place, {**lists, "stored": light_texture}, size, TILE_SIDE, in_place_resource="stored"
    )


def draw_blend(
    graph: Recorder, first_layout: LitAtlas, second_layout: LitAtlas, blended_light: Texture
) -> None:
    """Declare the pass that blends the scattered light of two atlas layouts, to hide their seams.

    The seams of the two layouts are in different places. Towards the seams of the first layout, its light
    fades smoothly into the light of the second layout.

    first_layout : layout whose light is used away from its seams
    second_layout : layout whose light is used near the seams of the first layout
    blended_light : texture for the result, as large as the atlas of the first layout
    """
    bound = {
        **second_layout.bindings,  # with the atlas coordinates of the second layout
        **first_layout.atlas.resources,
        "first": first_layout.scattered,
        "second": second_layout.scattered,
        "blended": blended_light,
    }
    shader = program(graph.device, "atlas/blend.wgsl", (("FADE_MM", FEATHER_WIDTH_MM),))
    graph.compute("blend", shader, bound, blended_light.size[:2])
