"""The head's maps as textures; made once for a head."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import rasterise, triangle_uv_area
from dermis.frame.features.surface import mips as map_mips
from dermis.frame.features.surface.painting import paint
from dermis.frame.features.surface.painting.paint import Face
from dermis.frame.features.surface.record import DEFAULT_COLOUR
from dermis.gpu import Device, MutableBindings, Texture, make_texture, upload
from dermis.gpu.textures import texture_from
from dermis.human.skin.painted import PaintedMaps
from dermis.human.skin.surface import Painting, painting
from dermis.human.skin.textures import detail_slopes
from dermis.images.colour import encode_srgb
from dermis.images.filters import mip_chain
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.specular.beckmann import beckmann_table

_SOFTWARE_SIDE = 1024  # of painted maps on software adapters, which take over a second for so many texels
_MEAN_TEXELS = 512  # a side of the grid that a map's mean is taken on


@dataclass(frozen=True, eq=False)
class UploadedMaps:
    """A head's maps on the device.

    bindings : by their names in skin.wgsl
    face : what expressions change them by, None where they do not
    """

    bindings: MutableBindings
    face: Face | None


def upload_maps(
    device: Device, head: Head, use_colour: bool, decoded: bool = True, side: int = 0, moving: bool = False
) -> UploadedMaps:
    """Return the head's maps with a sampler and the lobe's table.

    use_colour : False leaves the colour map white, for profiles that carry the colour
    decoded : False takes the colour map's sRGB for linear, which is wrong
    side : of maps that are painted [texels]
    moving : whether expressions change them
    """
    maps = head.maps
    if not isinstance(maps, PaintedMaps):
        return UploadedMaps(_of_files(device, head, use_colour, decoded), None)
    if not decoded and use_colour and maps.colour is None:  # which only pictures can be
        found = paint.painted_maps(device, _surface(head), maps.look, side)
        maps = replace(maps, colour=found.colour)
        head = replace(head, maps=maps)
    painted, face = _painted(device, head, maps, use_colour, (side, moving))
    return UploadedMaps(_of_files(device, head, use_colour, decoded) | painted, face)


def fine_detail(device: Device, fine: bool) -> MutableBindings:
    """What is finer than maps, by its names in skin.wgsl; flat unless the skin is painted."""
    slopes = detail_slopes() if fine else np.zeros((1, 1, 4), np.float32)
    around = {f"address_mode_{axis}": "repeat" for axis in "uv"}
    sampler = device.sampler(mag_filter="linear", min_filter="linear", mipmap_filter="linear", **around)
    return {"detail_map": map_mips.detail(device, slopes), "detail_sampler": sampler}


def _painted(
    device: Device, head: Head, maps: PaintedMaps, use_colour: bool, how: tuple[int, bool]
) -> tuple[MutableBindings, Face | None]:
    """Return the maps that no file gives, painted, and what expressions change them by.

    how : their side [texels], and whether expressions change them
    """
    surface, (side, moving) = _surface(head), how
    if device.adapter.kind == "CPU":
        side = min(side, _SOFTWARE_SIDE)
    given = {"relief": maps.height if maps.normal is None else maps.normal, "colour": maps.colour}
    moving = moving and (given["relief"] is None or (use_colour and maps.colour is None))
    painted = paint.draw(device, surface, maps.look, side, moving)
    found = {role: getattr(painted, role) for role in ("colour", "specular", "roughness", "relief")}
    given |= {"specular": maps.specular, "roughness": maps.roughness}
    kept = [role for role in found if given[role] is None and (use_colour or role != "colour")]
    return {f"{role}_map": found[role] for role in kept}, painted.face


def _surface(head: Head) -> Painting:
    """What is painted of a head, told by its topology: everyone's is that of one template."""
    return painting(head.topology.mesh, head.topology.control.stencils)


def _of_files(device: Device, head: Head, use_colour: bool, decoded: bool) -> MutableBindings:
    maps = head.maps
    white = np.ones((1, 1, 3), np.float32)
    colour = (
        maps.colour
        if use_colour and maps.colour is not None
        else white * (DEFAULT_COLOUR if use_colour else 1.0)
    )
    colour = colour if decoded else encode_srgb(colour)
    return {
        "map_sampler": device.sampler(mag_filter="linear", min_filter="linear", mipmap_filter="linear"),
        "relief_map": map_mips.relief(device, maps.height),
        "slope_map": map_mips.slopes(device, maps.normal),
        "colour_map": map_mips.colours(device, colour),
        "specular_map": _grey(device, _factor(maps.specular, head.mesh)),
        "roughness_map": _grey(device, _plain(maps.roughness)),
        "beckmann_table": device.shared(
            "Beckmann's distribution", lambda: texture_from(device, beckmann_table(), "r32float")
        ),
    }


def _plain(values: NDArray[np.float32] | None) -> NDArray[np.float32]:
    return np.ones((1, 1, 1), np.float32) if values is None else values[..., None]


def _factor(values: NDArray[np.float32] | None, mesh: Mesh) -> NDArray[np.float32]:
    """A map as a factor of the skin's own value: its mean over the surface is 1."""
    if values is None:
        return _plain(None)
    texel, triangle = rasterise(mesh, _MEAN_TEXELS, np.arange(len(mesh.triangles)))
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    weight = (triangle_areas(corners) / np.maximum(triangle_uv_area(mesh), 1e-12))[triangle]
    height, width = values.shape
    row, column = texel // _MEAN_TEXELS, texel % _MEAN_TEXELS
    found = values[row * height // _MEAN_TEXELS, column * width // _MEAN_TEXELS]
    mean = float((weight * found).sum() / weight.sum()) if len(texel) else 0.0
    return _plain(values / mean if mean > 0 else np.ones_like(values))


def _grey(device: Device, values: NDArray[np.float32]) -> Texture:
    """A texture of halves with all its mips: devices need not store to one channel of them."""
    levels = mip_chain(values)
    height, width = values.shape[:2]
    texture = make_texture(device, (width, height), "r16float", mips=len(levels), use="map")
    for index, level in enumerate(levels):
        upload(device, texture, level, mip=index)
    return texture
