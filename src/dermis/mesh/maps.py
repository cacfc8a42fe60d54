"""Maps of a mesh from picture files, in the units that the renderer works with."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.summary import Summarised
from dermis.images.io import read_bytes, read_size
from dermis.images.sizes import MOST_PIXELS
from dermis.mesh.map_pixels import (
    Floats,
    PathLike,
    colour_map,
    finite,
    height_map,
    label_map,
    plain_map,
    slope_map,
)

Load = Callable[[PathLike], NDArray[Any]]

_MOST_AT_ONCE = MOST_PIXELS  # texels of all maps, for maps to be decoded side by side
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
        "height": (height, f"height {relief_mm!r}", partial(height_map, relief_mm=relief_mm)),
        "colour": (colour, "colour", colour_map),
        "normal": (normal, f"normal {normal_y}", partial(slope_map, normal_y=normal_y)),
        "specular": (specular, "grey", partial(plain_map, role="a specular map")),
        "roughness": (roughness, "grey", partial(plain_map, role="a roughness map")),
        "region": (region, "labels", label_map),
    }
    files = [path for path, _, _ in roles.values() if path is not None]
    few = sum(_texels(path) for path in files) <= _MOST_AT_ONCE
    with ThreadPoolExecutor(os.cpu_count() if few else 1) as pool:  # decoders do not hold other threads up
        return Maps(**dict(zip(roles, pool.map(lambda role: _kept(*role), roles.values()), strict=True)))


def load_labels(path: PathLike) -> NDArray[np.uint8]:
    """(H, W) labels of a grey picture of 8 bits."""
    labels: NDArray[np.uint8] = _kept(path, "labels", label_map)
    return labels


def _texels(path: PathLike) -> int:
    width, height = read_size(path)
    return width * height


def _kept(path: PathLike | None, how: str, load: Load) -> Any:
    """The map that `load` returns for a picture file, kept on disk when the file is large; None for no file.

    how : all that the map depends on besides the file
    """
    if path is None:
        return None
    data = read_bytes(path)
    if len(data) < _LARGE:
        return finite(path, load(path))
    from dermis.base.disk import cached_array

    source = np.frombuffer(data, np.uint8)
    return cached_array(source, f"map {_FORM} {how}", lambda: finite(path, load(path)))
