"""The head's maps as textures; made once for a head."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import rasterise
from dermis.disk import cached_mips
from dermis.gpu import Device, make_texture, upload
from dermis.gpu.textures import texture_from
from dermis.images.colour import encode_srgb
from dermis.images.filters import derivatives, mip_chain
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.mesh.uv import triangle_uv_area
from dermis.specular.beckmann import beckmann_table

DEFAULT_COLOUR = 0.8
"""Albedo of heads without a colour map."""

_MEAN_TEXELS = 512  # a side of the grid that a map's mean is taken on
_NO_BAND = -1.0
_FOUR = "rgba16float"
_LARGE = 1 << 20  # numbers in a map whose mips are kept on disk
_FORM = "1"  # increment when a map's mips change


def upload_maps(device: Device, head: Head, use_colour: bool, decoded: bool = True) -> dict[str, Any]:
    """The head's maps by their names in skin.wgsl, with a sampler and the lobe's table.

    use_colour : False leaves the colour map white, for profiles that carry the colour
    decoded : False takes the colour map's sRGB for linear, which is wrong
    """
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
        "colour_map": _mipped(
            device, lambda: np.dstack([colour, np.ones(colour.shape[:2], np.float32)]), _FOUR, colour
        ),
        "slope_map": _mipped(device, lambda: _moments(maps.normal), _FOUR, maps.normal),
        "relief_map": _mipped(device, lambda: _moments(_relief(maps)), _FOUR, maps.height),
        "specular_map": _mipped(device, lambda: _factor(maps.specular, head.mesh), "r16float"),
        "roughness_map": _mipped(device, lambda: _plain(maps.roughness), "r16float"),
        "beckmann_table": texture_from(device, beckmann_table(), "r32float"),
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


def _relief(maps: Maps) -> NDArray[np.float32] | None:
    if maps.height is None:
        return None
    return np.stack(derivatives(maps.height), axis=-1)


def _moments(slopes: NDArray[np.float32] | None) -> NDArray[np.float32]:
    """Slopes and their squares: a footprint's means give its normal and roughness [OlanoBaker2010]."""
    if slopes is None:
        return np.zeros((1, 1, 4), np.float32)
    return np.concatenate([slopes, slopes**2], axis=-1)


def relief_band(maps: Maps) -> float:
    """Mip of a larger height map that matches the normal map: it adds only finer relief. -1: it adds all."""
    if maps.normal is None or maps.height is None:
        return _NO_BAND
    finer = max(maps.height.shape[:2]) / max(maps.normal.shape[:2])
    return float(np.log2(finer)) if finer > 1 else _NO_BAND


def _mipped(
    device: Device,
    make: Callable[[], NDArray[np.float32]],
    texel: str,
    source: NDArray[np.float32] | None = None,
) -> Any:
    """A half-float texture with all its mips.

    source : the data that the picture is made from, by which large ones are kept on disk
    """

    def chain() -> list[NDArray[Any]]:
        return [level.astype(np.float16) for level in mip_chain(make())]

    levels = chain() if source is None or source.size < _LARGE else cached_mips(source, _FORM, chain)
    height, width = levels[0].shape[:2]
    texture = make_texture(device, (width, height), texel, mips=len(levels), use="map")
    for index, level in enumerate(levels):
        upload(device, texture, level, mip=index)
    return texture
