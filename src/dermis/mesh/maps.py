"""Maps of a mesh from picture files, in the units that the renderer works with."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.images.colour import decode_srgb_levels
from dermis.images.filters import without_steps
from dermis.images.io import Picture, read_bytes, read_image
from dermis.summary import Summarised

Floats = NDArray[np.float32]
PathLike = str | Path | Picture
Load = Callable[[PathLike], NDArray[Any]]

_MAX_SIZE = 16384
_MIN_NORMAL_Z = 0.05  # slopes steeper than 87 degrees are capped; nothing real leans further
_LARGE = 1 << 14  # bytes; maps of larger files are kept on disk, to be read faster than decoded
_MEAN_TEXELS, _MOST_APART = 64, 16  # for means: fewest samples a side, largest stride
_FORM = 1  # increment when the same files give other maps


@dataclass(frozen=True, repr=False)
class Maps(Summarised):
    """Maps of the skin, None where there is none. Row 0 is the top; sizes may differ from map to map.

    colour : (H, W, 3) linear Rec. 709 [-]
    normal : (H, W, 2) slopes dh/du and dh/d(up) of the bumps, up being towards row 0 [-]
    height : (H, W) outwards, from an arbitrary zero [mm]
    specular : (H, W) plain grey 0..1; the renderer scales it to a mean over the skin [-]
    roughness : (H, W) plain grey 0..1 [-]
    region : (H, W) uint8 part of the face, an index into the head's own list
    """

    colour: Floats | None = None
    normal: Floats | None = None
    height: Floats | None = None
    specular: Floats | None = None
    roughness: Floats | None = None
    region: NDArray[np.uint8] | None = None
    painted: ClassVar[bool] = False
    """Whether the device paints those that are None."""

    @property
    def rough(self) -> bool:
        """Whether the roughness comes from a map."""
        return self.roughness is not None

    @cached_property
    def mean_colour(self) -> NDArray[np.float64] | None:
        """(3,) of the colour map, without the black texels of empty space [-]."""
        if self.colour is None:
            return None
        apart = int(np.clip(min(self.colour.shape[:2]) // _MEAN_TEXELS, 1, _MOST_APART))
        texels = self.colour[::apart, ::apart].reshape(-1, 3).astype(np.float64)
        painted = texels[texels.sum(axis=1) > 0.0]
        return np.asarray(painted.mean(axis=0)) if len(painted) else np.zeros(3)


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
        came = "none was given" if height_mm is None else f"it is {height_mm}"
        remedy = "Skin maps have about 0.02 to 0.03; the map's author knows"
        refuse(height, "a height map with height_mm, the mm per grey level, above 0", came, remedy)
    if normal is not None and normal_y not in ("up", "down"):
        refuse("normal_y", '"up" or "down"', f"it is {normal_y!r}", "Try the other if bumps look like dents")
    roles: dict[str, tuple[PathLike | None, str, Load]] = {  # the largest first
        "height": (height, f"height {relief_mm!r}", lambda path: _height(path) * relief_mm),
        "colour": (colour, "colour", _colour),
        "normal": (normal, f"normal {normal_y}", partial(_slopes, normal_y=normal_y)),
        "specular": (specular, "grey", partial(_plain_grey, role="a specular map")),
        "roughness": (roughness, "grey", partial(_plain_grey, role="a roughness map")),
        "region": (region, "labels", _labels),
    }
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # decoders do not hold other threads up
        return Maps(**dict(zip(roles, pool.map(lambda role: _kept(*role), roles.values()), strict=True)))


def _colour(path: PathLike) -> Floats:
    image = _read(path, "a colour map")
    if image.shape[2] < 3:
        refuse(path, "a colour map with red, green and blue", "it is grey", "Save it as RGB")
    image = image[..., :3]
    if image.dtype == np.float32:
        return _within_unit(path, "a colour map", image)
    return decode_srgb_levels(image)


def _height(path: PathLike) -> Floats:
    """(H, W) in units of the full scale; 8-bit steps are smoothed away, finer ones stay."""
    image = _read(path, "a height map")
    grey = _grey(path, "a height map", image)
    return without_steps(grey) if image.dtype == np.uint8 else grey


def _plain_grey(path: PathLike, role: str) -> Floats:
    """(H, W) values 0..1 [-], not through the sRGB curve."""
    return _within_unit(path, role, _grey(path, role, _read(path, role)))


def load_labels(path: PathLike) -> NDArray[np.uint8]:
    """(H, W) labels of a grey picture of 8 bits."""
    labels: NDArray[np.uint8] = _kept(path, "labels", _labels)
    return labels


def _labels(path: PathLike) -> NDArray[np.uint8]:
    image = _read(path, "a map of labels")
    if image.dtype != np.uint8 or image.shape[2] != 1:
        refuse(path, "labels in 8-bit grey", f"{image.dtype} x {image.shape[2]} came", "Save it as such")
    return image[..., 0]


def _slopes(path: PathLike, normal_y: str) -> Floats:
    """(H, W, 2) slopes of a normal map of 0..1 or -1..1; texels without an outward normal are flat."""
    image = _read(path, "a normal map")
    if image.shape[2] < 3:
        refuse(path, "a normal map with red, green and blue", "it is grey", "If it is a height map, say so")
    value = _as_unit(image[..., :3])
    signed = image.dtype == np.float32 and bool(value.min() < -0.01)
    normals = value if signed else 2 * value - 1
    _check_normals(path, normals)
    slopes: Floats = np.divide(
        -normals[..., :2], np.maximum(normals[..., 2:], _MIN_NORMAL_Z), dtype=np.float32
    )
    slopes[normals[..., 2] <= 0] = 0
    if normal_y == "down":
        slopes[..., 1] *= -1
    return slopes


def _check_normals(path: PathLike, normals: Floats) -> None:
    """Refuse pictures that are no normal maps: few of their texels are unit vectors that point outwards."""
    length = np.sqrt(np.einsum("hwc,hwc->hw", normals, normals))
    outward = (np.abs(length - 1) < 0.15) & (normals[..., 2] > 0)
    # A quarter is enough: the rest may be empty space between uv islands.
    if outward.mean() < 0.25 or normals[..., 2][outward].mean() < 0.7:
        came = f"its mean blue is {(normals[..., 2].mean() + 1) / 2:.2f} and its colours are no unit vectors"
        refuse(path, "a tangent-space normal map, which looks light blue", came, "Check which map this is")


def _kept(path: PathLike | None, how: str, load: Load) -> Any:
    """The map that `load` returns for a picture file, kept on disk when the file is large; None for no file.

    how : all that the map depends on besides the file
    """
    if path is None:
        return None
    data = read_bytes(path)
    if len(data) < _LARGE:
        return load(path)
    from dermis.disk import cached_array

    return cached_array(np.frombuffer(data, np.uint8), f"map {_FORM} {how}", lambda: load(path))


def _read(path: PathLike, role: str) -> NDArray[Any]:
    image = read_image(path)
    rows, columns = image.shape[:2]
    if max(rows, columns) > _MAX_SIZE:
        expected = f"{role} of at most {_MAX_SIZE} texels a side"
        refuse(path, expected, f"it has {columns} x {rows}", "Resize it")
    if image.dtype == np.float32 and not np.isfinite(image).all():
        refuse(path, f"{role} of finite numbers", "it holds infinities or NaN", "Export it again")
    return image


def _grey(path: PathLike, role: str, image: NDArray[Any]) -> Floats:
    """(H, W) in units of the full scale, of a grey picture or of RGB whose channels agree."""
    channels = _as_unit(image[..., :3] if image.shape[2] > 1 else image)
    # JPEG may separate the channels of a grey picture by a level or two.
    others = range(1, channels.shape[2])
    apart = max((float(np.abs(channels[..., k] - channels[..., 0]).max()) for k in others), default=0.0)
    if apart > 2.5 / 255:
        came = f"its red, green and blue differ by up to {apart:.2f} of the full scale"
        refuse(path, f"{role} in grey", came, "Check which map this is, or save it as grey")
    return np.ascontiguousarray(channels[..., 0])


def _as_unit(image: NDArray[Any]) -> Floats:
    if image.dtype == np.float32:
        return image
    return image.astype(np.float32) / np.float32(np.iinfo(image.dtype).max)


def _within_unit(path: PathLike, role: str, values: Floats) -> Floats:
    low, high = float(values.min()), float(values.max())
    if low < -1e-3 or high > 1 + 1e-3:
        refuse(path, f"{role} with values of 0 to 1", f"they go from {low:.4g} to {high:.4g}", "Scale them")
    return np.clip(values, 0, 1)
