"""Loading of a head's maps from picture files: colour, normals, height, roughness, labels."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Floats, Numbers
from dermis.base.errors import refuse
from dermis.images.codecs import Pixels, row_strips
from dermis.images.filters import smooth_quantisation
from dermis.images.io import (
    EmbeddedPicture,
    note_properties,
    read_bytes,
    read_colours,
    read_image,
    read_size,
)
from dermis.images.sizes import MAX_PIXELS
from dermis.mesh.maps import Maps

PathLike = str | Path | EmbeddedPicture
ArrayType = TypeVar("ArrayType", bound=Numbers)

MAX_MAP_SIDE = 8192
"""Largest number of texels along a side of a map; every device supports textures of this size."""
_GREY_TOLERANCE = 2.5 / 255  # JPEG changes channels of a grey picture by a level or two
_MIN_OUTWARD_NORMAL_Z = 0.05  # clamps slopes to 87 degrees
MapLoader = Callable[[PathLike], Numbers]
_MAX_PARALLEL_TEXELS = MAX_PIXELS  # total of all maps that are decoded in parallel
_MIN_CACHED_BYTES = 1 << 14  # larger files are cached on disk, as reading is faster than decoding
_CACHE_VERSION = 2  # increment when the same files result in other maps


def check_finite(path: PathLike, texels: ArrayType) -> ArrayType:
    """Return a map after checking that all its values are finite.

    Raises DermisError for infinite values and NaN.
    """
    if texels.size and not (np.isfinite(texels.min()) and np.isfinite(texels.max())):
        advice = "Export it again, scaled to 0 to 1"
        refuse(path, "a map of finite numbers", "some are infinite or NaN", advice)
    return texels


def _convert_in_strips(
    image: Pixels, texel_shape: tuple[int, ...], convert_strip: Callable[[Any], Floats]
) -> Floats:
    """Convert a picture (H, W, ...) to an array (H, W, *texel_shape) in strips of rows, to save memory."""
    converted = np.empty((*image.shape[:2], *texel_shape), np.float32)
    for rows in row_strips(image):
        converted[rows] = convert_strip(image[rows])
    return converted


def colour_map(path: PathLike, apply_exif_orientation: bool = False) -> Floats:
    """Read a colour map (H, W, 3), linear Rec. 709; grey is repeated in all channels.

    apply_exif_orientation : whether to rotate the picture as its EXIF orientation states, as for photographs
    """
    _check_map_side(path, "a colour map")
    image, space = read_colours(path, apply_exif_orientation)
    if image.dtype == np.float32:
        return _check_unit_range(path, "a colour map", space.to_linear(check_finite(path, image)))
    return _convert_in_strips(image, (3,), space.to_linear)


def height_map(path: PathLike, relief_mm: np.float32) -> Floats:
    """Read a height map (H, W) [mm]; the quantisation steps of 8-bit maps are smoothed.

    relief_mm : height difference between black and white [mm]
    """
    image = _read_picture(path, "a height map")
    grey = _grey_levels(path, "a height map", image)
    height = smooth_quantisation(grey) if image.dtype == np.uint8 else grey
    with np.errstate(over="ignore"):
        height *= relief_mm
    return height


def mixture_map(path: PathLike) -> Floats:
    """Read a map (H, W, 2) with the fractions of two diffusion profiles that are mixed with the main profile.

    At each texel, the two fractions and the fraction of the main profile sum to 1. If the two fractions in
    the picture sum to more than 1, they are scaled so that their sum is 1.

    A colour picture holds the fractions in red and green. A grey picture holds the first fraction, and the
    second is 0.
    """
    role = "a map of profiles"
    image = _to_unit_range(_read_picture(path, role))
    fractions = np.zeros((*image.shape[:2], 2), np.float32)
    channels = 2 if image.shape[2] >= 3 and _channel_difference(image) > _GREY_TOLERANCE else 1
    fractions[..., :channels] = image[..., :channels]
    fractions = _check_unit_range(path, role, fractions)
    return np.asarray(fractions / np.maximum(fractions.sum(axis=-1, keepdims=True), 1.0))


def scalar_map(path: PathLike, map_description: str) -> Floats:
    """Read a grey map (H, W) of values from 0 to 1, without sRGB conversion [-].

    map_description : description of the map for error messages
    """
    return _check_unit_range(
        path, map_description, _grey_levels(path, map_description, _read_picture(path, map_description))
    )


def label_map(path: PathLike) -> Bytes:
    """Read a map (H, W) of 8-bit labels."""
    image = _read_picture(path, "a map of labels")
    if image.dtype != np.uint8 or image.shape[2] != 1:
        refuse(path, "labels in 8-bit grey", f"got {image.dtype} x {image.shape[2]}", "Save it as such")
    return np.asarray(image[..., 0], np.uint8)


def slope_map(path: PathLike, normal_y: str) -> Floats:
    """Read a normal map and return the slopes of the surface (H, W, 2).

    The components of the normals may be stored in 0..1 or -1..1. Texels whose normal does not point outwards
    get slope 0.

    normal_y : "up" or "down", see `load_maps`
    """
    image = _read_picture(path, "a normal map")
    if image.shape[2] < 3:
        refuse(path, "a normal map with red, green and blue", "it is grey", "Pass a height map as height")
    image = image[..., :3]
    signed = image.dtype == np.float32 and bool(image.min() < -0.01)
    slopes, statistics = np.empty((*image.shape[:2], 2), np.float32), np.zeros(4)
    for rows in row_strips(image):
        value = _to_unit_range(image[rows])
        normals = value if signed else 2 * value - 1
        statistics += _normal_statistics(normals)
        np.divide(-normals[..., :2], np.maximum(normals[..., 2:], _MIN_OUTWARD_NORMAL_Z), out=slopes[rows])
        slopes[rows][normals[..., 2] <= 0] = 0
    _check_normals(path, *statistics.tolist())
    if normal_y == "down":
        slopes[..., 1] *= -1
    return slopes


def _normal_statistics(normals: Floats) -> Doubles:
    """Return four statistics of normals, (4,).

    These are the number of texels, the number of texels with outward unit normals, the sum of the z
    components over all texels, and the sum of the z components over texels with outward unit normals.
    """
    length = np.sqrt(np.einsum("hwc,hwc->hw", normals, normals))
    z = normals[..., 2]
    outward = (np.abs(length - 1) < 0.15) & (z > 0)
    return np.array([z.size, outward.sum(), z.sum(dtype=np.float64), z[outward].sum(dtype=np.float64)])


def _check_normals(
    path: PathLike, texel_count: float, outward_count: float, z_sum: float, outward_z_sum: float
) -> None:
    """Refuse a picture with too few outward unit normals to be a tangent-space normal map.

    texel_count : number of texels
    outward_count : number of texels with outward unit normals
    z_sum : sum of the z components of the normals over all texels
    outward_z_sum : sum of the z components over texels with outward unit normals
    """
    # A quarter suffices, as the rest may be empty space between uv islands.
    if outward_count < 0.25 * texel_count or outward_z_sum < 0.7 * outward_count:
        actual = f"its mean blue is {(z_sum / texel_count + 1) / 2:.2f} and its colours are not unit vectors"
        refuse(path, "a tangent-space normal map, which looks light blue", actual, "Check which map this is")


def _check_map_side(path: PathLike, role: str) -> None:
    width, height = read_size(path)
    if max(width, height) > MAX_MAP_SIDE:
        expected = f"{role} of at most {MAX_MAP_SIDE} texels a side"
        refuse(path, expected, f"it has {width} x {height}", "Resize it")


def _read_picture(path: PathLike, role: str) -> Pixels:
    _check_map_side(path, role)
    image = read_image(path)
    return check_finite(path, image) if image.dtype == np.float32 else image


def _grey_levels(path: PathLike, role: str, image: Pixels) -> Floats:
    """Return a grey picture (H, W) scaled to [0, 1]; RGB is accepted if its channels are equal."""
    if image.shape[2] > 1:
        difference = max(_channel_difference(image[rows]) for rows in row_strips(image))
        if difference > _GREY_TOLERANCE:
            actual = f"its red, green and blue differ by up to {difference:.2f} of the full scale"
            refuse(path, f"{role} in grey", actual, "Check which map this is, or save it as grey")
    return _convert_in_strips(image[..., 0], (), _to_unit_range)


def _channel_difference(image: Pixels) -> float:
    """Return the largest difference of green and blue from red, relative to the full scale."""
    channels = _to_unit_range(image[..., :3])
    return max(float(np.abs(channels[..., k] - channels[..., 0]).max()) for k in (1, 2))


def _to_unit_range(image: Pixels) -> Floats:
    if image.dtype == np.float32:
        return np.asarray(image, np.float32)
    return np.asarray(image.astype(np.float32) / np.float32(np.iinfo(image.dtype.str).max))


def _check_unit_range(path: PathLike, role: str, texels: Floats) -> Floats:
    low, high = float(texels.min()), float(texels.max())
    if low < -1e-3 or high > 1 + 1e-3:
        refuse(path, f"{role} with values of 0 to 1", f"they go from {low:.4g} to {high:.4g}", "Scale them")
    return np.clip(texels, 0, 1, out=texels)


def load_maps(
    colour: PathLike | None = None,
    normal: PathLike | None = None,
    height: PathLike | None = None,
    height_mm: float | None = None,
    specular: PathLike | None = None,
    roughness: PathLike | None = None,
    region: PathLike | None = None,
    normal_y: Literal["up", "down"] = "up",
) -> Maps:
    """Load maps from picture files.

    colour : RGB in the colour space of the file, sRGB by default, or linear if the file holds floats; alpha
        is ignored
    normal : tangent-space normals, red towards +u, green as given by `normal_y`
    height : grey, white outwards; requires `height_mm`
    height_mm : height of one grey level of an 8-bit map [mm]; for a map of any bit depth, 1/255 of the height
        difference between white and black
    specular, roughness : grey, linear values without sRGB conversion
    region : 8-bit grey labels of the regions of the face
    normal_y : "up" if green points towards row 0 (OpenGL, Blender), "down" if away from row 0 (DirectX)

    Raises DermisError for a file that does not fit its role; the message names the file.
    """
    relief_mm = np.float32(255 * (height_mm or 0.0))
    if height is not None and not (np.isfinite(relief_mm) and relief_mm > 0):
        actual = "it is not set" if height_mm is None else f"it is {height_mm}"
        advice = "Skin maps have about 0.02 to 0.03; ask the author of the map"
        refuse(height, "a height map with height_mm, the mm per grey level, above 0", actual, advice)
    if normal is not None and normal_y not in ("up", "down"):
        refuse("normal_y", '"up" or "down"', f"it is {normal_y!r}", "Use the other if bumps look like dents")
    roles: dict[str, tuple[PathLike | None, str, MapLoader]] = {  # largest first
        "height": (height, f"height {relief_mm!r}", partial(height_map, relief_mm=relief_mm)),
        "colour": (colour, "glTF" if isinstance(colour, EmbeddedPicture) else "colour", colour_map),
        "normal": (normal, f"normal {normal_y}", partial(slope_map, normal_y=normal_y)),
        "specular": (specular, "grey", partial(scalar_map, map_description="a specular map")),
        "roughness": (roughness, "grey", partial(scalar_map, map_description="a roughness map")),
        "region": (region, "labels", label_map),
    }
    files = [path for path, _, _ in roles.values() if path is not None]
    parallel = sum(_texel_count(path) for path in files) <= _MAX_PARALLEL_TEXELS
    with ThreadPoolExecutor(os.cpu_count() if parallel else 1) as pool:  # decoders release the GIL
        maps = pool.map(lambda role: _cached_map(*role), roles.values())
        return Maps(**dict(zip(roles, maps, strict=True)))


def load_labels(path: PathLike) -> Bytes:
    """Load labels (H, W) from an 8-bit grey picture."""
    labels: Bytes = _cached_map(path, "labels", label_map)
    return labels


def _texel_count(path: PathLike) -> int:
    width, height = read_size(path)
    return width * height


def _cached_map(path: PathLike | None, cache_key_text: str, load_from_file: MapLoader) -> Any:
    """Return the map of a picture file, from the disk cache if the file is large; None without a file.

    cache_key_text : text of the map's role and options, which is part of the cache key
    load_from_file : function that reads the map from the file
    """
    if path is None:
        return None
    data = read_bytes(path)
    if len(data) < _MIN_CACHED_BYTES:
        return check_finite(path, load_from_file(path))
    from dermis.base.disk import cached_array

    note_properties(path, read_as_colours=load_from_file is colour_map)
    source = np.frombuffer(data, np.uint8)
    return cached_array(
        source, f"map {_CACHE_VERSION} {cache_key_text}", lambda: check_finite(path, load_from_file(path))
    )
