"""Pixels of picture files as the numbers that maps hold."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.images.codecs import strips
from dermis.images.colour import decode_srgb_levels
from dermis.images.filters import without_steps
from dermis.images.io import Picture, read_image, read_size

Floats = NDArray[np.float32]
PathLike = str | Path | Picture

MOST_SIDE = 8192
"""Texels of a map's side: as many as any device takes."""
_ALIKE = 2.5 / 255  # JPEG may separate the channels of a grey picture by a level or two
_MIN_NORMAL_Z = 0.05  # slopes steeper than 87 degrees are capped; nothing real leans further


def finite(path: PathLike, values: NDArray[Any]) -> NDArray[Any]:
    """A map whose numbers are all finite.

    DermisError : some are not, after whatever was done to those of the file
    """
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        refuse(
            path, "a map of finite numbers", "some are infinite or NaN", "Export it again, scaled to 0 to 1"
        )
    return values


def _converted(image: NDArray[Any], shape: tuple[int, ...], convert: Callable[[NDArray[Any]], Any]) -> Floats:
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
        return _within_unit(path, "a colour map", np.ascontiguousarray(image))
    return _converted(image, (3,), decode_srgb_levels)


def height_map(path: PathLike, relief_mm: np.float32) -> Floats:
    """(H, W) of so many mm for the full scale; 8-bit steps are smoothed away, finer ones stay."""
    image = _read(path, "a height map")
    grey = _grey(path, "a height map", image)
    height = without_steps(grey) if image.dtype == np.uint8 else grey
    with np.errstate(over="ignore"):
        height *= relief_mm
    return height


def share_map(path: PathLike) -> Floats:
    """(H, W, 2) shares of two others in a mixture, 0..1, together at most 1: red and green, or grey and 0."""
    role = "a map of profiles"
    image = _as_unit(_read(path, role))
    shares = np.zeros((*image.shape[:2], 2), np.float32)
    given = 2 if image.shape[2] >= 3 and _apart(image) > _ALIKE else 1
    shares[..., :given] = image[..., :given]
    shares = _within_unit(path, role, shares)
    return np.asarray(shares / np.maximum(shares.sum(axis=-1, keepdims=True), 1.0))


def plain_map(path: PathLike, role: str) -> Floats:
    """(H, W) values 0..1 [-], not through the sRGB curve."""
    return _within_unit(path, role, _grey(path, role, _read(path, role)))


def label_map(path: PathLike) -> NDArray[np.uint8]:
    image = _read(path, "a map of labels")
    if image.dtype != np.uint8 or image.shape[2] != 1:
        refuse(path, "labels in 8-bit grey", f"{image.dtype} x {image.shape[2]} came", "Save it as such")
    return image[..., 0]


def slope_map(path: PathLike, normal_y: str) -> Floats:
    """(H, W, 2) slopes of a normal map of 0..1 or -1..1; texels without an outward normal are flat."""
    image = _read(path, "a normal map")
    if image.shape[2] < 3:
        refuse(path, "a normal map with red, green and blue", "it is grey", "If it is a height map, say so")
    image = image[..., :3]
    signed = image.dtype == np.float32 and bool(image.min() < -0.01)
    slopes, found = np.empty((*image.shape[:2], 2), np.float32), np.zeros(4)
    for rows in strips(image):
        value = _as_unit(image[rows])
        normals = value if signed else 2 * value - 1
        found += _outward(normals)
        np.divide(-normals[..., :2], np.maximum(normals[..., 2:], _MIN_NORMAL_Z), out=slopes[rows])
        slopes[rows][normals[..., 2] <= 0] = 0
    _check_normals(path, *found.tolist())
    if normal_y == "down":
        slopes[..., 1] *= -1
    return slopes


def _outward(normals: Floats) -> NDArray[np.float64]:
    """How many texels there are, how many are unit vectors that point outwards, and the sums of both's z."""
    length = np.sqrt(np.einsum("hwc,hwc->hw", normals, normals))
    z = normals[..., 2]
    outward = (np.abs(length - 1) < 0.15) & (z > 0)
    return np.array([z.size, outward.sum(), z.sum(dtype=np.float64), z[outward].sum(dtype=np.float64)])


def _check_normals(path: PathLike, texels: float, outward: float, z: float, outward_z: float) -> None:
    """Refuse pictures that are no normal maps: few of their texels are unit vectors that point outwards."""
    # A quarter is enough: the rest may be empty space between uv islands.
    if outward < 0.25 * texels or outward_z < 0.7 * outward:
        came = f"its mean blue is {(z / texels + 1) / 2:.2f} and its colours are no unit vectors"
        refuse(path, "a tangent-space normal map, which looks light blue", came, "Check which map this is")


def _read(path: PathLike, role: str) -> NDArray[Any]:
    width, height = read_size(path)
    if max(width, height) > MOST_SIDE:
        expected = f"{role} of at most {MOST_SIDE} texels a side"
        refuse(path, expected, f"it has {width} x {height}", "Resize it")
    image = read_image(path)
    return finite(path, image) if image.dtype == np.float32 else image


def _grey(path: PathLike, role: str, image: NDArray[Any]) -> Floats:
    """(H, W) in units of the full scale, of a grey picture or of RGB whose channels agree."""
    if image.shape[2] > 1:
        apart = max(_apart(image[rows]) for rows in strips(image))
        if apart > _ALIKE:
            came = f"its red, green and blue differ by up to {apart:.2f} of the full scale"
            refuse(path, f"{role} in grey", came, "Check which map this is, or save it as grey")
    return _converted(image[..., 0], (), _as_unit)


def _apart(image: NDArray[Any]) -> float:
    """How much green and blue differ from red at most, in units of the full scale."""
    channels = _as_unit(image[..., :3])
    return max(float(np.abs(channels[..., k] - channels[..., 0]).max()) for k in (1, 2))


def _as_unit(image: NDArray[Any]) -> Floats:
    if image.dtype == np.float32:
        return image
    return image.astype(np.float32) / np.float32(np.iinfo(image.dtype).max)


def _within_unit(path: PathLike, role: str, values: Floats) -> Floats:
    low, high = float(values.min()), float(values.max())
    if low < -1e-3 or high > 1 + 1e-3:
        refuse(path, f"{role} with values of 0 to 1", f"they go from {low:.4g} to {high:.4g}", "Scale them")
    return np.clip(values, 0, 1, out=values)
