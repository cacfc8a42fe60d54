"""Maps of the head as textures, from files or painted on the device."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import rasterise, triangle_uv_area
from dermis.frame.features.surface import mips as map_mips
from dermis.frame.features.surface.painting import paint
from dermis.frame.features.surface.painting.paint import ExpressionMaps
from dermis.frame.features.surface.record import DEFAULT_COLOUR
from dermis.gpu import Device, MutableBindings, Texture, make_texture, upload
from dermis.gpu.textures import texture_from_array
from dermis.human.skin.painted import PaintedMaps
from dermis.human.skin.surface import PaintedSurface, painted_surface
from dermis.human.skin.textures import detail_cavities, detail_slopes
from dermis.images.colour import encode_srgb
from dermis.images.filters import mip_chain
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.head import Head
from dermis.mesh.maps import PartMaps
from dermis.mesh.mesh import Mesh
from dermis.specular.beckmann import beckmann_table

_MAX_SOFTWARE_MAP_SIDE = 1024  # limit of painted maps on software adapters, which are slow [texels]
_SURFACE_MEAN_GRID_SIDE = 512  # side of the grid over which the mean of a map is computed [texels]


@dataclass(frozen=True, eq=False)
class UploadedMaps:
    """Maps of a head on the device.

    bindings : dictionary from names in skin.wgsl to textures and samplers
    expression_maps : painted maps that expressions change, None if no map changes
    """

    bindings: MutableBindings
    expression_maps: ExpressionMaps | None


def upload_maps(
    device: Device,
    head: Head,
    use_colour: bool,
    decode_srgb: bool = True,
    painted_map_side: int = 0,
    has_expressions: bool = False,
    is_living: bool = False,
) -> UploadedMaps:
    """Upload or paint the maps of a head, with their sampler and the table of Beckmann's distribution.

    use_colour : whether to use the colour map; False replaces it by white, for profiles that already include
        the colour of the skin
    decode_srgb : False treats the sRGB values of the colour map as linear, to reproduce a mistake that the
        talk [dEonLuebke2007] shows
    painted_map_side : side of painted maps [texels]
    has_expressions : whether expressions change painted maps
    is_living : whether states of the skin and the pulse change painted maps
    """
    maps = head.maps
    if not isinstance(maps, PaintedMaps):
        return UploadedMaps(_upload_file_maps(device, head, use_colour, decode_srgb), None)
    if not decode_srgb and use_colour and maps.colour is None:  # a painted map has no sRGB encoding
        found = paint.paint_arrays(device, _painted_surface(head), maps.look, painted_map_side)
        maps = replace(maps, colour=found.colour)
        head = replace(head, maps=maps)
    painted, expression_maps = _paint_maps(
        device, head, maps, use_colour, (painted_map_side, has_expressions, is_living)
    )
    return UploadedMaps(_upload_file_maps(device, head, use_colour, decode_srgb) | painted, expression_maps)


def detail_bindings(device: Device, has_fine_relief: bool) -> MutableBindings:
    """Return the tiled texture of the skin's finest relief, and its sampler, named as in skin.wgsl.

    has_fine_relief : whether the skin has relief that is finer than its maps; if False, the texture is flat
    """
    flat = np.zeros((1, 1, 4), np.float32), np.zeros((1, 1, 2), np.float32)
    tiles = (detail_slopes(), detail_cavities()) if has_fine_relief else flat
    repeat = {f"address_mode_{axis}": "repeat" for axis in "uv"}
    sampler = device.sampler(mag_filter="linear", min_filter="linear", mipmap_filter="linear", **repeat)
    return {"detail_map": map_mips.upload_detail(device, *tiles), "detail_sampler": sampler}


def _paint_maps(
    device: Device, head: Head, maps: PaintedMaps, use_colour: bool, paint_options: tuple[int, bool, bool]
) -> tuple[MutableBindings, ExpressionMaps | None]:
    """Paint the maps that the head does not have as files; also return the maps that expressions change.

    maps : look of the skin to paint, and maps from files that replace painted maps
    use_colour : whether to include the colour map
    paint_options : side of the painted maps [texels], and whether expressions and states change them
    """
    surface, (side, animated, is_living) = _painted_surface(head), paint_options
    if device.adapter.kind == "CPU":
        side = min(side, _MAX_SOFTWARE_MAP_SIDE)
    from_file = {"relief": maps.height if maps.normal is None else maps.normal, "colour": maps.colour}
    animated = animated and (from_file["relief"] is None or (use_colour and maps.colour is None))
    changes = animated, is_living and animated
    painted = paint.paint_textures(device, surface, maps.look, side, *changes, maps.bands)
    textures = {role: getattr(painted, role) for role in ("colour", "specular", "roughness", "relief")}
    from_file |= {"specular": maps.specular, "roughness": maps.roughness}
    used = [role for role in textures if from_file[role] is None and (use_colour or role != "colour")]
    return {f"{role}_map": textures[role] for role in used}, painted.expression_maps


def _painted_surface(head: Head) -> PaintedSurface:
    """Return the mesh over which the skin of a head is painted.

    For people who are made from a template, it is the mesh of the template, without their own shape.
    """
    return painted_surface(head.topology_head.mesh, head.topology_head.control_rig.stencils)


def _upload_file_maps(device: Device, head: Head, use_colour: bool, decode_srgb: bool) -> MutableBindings:
    maps = head.maps
    white = np.ones((1, 1, 3), np.float32)
    colour = (
        maps.colour
        if use_colour and maps.colour is not None
        else white * (DEFAULT_COLOUR if use_colour else 1.0)
    )
    colour = colour if decode_srgb else encode_srgb(colour)
    return {
        "map_sampler": device.sampler(mag_filter="linear", min_filter="linear", mipmap_filter="linear"),
        "relief_map": map_mips.make_relief(device, maps.height),
        "slope_map": map_mips.upload_slopes(device, maps.normal),
        "colour_map": map_mips.upload_colours(device, colour),
        "specular_map": _upload_grey(device, _divided_by_surface_mean(maps.specular, head.mesh)),
        **_part_bindings(device, maps.parts),
        "roughness_map": _upload_grey(device, _factor_channel(maps.roughness)),
        "beckmann_table": device.cached(
            "Beckmann's distribution", lambda: texture_from_array(device, beckmann_table(), "r32float")
        ),
    }


def has_part_materials(head: Head) -> bool:
    """Return whether a head has parts with maps or a metallic-roughness surface, see parts.wgsl."""
    return head.maps.parts is not None or any(one.roughness is not None for one in head.body.mesh.materials)


def _part_bindings(device: Device, part_maps: PartMaps | None) -> MutableBindings:
    """Upload the maps of parts that are not skin as layers of one texture, named as in parts.wgsl."""
    if part_maps is None:
        flat = np.zeros((1, 1, 4), np.float32)
        return {"part_maps": map_mips.upload_layers(device, [flat, flat], "part maps")}
    layers = [part_maps.colour, part_maps.surface]
    if part_maps.emission is not None:
        layers.append(np.pad(part_maps.emission, ((0, 0), (0, 0), (0, 1))))
    return {"part_maps": map_mips.upload_layers(device, layers, "part maps")}


def _factor_channel(factor_map: NDArray[np.float32] | None) -> NDArray[np.float32]:
    return np.ones((1, 1, 1), np.float32) if factor_map is None else factor_map[..., None]


def _divided_by_surface_mean(factor_map: NDArray[np.float32] | None, mesh: Mesh) -> NDArray[np.float32]:
    """Return a map divided by its mean over the surface, as a factor of the skin's specular strength [-].

    factor_map : (h, w) map; None gives a 1 x 1 map of the factor 1
    """
    if factor_map is None:
        return _factor_channel(None)
    texel, triangle = rasterise(mesh, _SURFACE_MEAN_GRID_SIDE, np.arange(len(mesh.triangles)))
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    weight = (triangle_areas(corners) / np.maximum(triangle_uv_area(mesh), 1e-12))[triangle]
    height, width = factor_map.shape
    row, column = texel // _SURFACE_MEAN_GRID_SIDE, texel % _SURFACE_MEAN_GRID_SIDE
    found = factor_map[row * height // _SURFACE_MEAN_GRID_SIDE, column * width // _SURFACE_MEAN_GRID_SIDE]
    mean = float((weight * found).sum() / weight.sum()) if len(texel) else 0.0
    return _factor_channel(factor_map / mean if mean > 0 else np.ones_like(factor_map))


def _upload_grey(device: Device, grey_map: NDArray[np.float32]) -> Texture:
    """Upload a one-channel map as half floats with all mip levels.

    The CPU computes the levels, because devices need not support writing to r16float textures.
    """
    levels = mip_chain(grey_map)
    height, width = grey_map.shape[:2]
    texture = make_texture(device, (width, height), "r16float", mip_count=len(levels), content_source="map")
    for index, level in enumerate(levels):
        upload(device, texture, level, mip=index)
    return texture
