"""A head's maps as files: what is baked, its relief, and a JSON that says what the numbers are."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.maps_encoding import NormalY, exr, levels, with_green
from dermis.apps.export.targets.maps_meaning import MEANINGS
from dermis.base.errors import refuse
from dermis.frame.baking import Baked, bake
from dermis.frame.painted import with_painted_maps
from dermis.frame.passes.painting.paint import LEAST, MOST
from dermis.frame.renderer import Renderer
from dermis.images.codecs import encode_png
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
LOGGER = logging.getLogger("dermis")
SIDES = tuple(1 << k for k in range(8, 14))
"""Sides that the maps may have [texel]."""


def check_side(side: object) -> int:
    """The side of the maps.

    Raises DermisError for one that is none of `SIDES`.
    """
    if side not in SIDES or isinstance(side, bool):
        came = f"{side!r} came"
        refuse("size of the maps", f"a power of two from {SIDES[0]} to {SIDES[-1]}", came, "Take 2048")
    assert isinstance(side, int)
    return side


def baked_maps(renderer: Renderer, scene: Scene, settings: Settings, side: int) -> Baked:
    """The maps of the skin in the scene's light, with its relief as heights where it has such."""
    baked = bake(renderer, scene, settings, side)
    painted = renderer.kept_open.run(
        lambda: with_painted_maps(renderer.device, scene.head, min(max(side, LEAST), MOST))
    )
    height = painted.maps.height
    if height is None:
        baked.absent["height"] = "the head has no map of heights"
    else:
        baked.maps["height"] = resampled(height, side)
    return baked


def map_files(baked: Baked, scene: Scene, normal_y: NormalY) -> Iterator[tuple[str, bytes]]:
    """Names and contents of the files, the JSON last."""
    described: dict[str, Any] = {}
    for name, meaning in MEANINGS.items():
        if name not in baked.maps:
            continue
        values = with_green(baked.maps[name], normal_y) if name == "normal" else baked.maps[name]
        LOGGER.info("writing %s", name)
        yield f"{name}.exr", exr(name, values)
        inside = values[baked.covered]
        bounds = {"least": _plain(inside.min(axis=0)), "largest": _plain(inside.max(axis=0))}
        described[name] = {"unit": meaning.unit, "meaning": meaning.words, "exr": "linear", **bounds}
        if meaning.shown != "none":
            picture, told = levels(values, meaning)
            yield f"{name}.png", encode_png(picture[..., None] if picture.ndim == 2 else picture, 6)
            described[name] |= told
    yield "maps.json", (json.dumps(_told(baked, scene, normal_y, described), indent=1) + "\n").encode()


def _told(baked: Baked, scene: Scene, normal_y: NormalY, described: dict[str, Any]) -> dict[str, Any]:
    """What a reader of the maps must know."""
    lights = [light.model_dump(mode="json") for light in scene.lights]
    around = scene.environment
    return {
        "format": "dermis maps 1",
        "made_by": f"dermis {version('dermis')}",
        "size": len(baked.covered),
        "layout": "the head's own uv, each texel at its centre; row 0 of the pictures is the top, v = 1 in "
        "glTF's and OBJ's upward count",
        "covered": float(baked.covered.mean()),
        "beyond_the_skin": "the nearest texel of the skin, so that filters never read black",
        "normal_green": "up (OpenGL)" if normal_y == "up" else "down (DirectX)",
        "relief": "normal and height hold the same relief: use one of them",
        "colours": "linear Rec. 709 in OpenEXR",
        "irradiance_unit": "that of the lights; pi makes white skin 1",
        "lights": lights,
        "environment": None if around is None else around.model_dump(mode="json"),
        "profile": scene.skin.profile,
        "maps": described,
        "absent": baked.absent,
    }


def resampled(values: Floats, side: int) -> Floats:
    """A map (h, w) at another side: means of texels where that is smaller, else what lies between them."""
    height, width = values.shape
    while min(height, width) >= 2 * side and not (height | width) & 1:
        values = 0.25 * (values[0::2, 0::2] + values[1::2, 0::2] + values[0::2, 1::2] + values[1::2, 1::2])
        height, width = values.shape
    if (height, width) == (side, side):
        return np.ascontiguousarray(values, np.float32)
    for axis, length in enumerate((height, width)):
        at = np.clip((np.arange(side) + 0.5) / side * length - 0.5, 0.0, length - 1.0)
        low = np.minimum(at.astype(np.int64), max(length - 2, 0))
        share = np.expand_dims((at - low).astype(np.float32), 1 - axis)
        high = np.minimum(low + 1, length - 1)
        values = (1.0 - share) * values.take(low, axis) + share * values.take(high, axis)
    return np.ascontiguousarray(values, np.float32)


def _plain(value: Any) -> Any:
    return np.round(np.asarray(value, np.float64), 6).tolist()
