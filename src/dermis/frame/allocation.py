"""Allocation of the resources of a frame that depend neither on the camera nor on the positions of lights."""

from __future__ import annotations

from functools import partial

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import cached_atlas
from dermis.frame.features import diffusion, hair, outputs, post, shape
from dermis.frame.features.atlas.gutters import GutterTracing, make_gutter_tracing, with_separate_gutters
from dermis.frame.features.atlas.lit_atlas import GutterUpdate
from dermis.frame.features.atlas.textures import AtlasTextures, upload_atlas
from dermis.frame.features.hair.resources import placeholder_strand_shadows
from dermis.frame.features.interreflection.interreflection import (
    make_interreflection,
    placeholder_interreflection,
)
from dermis.frame.features.occlusion.baked import cached_occlusion_map, placeholder_occlusion
from dermis.frame.features.occlusion.moving import (
    VertexSkyVisibility,
    make_moving_occlusion_map,
    make_vertex_sky_visibility,
)
from dermis.frame.features.shading.shade import shade_program
from dermis.frame.features.shading.view import material_colours, mean_skin_albedo, view_record
from dermis.frame.features.shadows.shadows import ShadowMaps, make_shadow_maps
from dermis.frame.features.shape.curvature import placeholder_curvature
from dermis.frame.features.shape.mesh import HeadGeometry, rest_geometry, upload_geometry
from dermis.frame.features.shape.shape import Shape
from dermis.frame.features.surface.maps import detail_bindings, has_part_materials, upload_maps
from dermis.frame.features.surface.record import skin_record, surface_constants, vellus_per_mm
from dermis.frame.features.surface.texels import make_surface_texture
from dermis.frame.features.translucency.build import make_translucency, thin_part_tables
from dermis.frame.features.translucency.pair_shape import pair_positions_mm
from dermis.frame.features.visibility.layers import ViewLayers, make_layers
from dermis.frame.lights.environment import environment_record
from dermis.frame.limits import check_limits
from dermis.frame.request import FrameRequest
from dermis.frame.resources import AtlasLayout, Resources
from dermis.frame.technique import TechniqueResources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Bindings, Constants, Device, Memo, MutableBindings, Texture, UniformRecord
from dermis.gpu.textures import texture_from_array
from dermis.mesh.head import Head
from dermis.scene.skin import lobe_name
from dermis.specular.albedo import albedo_table

UploadedAtlas = tuple[Atlas, AtlasTextures]


def make_resources(memo: Memo, device: Device, request: FrameRequest, technique: Technique) -> Resources:
    """Return the textures, buffers and records that a frame needs, from a cache if they are still valid.

    Raises DermisError for sizes that exceed the limits of the device.
    """
    settings, cached = request.settings, memo.get
    check_limits(device, request)
    map_options = request.takes_albedo_from_map, settings.gamma == "right", request.painted_map_side
    map_inputs = device, request.head, *map_options, request.has_animated_maps, request.is_living
    maps = memo.submit(device.executor, upload_maps, *map_inputs)  # in the background, as files load slowly
    shadow_maps = _shadow_maps(memo, device, request)
    shapes = shape.make_resources(memo, device, request)
    strands = hair.make_resources(memo, device, request)
    bindings = _shared_bindings(memo, device, request, shadow_maps, shapes, strands)
    atlases = [
        _cached_uploaded_atlas(memo, device, request, name, k)
        for k, name in enumerate(request.atlas_plan.layouts)
    ]
    uploaded = memo.result(maps)
    bindings |= uploaded.bindings | cached(detail_bindings, device, request.has_fine_relief)
    layouts = tuple(
        _make_layout(memo, device, request, technique, atlas, shapes, bindings, k)
        for k, atlas in enumerate(atlases)
    )
    resources = technique.make_resources(memo, device, settings, request.profile)
    thin = [layout.translucency for layout in layouts]
    scattered = layouts[0].scattered
    if len(layouts) > 1:
        scattered = _exitance_texture(memo, device, request, technique, settings.atlas, "both")
    needs_layers = "diffuse" in request.outputs
    return Resources(
        shape=shapes,
        expression_maps=uploaded.expression_maps,
        layouts=layouts,
        shadow_maps=shadow_maps,
        diffusion=diffusion.make_resources(
            memo, device, request, technique, [textures for _, textures in atlases]
        ),
        scattered=scattered,
        technique=resources,
        output_layers=technique.make_subsurface_layers(memo, device, settings) if needs_layers else None,
        sky=_cached_sky_visibility(memo, device, request, layouts[0], shapes)
        if request.occlusion_follows_shape
        else None,
        hair=strands,
        visibility=cached(_visibility_layers, device, settings.size, settings.samples),
        view=_shade_record(memo, device, request, technique, resources),
        constants=surface_constants(request.skin) + _shade_constants(request) + technique.shade_constants,
        post=post.make_resources(memo, device, request),
        outputs=outputs.make_resources(memo, device, request, shapes.tables, thin),
        suns=len(request.environment_map.suns),
        gaussians=len(request.profile.variance_mm2),
        unscattered_fraction=cached(atlases[0][0].unscattered_fraction, request.topology_head.mesh),
    )


def _shade_constants(request: FrameRequest) -> Constants:
    """Return the pipeline constants of the shading pass for the optional features that the request uses.

    The features are relief finer than the maps, modelled eyes, diffusion profiles that a map blends, and mesh
    parts that are not skin.
    """
    eyes = request.head.eyes is not None
    used = {"DETAIL": request.has_fine_relief, "EYES": eyes, "MIXED": request.mixes_profiles}
    used["PARTS"] = has_part_materials(request.head)
    used["WORN"] = not used["PARTS"] and request.head.undressed is not None
    used["METALS"] = used["PARTS"] or used["WORN"]
    used["BANDS"] = request.bands is not None
    used["VELLUS"] = vellus_per_mm(request.head.maps) > 0.0
    return tuple((name, 1) for name, value in used.items() if value)


def _shade_record(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    technique: Technique,
    resources: TechniqueResources | None,
) -> UniformRecord:
    """Return the uniform record of the shading pass, without the members that the camera determines.

    resources : tables and textures of the technique; None if the technique needs none
    """
    program = shade_program(device)
    view = view_record(program, request.head, request.settings, request.profile_split, request.bands)
    view["skin_albedo"] = memo.get(mean_skin_albedo, request.head)
    technique.write_view_record(view, program, resources)
    return view


def _shadow_maps(memo: Memo, device: Device, request: FrameRequest) -> ShadowMaps:
    layers = request.shadow_layers
    size = request.settings.shadow_size if layers else 1
    return memo.get(
        _make_shadow_maps,
        device,
        request.topology_head,
        layers,
        size,
        caller_name=f"{layers} {request.view_name}",
    )


def _shared_bindings(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    shadow_maps: ShadowMaps,
    shape_resources: shape.Resources,
    strands: hair.Resources | None,
) -> MutableBindings:
    """Return the shader resources that all atlas layouts share, except the maps and the lights."""
    skin, program = request.skin, shade_program(device)
    environment, total = request.environment, request.profile_split.total
    curvature, counts = shape_resources.curvature, (sum(request.light_part_counts), request.bands)
    return {
        "skin": memo.get(skin_record, program, skin, request.head.maps, request.profile, *counts),
        "environment": environment_record(
            program, environment, request.environment_map, skin, total, request.has_occlusion
        ),
        "shadow_maps": shadow_maps.texture,
        "shadow_bounds": shadow_maps.bounds,
        "strand_shadows": strands.shadows if strands else placeholder_strand_shadows(device),
        "curvatures": curvature.smoothed if curvature else placeholder_curvature(device),
        "nearest_sampler": device.sampler(),
        "panorama": request.environment_map.panorama,
        "albedo_table": memo.get(_lobe_albedo_texture, device, lobe_name(skin), skin.fresnel),
    }


def _cached_sky_visibility(
    memo: Memo, device: Device, request: FrameRequest, layout: AtlasLayout, shape_resources: shape.Resources
) -> VertexSkyVisibility:
    """Return the sky visibility at the vertices of the head in its rest pose, cached if possible."""
    at_rest = rest_geometry(memo, device, layout.head, shape_resources.tables, request.topology_head, None, 0)
    return memo.get(make_vertex_sky_visibility, device, request.topology_head, untracked_arguments=(at_rest,))


def _cached_uploaded_atlas(
    memo: Memo, device: Device, request: FrameRequest, layout_name: str, layout_index: int
) -> UploadedAtlas:
    stretch = request.technique.stretch_correction(request.settings)
    atlas = memo.get(
        cached_atlas,
        request.topology_head.mesh,
        request.atlas_plan.side,
        layout_name,
        caller_name=str(layout_index),
    )
    return atlas, memo.get(
        upload_atlas, device, atlas, stretch, request.seam_method, caller_name=str(layout_index)
    )


def _make_layout(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    technique: Technique,
    uploaded_atlas: UploadedAtlas,
    shape_resources: shape.Resources,
    shared_bindings: Bindings,
    layout_index: int,
) -> AtlasLayout:
    """Return the resources of one atlas layout, except the record of the lights, which each frame adds.

    uploaded_atlas : the atlas, and its textures on the device
    shape_resources : buffers of the head's shape
    shared_bindings : result of `_shared_bindings`, to which the maps of the head have been added
    layout_index : index of the layout, part of the keys of its resources in the cache
    """
    cached, layout_key, head, (atlas, textures) = (
        memo.get,
        str(layout_index),
        request.topology_head,
        uploaded_atlas,
    )
    geometry = cached(
        upload_geometry,
        device,
        head.mesh,
        atlas,
        shape_resources.shape,
        request.head.maps.parts,
        caller_name=layout_key,
    )
    tables, settings = shape_resources.tables, request.settings
    at_rest = partial(rest_geometry, memo, device, geometry, tables, head)
    bindings: MutableBindings = {**geometry.resources, **shared_bindings}
    gutter_update = None
    if shape_resources.rest_shape and textures.gutter:
        tracing = cached(make_gutter_tracing, device, head.mesh, atlas, textures, caller_name=layout_key)
        textures = cached(with_separate_gutters, device, textures, caller_name=layout_key)
        gutter_update = cached(
            _gutter_update, tracing, geometry, shape_resources.rest_shape, caller_name=layout_key
        )
    if request.has_occlusion:
        inputs = bindings, textures.resources["atlas"]
        occlusion = cached(
            cached_occlusion_map,
            device,
            head,
            atlas,
            untracked_arguments=inputs,
            caller_name=layout_key,
        )
    else:
        occlusion = placeholder_occlusion(device)
    moving_occlusion = translucency = None
    if request.occlusion_follows_shape:
        occlusion, moving_occlusion = cached(
            make_moving_occlusion_map, device, occlusion, caller_name=layout_key
        )
    bindings["occlusion_map"] = occlusion
    if request.blur_count and settings.transmission == "thin" and request.technique.supports_translucency:
        searched = at_rest(pair_positions_mm(memo, request), layout_index)
        posed, rest = ({**one.resources, **textures.resources} for one in (geometry, searched))
        blurred = request.profile_split.blurred_mm2, request.profile_split.weight
        tissue = thin_part_tables(memo, request), request.skin.overrides_tissue
        translucency = make_translucency(
            memo, device, posed, rest, atlas, *blurred, *tissue, layout_key=layout_key
        )
    interreflection = None
    if request.has_interreflection:
        light = request.profile_split.total, request.has_occlusion, request.light_cache_key
        interreflection = make_interreflection(
            memo,
            device,
            head,
            atlas,
            *light,
            layout_key=layout_key,
            material_colour=material_colours(request.head, request.bands),
        )
    bindings["from_skin"] = (
        interreflection.buffers.from_skin if interreflection else placeholder_interreflection(device)
    )
    side = settings.atlas if request.blur_count else 1
    surfaces = cached(make_surface_texture, device, side, caller_name=layout_key)
    scattered = _exitance_texture(memo, device, request, technique, side, layout_key)
    optional = gutter_update, translucency, moving_occlusion, interreflection
    return AtlasLayout(textures, geometry, bindings, surfaces, scattered, *optional)


def _gutter_update(tracing: GutterTracing, geometry: HeadGeometry, rest_shape: Shape) -> GutterUpdate:
    return GutterUpdate(tracing, geometry.with_shape(rest_shape))


def _exitance_texture(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    technique: Technique,
    atlas_side: int,
    texture_role: str,
) -> Texture:
    owner = f"{texture_role} {request.view_name}"
    return memo.get(
        _make_exitance_texture, device, technique, atlas_side, request.light_cache_key, caller_name=owner
    )


def _make_shadow_maps(device: Device, _: Head, layer_count: int, map_side: int) -> ShadowMaps:
    return make_shadow_maps(device, layer_count, map_side)


def _visibility_layers(device: Device, picture_size: tuple[int, int], sample_count: int) -> ViewLayers:
    return make_layers(device, picture_size, sample_count, store_triangles=True)


def _lobe_albedo_texture(device: Device, lobe_name: str, fresnel_name: str) -> Texture:
    return texture_from_array(device, albedo_table(lobe_name, fresnel_name), "rg32float")


def _make_exitance_texture(device: Device, technique: Technique, atlas_side: int, _: str) -> Texture:
    return technique.make_exitance_texture(device, atlas_side)
