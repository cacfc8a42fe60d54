"""Maps of a head from picture files."""

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
from dermis.images.codecs import Pixels, strips
from dermis.images.colour import decode_srgb_levels
from dermis.images.filters import smooth_quantisation
from dermis.images.io import EmbeddedPicture, read_bytes, read_image, read_size
from dermis.images.sizes import MAX_PIXELS
from dermis.mesh.maps import Maps

PathLike = str | Path | EmbeddedPicture
A = TypeVar("A", bound=Numbers)

MAX_SIDE = 8192
"""Texels of a map's side: as many as any device takes."""
_GREY_TOLERANCE = 2.5 / 255  # JPEG may separate the channels of a grey picture by a level or two
_MIN_NORMAL_Z = 0.05  # slopes steeper than 87 degrees are capped; nothing real leans further
Load = Callable[[PathLike], Numbers]
_MAX_PARALLEL_TEXELS = MAX_PIXELS  # texels of all maps, for maps to be decoded side by side
_MIN_CACHED_BYTES = 1 << 14  # bytes; maps of larger files are kept on disk, to be read faster than decoded
_CACHE_VERSION = 1  # increment when the same files give other maps


def check_finite(path: PathLike, values: A) -> A:
    """A map whose numbers are all finite.

    DermisError : some are not, after whatever was done to those of the file
    """
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        refuse(
            path, "a map of finite numbers", "some are infinite or NaN", "Export it again, scaled to 0 to 1"
        )
    return values


def _convert_in_strips(image: Pixels, shape: tuple[int, ...], convert: Callable[[Any], Floats]) -> Floats:
    """(H, W, *shape) of what a picture becomes, some rows at a time, so that little is in memory twice."""
    found = np.empty((*image.shape[:2], *shape), np.float32)
    for rows in strips(image):
        found[rows] = convert(image[rows])
    return found


def colour_map(path: PathLike) -> Floats:
    image = _read(path, "a colour map")
    if image.shape[2] < 3:
        refuse(path, "a colour map with red, green and blue", "it is grey", "Save it as RGB")
    image = image[..., :3]
    if image.dtype == np.float32:
        return _check_unit_range(path, "a colour map", np.ascontiguousarray(image))
    return _convert_in_strips(image, (3,), decode_srgb_levels)


def height_map(path: PathLike, relief_mm: np.float32) -> Floats:
    """(H, W) of so many mm for the full scale; 8-bit steps are smoothed away, finer ones stay."""
    image = _read(path, "a height map")
    grey = _grey(path, "a height map", image)
    height = smooth_quantisation(grey) if image.dtype == np.uint8 else grey
    with np.errstate(over="ignore"):
        height *= relief_mm
    return height


def mixture_map(path: PathLike) -> Floats:
    """(H, W, 2) shares of two others in a mixture, 0..1, together at most 1: red and green, or grey and 0."""
    role = "a map of profiles"
    image = _to_unit_range(_read(path, role))
    shares = np.zeros((*image.shape[:2], 2), np.float32)
    given = 2 if image.shape[2] >= 3 and _channel_difference(image) > _GREY_TOLERANCE else 1
    shares[..., :given] = image[..., :given]
    shares = _check_unit_range(path, role, shares)
    return np.asarray(shares / np.maximum(shares.sum(axis=-1, keepdims=True), 1.0))


def scalar_map(path: PathLike, role: str) -> Floats:
    """(H, W) values 0..1 [-], not through the sRGB curve."""
    return _check_unit_range(path, role, _grey(path, role, _read(path, role)))


def label_map(path: PathLike) -> Bytes:
    image = _read(path, "a map of labels")
    if image.dtype != np.uint8 or image.shape[2] != 1:
        refuse(path, "labels in 8-bit grey", f"got {image.dtype} x {image.shape[2]}", "Save it as such")
    return np.asarray(image[..., 0], np.uint8)


def slope_map(path: PathLike, normal_y: str) -> Floats:
    """(H, W, 2) slopes of a normal map of 0..1 or -1..1; texels without an outward normal are flat."""
    image = _read(path, "a normal map")
    if image.shape[2] < 3:
        refuse(path, "a normal map with red, green and blue", "it is grey", "If it is a height map, say so")
    image = image[..., :3]
    signed = image.dtype == np.float32 and bool(image.min() < -0.01)
    slopes, found = np.empty((*image.shape[:2], 2), np.float32), np.zeros(4)
    for rows in strips(image):
        value = _to_unit_range(image[rows])
        normals = value if signed else 2 * value - 1
        found += _normal_statistics(normals)
        np.divide(-normals[..., :2], np.maximum(normals[..., 2:], _MIN_NORMAL_Z), out=slopes[rows])
        slopes[rows][normals[..., 2] <= 0] = 0
    _check_normals(path, *found.tolist())
    if normal_y == "down":
        slopes[..., 1] *= -1
    return slopes


def _normal_statistics(normals: Floats) -> Doubles:
    """How many texels there are, how many are unit vectors that point outwards, and the sums of both's z."""
    length = np.sqrt(np.einsum("hwc,hwc->hw", normals, normals))
    z = normals[..., 2]
    outward = (np.abs(length - 1) < 0.15) & (z > 0)
    return np.array([z.size, outward.sum(), z.sum(dtype=np.float64), z[outward].sum(dtype=np.float64)])


def _check_normals(path: PathLike, texels: float, outward: float, z: float, outward_z: float) -> None:
    """Refuse pictures that are no normal maps: few of their texels are unit vectors that point outwards."""
    # A quarter is enough: the rest may be empty space between uv islands.
    if outward < 0.25 * texels or outward_z < 0.7 * outward:
        actual = f"its mean blue is {(z / texels + 1) / 2:.2f} and its colours are no unit vectors"
        refuse(path, "a tangent-space normal map, which looks light blue", actual, "Check which map this is")


def _read(path: PathLike, role: str) -> Pixels:
    width, height = read_size(path)
    if max(width, height) > MAX_SIDE:
        expected = f"{role} of at most {MAX_SIDE} texels a side"
        refuse(path, expected, f"it has {width} x {height}", "Resize it")
    image = read_image(path)
    return check_finite(path, image) if image.dtype == np.float32 else image


def _grey(path: PathLike, role: str, image: Pixels) -> Floats:
    """(H, W) in units of the full scale, of a grey picture or of RGB whose channels agree."""
    if image.shape[2] > 1:
        apart = max(_channel_difference(image[rows]) for rows in strips(image))
        if apart > _GREY_TOLERANCE:
            actual = f"its red, green and blue differ by up to {apart:.2f} of the full scale"
            refuse(path, f"{role} in grey", actual, "Check which map this is, or save it as grey")
    return _convert_in_strips(image[..., 0], (), _to_unit_range)


def _channel_difference(image: Pixels) -> float:
    """How much green and blue differ from red at most, in units of the full scale."""
    channels = _to_unit_range(image[..., :3])
    return max(float(np.abs(channels[..., k] - channels[..., 0]).max()) for k in (1, 2))


def _to_unit_range(image: Pixels) -> Floats:
    if image.dtype == np.float32:
        return np.asarray(image, np.float32)
    return np.asarray(image.astype(np.float32) / np.float32(np.iinfo(image.dtype.str).max))


def _check_unit_range(path: PathLike, role: str, values: Floats) -> Floats:
    low, high = float(values.min()), float(values.max())
    if low < -1e-3 or high > 1 + 1e-3:
        refuse(path, f"{role} with values of 0 to 1", f"they go from {low:.4g} to {high:.4g}", "Scale them")
    return np.clip(values, 0, 1, out=values)


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
    """The maps in these picture files.

    colour : RGB in sRGB, or linear when the file holds floats; alpha is left out
    normal : tangent-space normals, red towards +u, green as `normal_y` says
    height : grey, white outwards; needs `height_mm`
    height_mm : relief of one grey level of an 8-bit map, 1/255 of the full scale at any depth, so that
        the same picture gives the same relief in 8 bits, 16 bits or floats of 0..1 [mm]
    specular, roughness : grey, taken as plain numbers and not through the sRGB curve
    region : grey of 8 bits, the labels themselves
    normal_y : "up" when green points to row 0 (OpenGL, Blender), "down" when away from it (DirectX)
    DermisError : a file is not what its role asks for; the message names it
    """
    relief_mm = np.float32(255 * (height_mm or 0.0))
    if height is not None and not (np.isfinite(relief_mm) and relief_mm > 0):
        actual = "none was given" if height_mm is None else f"it is {height_mm}"
        advice = "Skin maps have about 0.02 to 0.03; the map's author knows"
        refuse(height, "a height map with height_mm, the mm per grey level, above 0", actual, advice)
    if normal is not None and normal_y not in ("up", "down"):
        refuse("normal_y", '"up" or "down"', f"it is {normal_y!r}", "Try the other if bumps look like dents")
    roles: dict[str, tuple[PathLike | None, str, Load]] = {  # the largest first
        "height": (height, f"height {relief_mm!r}", partial(height_map, relief_mm=relief_mm)),
        "colour": (colour, "colour", colour_map),
        "normal": (normal, f"normal {normal_y}", partial(slope_map, normal_y=normal_y)),
        "specular": (specular, "grey", partial(scalar_map, role="a specular map")),
        "roughness": (roughness, "grey", partial(scalar_map, role="a roughness map")),
        "region": (region, "labels", label_map),
    }
    files = [path for path, _, _ in roles.values() if path is not None]
    few = sum(_texel_count(path) for path in files) <= _MAX_PARALLEL_TEXELS
    with ThreadPoolExecutor(os.cpu_count() if few else 1) as pool:  # decoders do not hold other threads up
        return Maps(
            **dict(zip(roles, pool.map(lambda role: _cached_map(*role), roles.values()), strict=True))
        )


def load_labels(path: PathLike) -> Bytes:
    """(H, W) labels of a grey picture of 8 bits."""
    labels: Bytes = _cached_map(path, "labels", label_map)
    return labels


def _texel_count(path: PathLike) -> int:
    width, height = read_size(path)
    return width * height


def _cached_map(path: PathLike | None, how: str, load: Load) -> Any:
    """The map that `load` returns for a picture file, kept on disk when the file is large; None for no file.

    how : all that the map depends on besides the file
    """
    if path is None:
        return None
    data = read_bytes(path)
    if len(data) < _MIN_CACHED_BYTES:
        return check_finite(path, load(path))
    from dermis.base.disk import cached_array

    source = np.frombuffer(data, np.uint8)
    return cached_array(source, f"map {_CACHE_VERSION} {how}", lambda: check_finite(path, load(path)))
