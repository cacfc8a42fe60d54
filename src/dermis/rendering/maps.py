"""The head's geometry and maps as textures; made once for a head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.atlas import Atlas
from dermis.assets.head import Head
from dermis.assets.maps import Maps
from dermis.assets.mesh import Mesh
from dermis.gpu import Device, make_texture, upload
from dermis.gpu.textures import texture_from
from dermis.images.colour import encode_srgb
from dermis.images.filters import derivatives, mip_chain
from dermis.specular.beckmann import beckmann_table

_TRIANGLES_PER_ROW = 2048  # the shaders take it from the texture's width
_VERTICES_PER_ROW = 512
_NO_BAND = -1.0


@dataclass(frozen=True)
class HeadTextures:
    """What the shaders read of a head, by the names they use.

    resources : name in geometry.wgsl and skin.wgsl -> texture or sampler
    relief_band : mip of the height map from which on the normal map knows the relief, -1 without one
    triangles : count
    unscattered : share of the skin's triangles that the atlas cannot hold
    """

    resources: dict[str, Any]
    relief_band: float
    triangles: int
    unscattered: float


@dataclass(frozen=True)
class AtlasTextures:
    """What the shaders read of an atlas, by the names they use.

    resources : atlas, stretch_map and reach_map
    sheared : whether u and v meet at other than right angles somewhere
    apron, gathered : the list of texels beyond the charts' edges and space for their light; None without any
    """

    resources: dict[str, Any]
    sheared: bool
    apron: Any = None
    gathered: Any = None


def upload_head(
    device: Device, head: Head, atlas: Atlas, use_colour: bool, decoded: bool = True
) -> HeadTextures:
    """All textures of a head except its atlas.

    use_colour : False leaves the colour map white, for profiles that carry the colour
    decoded : False takes the colour map's sRGB for linear, which is wrong
    """
    mesh, maps = head.mesh, head.maps
    white = np.ones((1, 1, 3), np.float32)
    colour = maps.colour if use_colour and maps.colour is not None else white * (0.8 if use_colour else 1.0)
    colour = colour if decoded else encode_srgb(colour)
    resources = {
        "triangle_table": texture_from(device, _triangle_table(mesh, atlas), "rgba32uint"),
        "vertex_table": texture_from(device, _vertex_table(mesh), "rgba32float"),
        "map_sampler": device.sampler(mag_filter="linear", min_filter="linear", mipmap_filter="linear"),
        "colour_map": _mipped(
            device, np.dstack([colour, np.ones(colour.shape[:2], np.float32)]), "rgba16float"
        ),
        "slope_map": _mipped(device, _moments(maps.normal), "rgba16float"),
        "relief_map": _mipped(device, _moments(_relief(maps)), "rgba16float"),
        "specular_map": _mipped(device, _factor(maps.specular, mesh, atlas), "r16float"),
        "roughness_map": _mipped(device, _plain(maps.roughness), "r16float"),
        "beckmann_table": texture_from(device, beckmann_table(), "r32float"),
    }
    return HeadTextures(resources, _relief_band(maps), len(mesh.triangles), atlas.unscattered(mesh))


def upload_atlas(device: Device, atlas: Atlas, stretch: str = "full") -> AtlasTextures:
    """The atlas as the shaders read it.

    stretch : "full" knows the angle between u and v, "axes" takes it for right, "none" is one density for all
    """
    packed = atlas.barycentric[..., 0].astype(np.uint32) | (atlas.barycentric[..., 1].astype(np.uint32) << 16)
    texels = np.stack([(atlas.triangle + 1).astype(np.uint32), packed], axis=-1)
    texels[~atlas.own] = 0
    metric = _metric(atlas, stretch)
    resources = {
        "atlas": texture_from(device, texels, "rg32uint"),
        "stretch_map": texture_from(device, metric, "rgba16float"),
        "reach_map": texture_from(device, atlas.reach, "rgba16uint"),
    }
    sheared = bool(metric[..., 2].any())
    if not len(atlas.apron):
        return AtlasTextures(resources, sheared)
    beyond = np.concatenate([atlas.source.view(np.uint32), atlas.apron.astype(np.uint32)], axis=1)
    light = np.zeros((len(beyond), 4), np.float32)
    lists = (device.buffer(words, "STORAGE") for words in (beyond, light))
    return AtlasTextures(resources, sheared, *lists)


def _metric(atlas: Atlas, stretch: str) -> NDArray[np.float16]:
    """(n, n, 4) texels per mm along u and v, the cosine between the two, and 1 in the apron."""
    metric = np.zeros((atlas.size, atlas.size, 4), np.float16)
    metric[..., :2] = atlas.stretch
    if stretch == "full":
        metric[..., 2] = atlas.shear
    if stretch == "none":
        covered = atlas.stretch[atlas.own].astype(np.float64)
        metric[atlas.coverage, :2] = np.sqrt((covered**2).mean()) if len(covered) else 0.0
    metric[atlas.coverage & ~atlas.own, 3] = 1.0
    return metric


def _triangle_table(mesh: Mesh, atlas: Atlas) -> NDArray[np.uint32]:
    opaque = np.array([material.kind == "opaque" for material in mesh.materials])
    table = np.zeros((3, len(mesh.triangles), 4), dtype=np.uint32)
    table[0, :, :3] = mesh.triangles
    table[0, :, 3] = atlas.mapped | (opaque[mesh.material] << 1) | (mesh.material.astype(np.uint32) << 8)
    table[1] = np.ascontiguousarray(atlas.place[:, :2]).reshape(-1, 4).view(np.uint32)
    table[2, :, :2] = np.ascontiguousarray(atlas.place[:, 2]).view(np.uint32)
    return np.concatenate([_rows(part, _TRIANGLES_PER_ROW) for part in table])


def _vertex_table(mesh: Mesh) -> NDArray[np.float32]:
    table = np.zeros((len(mesh.positions), 4, 4), dtype=np.float32)
    for k, attribute in enumerate((mesh.positions, mesh.normals, mesh.dpdu, mesh.dpdv)):
        table[:, k, :3] = attribute
    table[:, :2, 3] = mesh.uv
    return _rows(table.reshape(len(table), 16), _VERTICES_PER_ROW).reshape(-1, 4 * _VERTICES_PER_ROW, 4)


def _rows(table: NDArray[Any], per_row: int) -> NDArray[Any]:
    rows = -(-len(table) // per_row)
    padded = np.zeros((rows * per_row, table.shape[1]), dtype=table.dtype)
    padded[: len(table)] = table
    return padded.reshape(rows, per_row, -1)


def _plain(values: NDArray[np.float32] | None) -> NDArray[np.float32]:
    return np.ones((1, 1, 1), np.float32) if values is None else values[..., None]


def _factor(values: NDArray[np.float32] | None, mesh: Mesh, atlas: Atlas) -> NDArray[np.float32]:
    """A map as a factor of the skin's own value: its mean over the surface is 1."""
    if values is None:
        return _plain(None)
    height, width = values.shape
    u, v = np.clip(atlas.interpolate(mesh, mesh.uv)[atlas.own].T, 0.0, 1.0 - 1e-6)
    mean = float(values[(v * height).astype(int), (u * width).astype(int)].mean()) if len(u) else 0.0
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


def _relief_band(maps: Maps) -> float:
    """Where both maps exist, a larger height map adds what is finer than the normal map; else all of it."""
    if maps.normal is None or maps.height is None:
        return _NO_BAND
    finer = max(maps.height.shape[:2]) / max(maps.normal.shape[:2])
    return float(np.log2(finer)) if finer > 1 else _NO_BAND


def _mipped(device: Device, image: NDArray[np.float32], texel: str) -> Any:
    chain = mip_chain(image)
    texture = make_texture(device, (image.shape[1], image.shape[0]), texel, mips=len(chain), use="map")
    for level, part in enumerate(chain):
        upload(device, texture, part, mip=level)
    return texture
