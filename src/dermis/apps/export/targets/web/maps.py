"""Maps of captured frames as WebP images, with 8 bits per channel and a curve that decodes each channel."""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.web.frame_json import Frames, PictureMap, PictureMaps, resources_bound_as
from dermis.apps.export.targets.web.packing import quantise
from dermis.frame.capture import capture_mips, update_map
from dermis.frame.renderer import Renderer
from dermis.gpu.capture import FrameCapture
from dermis.images.filters import mip_chain
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

Halves = NDArray[np.float16]
MapLayerKey = tuple[str, int, int]
"""Role, mip level and layer of a picture."""
MIN_PICTURE_SIDE = 64
"""Minimum side of a map that is stored as a picture [texel]."""
_WEBP_QUALITY = 88
_QUANTISATION_LEVEL_COUNT = 256
_COLOUR_CHANNEL_COUNT = 3


@dataclass(frozen=True)
class EncodedMapLayer:
    """One layer of a map, encoded as a WebP image.

    data : WebP file: a colour image for a colour map, otherwise a grey image of the channels, stacked
        vertically
    curves : (c, 256) decoded values: one row per channel, indexed by the 8-bit value in the image
    texels : (h, w, c) texels decoded from the image
    """

    data: bytes
    curves: Halves
    texels: Halves


def encode_map_layer(texels: Halves, is_colour_map: bool) -> EncodedMapLayer:
    """Return one layer of a map encoded as a WebP image.

    texels : (h, w, c) texels
    is_colour_map : whether the first three channels are a colour, to be encoded as a colour image; any
        further channel must then be constant
    """
    curves = np.stack(
        [_quantisation_curve(texels[..., k].astype(np.float64)) for k in range(texels.shape[2])]
    )
    steps = np.stack([_nearest_levels(texels[..., k], curves[k]) for k in range(len(curves))], axis=-1)
    image = (
        steps[..., :_COLOUR_CHANNEL_COUNT]
        if is_colour_map
        else steps.transpose(2, 0, 1).reshape(-1, steps.shape[1])
    )
    data = _encode_webp(image)
    levels = _decode_webp(data)
    if is_colour_map:
        levels = np.concatenate([levels, steps[..., _COLOUR_CHANNEL_COUNT:]], axis=-1)
        levels[..., _COLOUR_CHANNEL_COUNT:] = steps[:1, :1, _COLOUR_CHANNEL_COUNT:]  # constant channels
    else:
        levels = levels[..., 0].reshape(len(curves), *texels.shape[:2]).transpose(1, 2, 0)
    decoded = np.stack([curves[k][levels[..., k]] for k in range(len(curves))], axis=-1)
    return EncodedMapLayer(data, curves.astype(np.float16), decoded.astype(np.float16))


def _quantisation_curve(texels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 256 increasing values to which a channel is quantised, with smaller steps near 0.

    texels : texels of the channel, whose minimum and maximum are the ends of the curve
    """
    limits = np.array([texels.min(), texels.max()])
    first, last = np.sign(limits) * np.sqrt(np.abs(limits))
    root = np.linspace(first, last, _QUANTISATION_LEVEL_COUNT)
    return np.asarray(np.sign(root) * root * root)


def _nearest_levels(texels: Halves, quantisation_curve: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return, for each texel, the index of the nearest value in `quantisation_curve`.

    quantisation_curve : increasing values to which texels are quantised
    """
    midpoints = 0.5 * (quantisation_curve[1:] + quantisation_curve[:-1])
    return np.searchsorted(midpoints, texels.astype(np.float64)).astype(np.uint8)


def _encode_webp(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "WEBP", quality=_WEBP_QUALITY, method=4)
    return file.getvalue()


def _decode_webp(webp_bytes: bytes) -> NDArray[np.uint8]:
    """Return the (h, w, 3) pixels of a WebP file."""
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(webp_bytes)).convert("RGB"))


_STORAGE_BINDING_USAGE = 8  # WebGPU's texture usage flag
_KNOT_STEPS_MM = 2.0**-8, 2.0**-8, 2.0**-8, 2.0**-14  # steps of a knot's position and radius
_COLOUR_ROLE = "colour_map"
_MAP_ROLES = (_COLOUR_ROLE, "relief_map", "slope_map", "specular_map", "roughness_map", "detail_map")


@dataclass
class MapPictures:
    """Maps encoded as WebP images.

    If the device can compute the mip levels of a map, only mip level 0 is encoded.

    pictures : one image for each layer of a mip level of a map; the keys are role, mip level and layer
    """

    pictures: dict[MapLayerKey, EncodedMapLayer] = field(default_factory=dict)
    _encoded_texels: dict[str, NDArray[np.float16]] = field(default_factory=dict)

    def matches_picture(self, map_role: str, texels: NDArray[np.float16]) -> bool:
        """Return whether texels equal the original texels of the first picture of a map.

        That picture shows layer 0 of the map at mip level 0.

        map_role : role of the map
        """
        return bool(np.array_equal(self._encoded_texels[map_role], texels))

    def replace_textures(
        self, renderer: Renderer, frame_capture: FrameCapture, captured_frames: Frames
    ) -> PictureMaps:
        """Encode the frames' maps as WebP images, and upload the decoded texels to the renderer's textures.

        The renderer then draws with the same maps as the page. Returns a dictionary from resource index to
        replaced map.
        """
        maps = {}
        for index, role in _picture_textures(frame_capture, captured_frames).items():
            texture, description = frame_capture.resource_at(index), frame_capture.resources[index]
            side, storable = min(description["size"][:2]), description["usage"] & _STORAGE_BINDING_USAGE
            mips = (
                1 if storable else sum(side >> mip >= MIN_PICTURE_SIDE for mip in range(description["mips"]))
            )
            levels = [self._add_pictures(frame_capture, index, role, mip) for mip in range(mips)]
            small_mips = range(mips, description["mips"] if mips > 1 else 0)
            levels += [read_texels(frame_capture, index, mip) for mip in small_mips]
            update_map(renderer, texture, levels)
            maps[index] = PictureMap(role, mips, capture_mips(frame_capture, texture) if storable else None)
        return maps

    def _add_pictures(
        self, frame_capture: FrameCapture, resource_index: int, map_role: str, mip_level: int
    ) -> NDArray[np.float16]:
        """Encode a mip level as WebP images, and return the (l, h, w, c) texels decoded from these images.

        resource_index : index of the texture or buffer in the capture
        mip_level : mip level, 0 for the full resolution
        """
        layers = read_texels(frame_capture, resource_index, mip_level)
        for layer, texels in enumerate(layers):
            if (map_role, mip_level, layer) not in self.pictures:
                self.pictures[map_role, mip_level, layer] = encode_map_layer(texels, map_role == _COLOUR_ROLE)
                self._encoded_texels.setdefault(map_role, texels)
        return np.stack([self.pictures[map_role, mip_level, layer].texels for layer in range(len(layers))])


def with_reduced_maps(head: Head, max_side: int) -> Head:
    """Return the head with its maps halved until no side is longer than `max_side` [texel]."""
    maps = head.maps
    if not isinstance(maps, Maps):
        return head
    names = "colour", "normal", "height", "specular", "roughness"
    arrays = {name: getattr(maps, name) for name in names}
    reduced: Any = {name: _reduce_map(one, max_side) for name, one in arrays.items() if one is not None}
    return replace(head, maps=replace(maps, **reduced))


def _reduce_map(texels: NDArray[np.float32], max_side: int) -> NDArray[np.float32]:
    mip = max(0, (max(texels.shape[:2]) - 1).bit_length() - (max_side - 1).bit_length())
    return np.asarray(mip_chain(texels)[mip], np.float32)


def quantise_hairs(
    renderer: Renderer, frame_capture: FrameCapture, captured_frames: Frames
) -> dict[int, tuple[float, ...]]:
    """Round the knots of hairs in the device's buffers, so that the buffers compress well.

    Returns the rounding steps of a knot's x, y, z and radius [mm] for each buffer, by resource index.
    """
    buffers = resources_bound_as(frame_capture, captured_frames, ("knots",))
    for index in buffers:
        knots = frame_capture.read_content(index)[0].view(np.float32).reshape(-1, len(_KNOT_STEPS_MM))
        data = quantise(knots, _KNOT_STEPS_MM)
        renderer.device.write(frame_capture.resource_at(index), data.tobytes(), data.nbytes)
    return dict.fromkeys(buffers, _KNOT_STEPS_MM)


def read_texels(frame_capture: FrameCapture, resource_index: int, mip_level: int) -> NDArray[np.float16]:
    """Return the texels (l, h, w, c) of one mip level of a half-float texture with l layers.

    resource_index : index of the texture among the resources of the capture
    """
    width, height, layers = frame_capture.resources[resource_index]["size"]
    sides = max(1, height >> mip_level), max(1, width >> mip_level)
    parts = frame_capture.read_content(resource_index)[mip_level * layers : (mip_level + 1) * layers]
    return np.stack([one.view(np.float16).reshape(*sides, -1) for one in parts])


def _picture_textures(frame_capture: FrameCapture, captured_frames: Frames) -> dict[int, str]:
    """Return a dictionary from resource index to role, for the map textures that are stored as WebP images.

    These are the half-float textures whose sides have at least `MIN_PICTURE_SIDE` texels. The role of a
    texture is its name in the shaders.
    """
    return {
        index: role
        for index, role in resources_bound_as(frame_capture, captured_frames, _MAP_ROLES).items()
        if frame_capture.resources[index].get("format", "").endswith("16float")
        and min(frame_capture.resources[index]["size"][:2]) >= MIN_PICTURE_SIDE
    }
