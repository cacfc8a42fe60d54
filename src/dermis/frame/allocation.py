"""Allocation of the resources of a frame, which depend neither on the camera nor on where lights are."""

from __future__ import annotations

from functools import partial

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import cached_atlas
from dermis.frame.features import diffusion, hair, outputs, post, shape
from dermis.frame.features.atlas.gutters import Walks, make_walks, with_lists
from dermis.frame.features.atlas.lit import Walked
from dermis.frame.features.atlas.textures import AtlasTextures, upload_atlas
from dermis.frame.features.hair.resources import no_strand_shadows
from dermis.frame.features.interreflection.interreflection import interreflection_of, no_interreflection
from dermis.frame.features.occlusion.baked import no_occlusion, occlusion_map
from dermis.frame.features.occlusion.moving import Sky, make_map, make_sky
from dermis.frame.features.shading.shade import shade_program
from dermis.frame.features.shading.view import view_record
from dermis.frame.features.shadows.shadows import ShadowMaps, make_shadow_maps
from dermis.frame.features.shape.curvature import no_curvature
from dermis.frame.features.shape.mesh import HeadResources, surface_at_rest, upload_geometry
from dermis.frame.features.shape.shape import Shape
from dermis.frame.features.surface.maps import fine_detail, upload_maps
from dermis.frame.features.surface.record import skin_record, surface_constants
from dermis.frame.features.surface.texels import make_surfaces
from dermis.frame.features.translucency.build import thin_tables, translucency_of
from dermis.frame.features.visibility.layers import Layers, make_layers
from dermis.frame.lights.environment import environment_record
from dermis.frame.limits import check_limits
from dermis.frame.request import FrameRequest
from dermis.frame.resources import AtlasLayout, Resources
from dermis.frame.technique import TechniqueResources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Bindings, Constants, Device, Memo, MutableBindings, Record, Texture
from dermis.gpu.textures import texture_from
from dermis.mesh.head import Head
from dermis.scene.skin import lobe_name
from dermis.specular.albedo import albedo_table

LaidAtlas = tuple[Atlas, AtlasTextures]


def make_resources(memo: Memo, device: Device, request: FrameRequest, technique: Technique) -> Resources:
    """Return the resources of frames that differ by their cameras and lights alone.

    Raises DermisError for sizes over the device's limits.
    """
    settings, keep = request.settings, memo.keep
    check_limits(device, request)
    map_files = (
        *(device, request.head, request.white, settings.gamma == "right"),
        *(request.painted_side, request.moving),
    )
    maps = memo.soon(device.executor, upload_maps, *map_files)  # which take long to read
    shadow_maps = _shadow_maps(memo, device, request)
    shapes = shape.make(memo, device, request)
    strands = hair.make(memo, device, request)
    lit = _lit(memo, device, request, shadow_maps, shapes, strands)
    atlases = [_atlas(memo, device, request, name, k) for k, name in enumerate(request.atlases.layouts)]
    uploaded = memo.wait(maps)
    lit |= uploaded.bindings | keep(fine_detail, device, request.finely_painted)
    layouts = tuple(
        _layout(memo, device, request, technique, one, shapes, lit, k) for k, one in enumerate(atlases)
    )
    own = technique.make(memo, device, settings, request.profile)
    thin = [layout.translucency for layout in layouts]
    two = len(layouts) > 1
    return Resources(
        shape=shapes,
        face=uploaded.face,
        layouts=layouts,
        shadow_maps=shadow_maps,
        diffusion=diffusion.make(memo, device, request, technique, [textures for _, textures in atlases]),
        scattered=_sum(memo, device, request, technique, settings.atlas, "both")
        if two
        else layouts[0].scattered,
        technique=own,
        spread=technique.make_apart(memo, device, settings) if "diffuse" in request.outputs else None,
        sky=_sky(memo, device, request, layouts[0], shapes) if request.occlusion_moves else None,
        hair=strands,
        visibility=keep(_visibility, device, settings.size, settings.samples),
        view=_view(device, request, technique, own),
        constants=surface_constants(request.skin) + _details(request) + technique.shade_constants,
        post=post.make(memo, device, request),
        outputs=outputs.make(memo, device, request, shapes.tables, thin),
        suns=len(request.surroundings.suns),
        gaussians=len(request.profile.variance_mm2),
        unscattered=keep(atlases[0][0].unscattered, request.topology.mesh),
    )


def _details(request: FrameRequest) -> Constants:
    """Return pipeline constants: relief finer than maps, eyes of true shape, a map that mixes profiles."""
    head = request.head
    found = {"DETAIL": request.finely_painted, "EYES": head.eyes is not None, "MIXED": request.mixed}
    return tuple((name, 1) for name, there in found.items() if there)


def _view(
    device: Device, request: FrameRequest, technique: Technique, own: TechniqueResources | None
) -> Record:
    """Return the record of the shading pass without the camera."""
    program = shade_program(device)
    view = view_record(program, request.head, request.settings, request.split)
    technique.describe(view, program, own)
    return view


def _shadow_maps(memo: Memo, device: Device, request: FrameRequest) -> ShadowMaps:
    layers = request.shadow_layers
    size = request.settings.shadow_size if layers else 1
    return memo.keep(_make_shadow_maps, device, request.topology, layers, size, of=f"{layers} {request.view}")


def _lit(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    shadow_maps: ShadowMaps,
    shapes: shape.Resources,
    strands: hair.Resources | None,
) -> MutableBindings:
    """Return what all layouts are lit with, maps and lights aside."""
    skin, program = request.skin, shade_program(device)
    around, total = request.environment, request.split.total
    curvature = shapes.curvature
    return {
        "skin": skin_record(program, skin, request.head.maps, request.profile, sum(request.parts)),
        "environment": environment_record(program, around, skin, total, request.occluded),
        "shadow_maps": shadow_maps.texture,
        "shadow_bounds": shadow_maps.bounds,
        "strand_shadows": strands.shadows if strands else no_strand_shadows(device),
        "curvatures": curvature.smoothed if curvature else no_curvature(device),
        "nearest_sampler": device.sampler(),
        "panorama": request.surroundings.panorama,
        "albedo_table": memo.keep(_albedo, device, lobe_name(skin), skin.fresnel),
    }


def _sky(
    memo: Memo, device: Device, request: FrameRequest, layout: AtlasLayout, shapes: shape.Resources
) -> Sky:
    """Return the open sky at the head's vertices, known as it rests."""
    at_rest = surface_at_rest(memo, device, layout.head, shapes.tables, request.topology, None, 0)
    return memo.keep(make_sky, device, request.topology, using=(at_rest,))


def _atlas(memo: Memo, device: Device, request: FrameRequest, name: str, index: int) -> LaidAtlas:
    stretch = request.technique.stretch(request.settings)
    atlas = memo.keep(_cached_atlas, request.topology, request.atlases.side, name, of=str(index))
    return atlas, memo.keep(upload_atlas, device, atlas, stretch, request.remedy, of=str(index))


def _layout(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    technique: Technique,
    laid: LaidAtlas,
    shapes: shape.Resources,
    shared: Bindings,
    index: int,
) -> AtlasLayout:
    """Return an atlas that light is spread on, without lights."""
    keep, number, head, (atlas, textures) = memo.keep, str(index), request.topology, laid
    held = keep(upload_geometry, device, head.mesh, atlas, shapes.shape, of=number)
    at_rest = partial(surface_at_rest, memo, device, held, shapes.tables, head, request.searched, index)
    lit: MutableBindings = {**held.resources, **shared}
    walked = None
    if shapes.person and textures.gutter:
        walks = keep(make_walks, device, head.mesh, atlas, textures, of=number)
        textures = keep(with_lists, device, textures, of=number)
        walked = keep(_walked, walks, held, shapes.person, of=number)
    if request.occluded:
        bound = lit, textures.resources["atlas"]
        occlusion = keep(occlusion_map, device, head, atlas, using=bound, of=number)
    else:
        occlusion = no_occlusion(device)
    follows = translucency = None
    if request.occlusion_moves:
        occlusion, follows = keep(make_map, device, occlusion, of=number)
    lit["occlusion_map"] = occlusion
    if request.count and request.settings.transmission == "thin" and request.technique.transmits:
        now, then = ({**one.resources, **textures.resources} for one in (held, at_rest()))
        blurred = request.split.blurred_mm2, request.split.weight
        how = thin_tables(memo, request), request.skin.has_own_tissue
        translucency = translucency_of(memo, device, now, then, atlas, *blurred, *how, of=number)
    between = None
    if request.interreflects:
        whose = request.split.total, request.occluded, request.light_of
        between = interreflection_of(memo, device, head, atlas, *whose, of=number)
    lit["from_skin"] = between.space.from_skin if between else no_interreflection(device)
    side = request.settings.atlas if request.count else 1
    surfaces = keep(make_surfaces, device, side, of=number)
    scattered = _sum(memo, device, request, technique, side, number)
    return AtlasLayout(textures, held, lit, surfaces, scattered, walked, translucency, follows, between)


def _walked(walks: Walks, held: HeadResources, person: Shape) -> Walked:
    return Walked(walks, held.shaped(person))


def _sum(
    memo: Memo, device: Device, request: FrameRequest, technique: Technique, side: int, role: str
) -> Texture:
    of = f"{role} {request.view}"
    return memo.keep(_make_sum, device, technique, side, request.light_of, of=of)


def _cached_atlas(head: Head, side: int, name: str) -> Atlas:
    return cached_atlas(head.mesh, side, name)


def _make_shadow_maps(device: Device, _: Head, layers: int, size: int) -> ShadowMaps:
    return make_shadow_maps(device, layers, size)


def _visibility(device: Device, size: tuple[int, int], samples: int) -> Layers:
    return make_layers(device, size, samples, triangles=True)


def _albedo(device: Device, lobe: str, fresnel: str) -> Texture:
    return texture_from(device, albedo_table(lobe, fresnel), "rg32float")


def _make_sum(device: Device, technique: Technique, side: int, _: str) -> Texture:
    return technique.make_sum(device, side)
