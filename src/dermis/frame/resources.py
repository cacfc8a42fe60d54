"""The resources of a frame that depend on neither the camera nor where lights stand."""

from __future__ import annotations

from functools import partial
from typing import Any

from dermis.atlas.atlas import Atlas
from dermis.atlas.cached import cached_atlas
from dermis.frame import surface, surroundings
from dermis.frame.asked import Asked
from dermis.frame.atlas_layout import AtlasLayout, Walked
from dermis.frame.atlas_textures import AtlasTextures, upload_atlas
from dermis.frame.blurred_levels import blurred_levels
from dermis.frame.curvature import Curvature, make_curvature, no_curvature
from dermis.frame.geometry import HeadResources, upload_geometry
from dermis.frame.gutters import Walks, make_walks, with_lists
from dermis.frame.inputs import Resources, view_record
from dermis.frame.interreflection import interreflection_of, no_interreflection
from dermis.frame.limits import check_limits
from dermis.frame.maps import fine_detail, upload_maps
from dermis.frame.passes import shade, shadows, surface_texels, visibility_buffer
from dermis.frame.passes.moving_occlusion import Sky, make_map, make_sky
from dermis.frame.passes.shape import still_shape
from dermis.frame.picture_resources import picture_resources
from dermis.frame.resting import resting
from dermis.frame.shape import Shape, ShapeTables, make_shape, shape_tables
from dermis.frame.strand_space import (
    make_space,
    make_strand_picture,
    make_strand_shadows,
    no_strand_shadows,
    room_of,
)
from dermis.frame.strands import StrandResources, has_strands, make_tables, skin_under
from dermis.frame.techniques.technique import Technique
from dermis.frame.thin_tables import thin_tables
from dermis.frame.translucency import translucency_of
from dermis.gpu import Constants, Device, Memo
from dermis.gpu.textures import texture_from
from dermis.mesh.head import Head
from dermis.specular.albedo import albedo_table

Laid = tuple[Atlas, AtlasTextures]


def make_resources(memo: Memo, device: Device, asked: Asked) -> Resources:
    """The resources of frames that differ by their cameras and lights alone.

    Raises DermisError for sizes over the device's limits.
    """
    settings, keep, technique = asked.settings, memo.keep, asked.technique
    check_limits(device, asked)
    reading = device, asked.head, asked.white, settings.gamma == "right", asked.painted_side, asked.moving
    maps = memo.soon(device.executor, upload_maps, *reading)  # which take long to read
    shadow_maps = _shadows(memo, device, asked)
    tables = keep(shape_tables, device, asked.topology, of="shared" if asked.shares else "")
    shape = keep(make_shape, device, tables)
    person = keep(still_shape, device, tables) if asked.person is not None else None
    curvature = keep(_curvature, device, asked.topology) if technique.curved else None
    strands = _strands(memo, device, asked)
    shared = _shared(memo, device, asked, shadow_maps, curvature, strands)
    atlases = [_atlas(memo, device, asked, name, k) for k, name in enumerate(asked.atlases.layouts)]
    shared |= memo.wait(maps) | keep(fine_detail, device, asked.finely_painted)
    layouts = [_layout(memo, device, asked, one, shape, person, shared, k) for k, one in enumerate(atlases)]
    own, view = _shading(memo, device, asked)
    return Resources(
        shape=shape,
        person=person,
        face=shared.get("face"),
        head=layouts[0].head,
        layouts=tuple(layouts),
        shadow_maps=shadow_maps,
        scatters=asked.count > 0,
        scattered=_sum(memo, device, asked, settings.atlas, "both") if layouts[1:] else layouts[0].scattered,
        curvature=curvature,
        own=own,
        visibility=keep(_visibility, device, settings.size, settings.samples),
        view=view,
        constants=surface.constants(asked.skin) + _details(asked) + technique.shade_constants,
        suns=len(asked.surroundings.suns),
        sky=_sky(memo, device, asked, layouts[0], tables) if asked.occlusion_moves else None,
        gaussians=len(asked.profile.variance_mm2),
        strands=strands,
        unscattered=keep(atlases[0][0].unscattered, asked.topology.mesh),
        **blurred_levels(memo, device, asked, [textures for _, textures in atlases]),
        **picture_resources(memo, device, asked, tuple(layouts), tables),
    )


def _details(asked: Asked) -> Constants:
    """Whether there is relief finer than maps, eyes of true shape, and a map that mixes profiles."""
    found = {"DETAIL": asked.finely_painted, "EYES": asked.head.eyes is not None, "MIXED": asked.mixed}
    return tuple((name, 1) for name, there in found.items() if there)


def _shading(memo: Memo, device: Device, asked: Asked) -> tuple[Any, Any]:
    """What the technique made for itself, and the record of the shading pass without the camera."""
    technique, program = asked.technique, shade.shade_program(device)
    own = technique.make(memo, device, asked.settings, asked.profile)
    view = view_record(program, asked.head, asked.settings, asked.split)
    technique.describe(view, program, own)
    return own, view


def _strands(memo: Memo, device: Device, asked: Asked) -> StrandResources | None:
    if not has_strands(asked.head, asked.settings):
        return None
    room = room_of(asked.head)
    tables = memo.keep(make_tables, device, asked.head.bare, memo.keep(make_space, device, room))
    picture = memo.keep(make_strand_picture, device, room, asked.settings.size)
    layers = asked.shadow_layers
    shadows = memo.keep(make_strand_shadows, device, layers, of=f"{layers} {asked.view}")
    return StrandResources(tables, picture, shadows, memo.keep(skin_under, asked.head))


def _shadows(memo: Memo, device: Device, asked: Asked) -> shadows.ShadowMaps:
    layers = asked.shadow_layers
    size = asked.settings.shadow_size if layers else 1
    return memo.keep(_shadow_maps, device, asked.topology, layers, size, of=f"{layers} {asked.view}")


def _shared(
    memo: Memo,
    device: Device,
    asked: Asked,
    shadow_maps: shadows.ShadowMaps,
    curvature: Curvature | None,
    strands: StrandResources | None,
) -> dict[str, Any]:
    """What all layouts are lit with, lights aside."""
    skin, program = asked.skin, shade.shade_program(device)
    around, total = asked.environment, asked.split.total
    return {
        "skin": surface.skin_record(program, skin, asked.head.maps, asked.profile, sum(asked.parts)),
        "environment": surroundings.environment_record(program, around, skin, total, asked.occluded),
        "shadow_maps": shadow_maps.texture,
        "shadow_bounds": shadow_maps.bounds,
        "strand_shadows": strands.shadows if strands else no_strand_shadows(device),
        "curvatures": curvature.smoothed if curvature else no_curvature(device),
        "nearest_sampler": device.sampler(),
        "panorama": asked.surroundings.panorama,
        "albedo_table": memo.keep(_albedo, device, surface.model_of(skin), skin.fresnel),
    }


def _sky(memo: Memo, device: Device, asked: Asked, layout: AtlasLayout, tables: ShapeTables) -> Sky:
    """The open sky at the head's vertices, known as it rests."""
    at_rest = resting(memo, device, layout.head, tables, asked.topology, None, 0)
    return memo.keep(make_sky, device, asked.topology, using=(at_rest,))


def _atlas(memo: Memo, device: Device, asked: Asked, name: str, index: int) -> Laid:
    stretch = asked.technique.stretch(asked.settings)
    atlas = memo.keep(_cached_atlas, asked.topology, asked.atlases.side, name, of=str(index))
    return atlas, memo.keep(upload_atlas, device, atlas, stretch, asked.remedy, of=str(index))


def _layout(
    memo: Memo,
    device: Device,
    asked: Asked,
    laid: Laid,
    shape: Shape,
    person: Shape | None,
    shared: dict[str, Any],
    index: int,
) -> AtlasLayout:
    """An atlas that light is spread on, without lights.

    person : the shape of another person at rest
    """
    keep, number, head, (atlas, textures) = memo.keep, str(index), asked.topology, laid
    held = keep(upload_geometry, device, head.mesh, atlas, shape, of=number)
    at_rest = partial(resting, memo, device, held, shape.tables, head, asked.searched, index)
    lit = held.resources | shared
    walked = None
    if person and textures.gutter:
        walks = keep(make_walks, device, head.mesh, atlas, textures, of=number)
        textures = keep(with_lists, device, textures, of=number)
        walked = keep(_walked, walks, held, person, of=number)
    if asked.occluded:
        bound = lit, textures.resources["atlas"]
        lit["occlusion_map"] = keep(surroundings.occlusion_map, device, head, atlas, using=bound, of=number)
    else:
        lit["occlusion_map"] = surroundings.no_occlusion(device)
    follows = translucency = None
    if asked.occlusion_moves:
        lit["occlusion_map"], follows = keep(make_map, device, lit["occlusion_map"], of=number)
    if asked.count and asked.settings.transmission == "thin" and asked.technique.transmits:
        now, then = (one.resources | textures.resources for one in (held, at_rest()))
        blurred = asked.split.blurred_mm2, asked.split.weight
        how = thin_tables(memo, asked), asked.skin.has_own_tissue
        translucency = translucency_of(memo, device, now, then, atlas, *blurred, *how, of=number)
    between = None
    if asked.interreflects:
        whose = asked.split.total, asked.occluded, asked.light_of
        between = interreflection_of(memo, device, head, atlas, *whose, of=number)
    lit["from_skin"] = between.space.from_skin if between else no_interreflection(device)
    side = asked.settings.atlas if asked.count else 1
    surfaces = keep(surface_texels.make_surfaces, device, side, of=number)
    scattered = _sum(memo, device, asked, side, number)
    return AtlasLayout(textures, held, lit, surfaces, scattered, translucency, walked, follows, between)


def _walked(walks: Walks, held: HeadResources, person: Shape) -> Walked:
    return Walked(walks, held.shaped(person))


def _sum(memo: Memo, device: Device, asked: Asked, side: int, role: str) -> Any:
    of = f"{role} {asked.view}"
    return memo.keep(_make_sum, device, asked.technique, side, asked.light_of, of=of)


def _cached_atlas(head: Head, side: int, name: str) -> Atlas:
    return cached_atlas(head.mesh, side, name)


def _shadow_maps(device: Device, _: Head, layers: int, size: int) -> shadows.ShadowMaps:
    return shadows.make_shadow_maps(device, layers, size)


def _visibility(device: Device, size: tuple[int, int], samples: int) -> visibility_buffer.Layers:
    return visibility_buffer.make_layers(device, size, samples, triangles=True)


def _curvature(device: Device, head: Head) -> Curvature:
    return make_curvature(device, head.mesh)


def _albedo(device: Device, model: str, fresnel: str) -> Any:
    return texture_from(device, albedo_table(model, fresnel), "rg32float")


def _make_sum(device: Device, technique: Technique, side: int, _: str) -> Any:
    return technique.make_sum(device, side)
