"""Maps of a head in its own uv layout, with light before and after it spreads, as pictures."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import gaussian_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, value_of, with_values, write_files
from dermis.base.errors import refuse
from dermis.base.version import version
from dermis.frame.baking import Baked, bake
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.frame.renderer import Renderer
from dermis.human.skin.painted import LEAST_SIDE, MOST_SIDE
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.images.io import encode_exr_parts
from dermis.optics.curve import Curve
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
Ranges = dict[str, str | float | list[float]]
NormalY = Literal["up", "down"]
SIDES = tuple(1 << k for k in range(8, 14))
"""Sides that the maps may have [texel]."""
_MOST, _BRIGHT = 65535, 99.9
_LOGGER = logging.getLogger("dermis")
Shown = Literal["colour", "light", "normal", "share", "range", "root", "none"]
"""How a PNG holds a map: sRGB of 8 bits; the same of light, divided by its 99.9th percentile; a normal n as
(n + 1) / 2 in 16 bits; a share in 16 bits; 16 bits from the least to the largest value; the square root in
16 bits; not at all."""
_SPREAD = "scattered"
_ATLAS = 2048  # texels of the map in which light spreads, at most


@dataclass(frozen=True)
class Meaning:
    """Meaning of a map.

    unit : of its numbers in OpenEXR, empty for none
    shown : how a PNG has it
    words : what it is
    """

    unit: str
    shown: Shown
    words: str


MEANINGS: Mapping[str, Meaning] = MappingProxyType(
    {
        "albedo": Meaning(
            "", "colour", "share of the light that comes back from below the surface, Rec. 709"
        ),
        "normal": Meaning("", "normal", "normal with the relief in tangent space: x along +u, z outwards"),
        "height": Meaning("mm", "range", "relief outwards, from an arbitrary zero; the normal's own"),
        "roughness": Meaning("", "root", "Beckmann m, with the relief that is finer than a texel"),
        "rho_s": Meaning("", "share", "factor of the surface's reflection"),
        "reflected": Meaning("", "share", "share of light from everywhere that the rough surface takes"),
        "melanin": Meaning("", "share", "share of the epidermis' volume"),
        "blood": Meaning("", "share", "share of the dermis' volume"),
        "thickness": Meaning("mm", "range", "of the flesh below, as far as light is followed"),
        "curvature": Meaning("1/mm", "range", "root mean square of the principal curvatures, smoothed"),
        "stretch": Meaning("mm", "none", "length on the skin of the maps' width and of their height; R, G"),
        "irradiance": Meaning("irradiance", "light", "light that enters the skin, before it spreads"),
        "scattered": Meaning(
            "irradiance",
            "light",
            "light that leaves, after it spread: pi times the radiance along the normal",
        ),
    }
)
"""Meanings by the names of the maps and of their files."""


class MapFolder(Target):
    """OpenEXR in linear numbers and PNG to look at, with a JSON of units and ranges."""

    name = "maps"
    title = "maps"
    suffixes = ("",)
    versions = ("1",)
    variants = ("opengl", "directx")
    wrong = (
        "Light is baked for one pose and the lights of one scene, as it leaves along the normal. The profile "
        "is the sum of Gaussians that the frame blurs by. Reflections off the surface depend on the eye: no "
        "map has them."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return what is written, and which of the two maps of light is to be shown."""
        return (
            Row("size", self.side, "texel", "side of the maps"),
            Row("normal_green", self._green, "-", "towards row 0, or away from it"),
            Row(_SPREAD, True, "-", "the light shown is that after it spread, scattered.exr"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return light that has not spread, times the albedo: an ordinary light map."""
        return with_values(self.parameters(subject, version), {_SPREAD: False})

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the sum of Gaussians by which the frame spreads light, or none."""
        energy = subject.curve.energy
        if not value_of(rows, _SPREAD) or subject.scene is None:
            return Curve.of(lambda r: np.repeat(np.where(r > 0.0, 1.0, 0.0)[:, None], 3, axis=1), energy)
        profile = SkinProfiles().of(subject.scene.skin)
        return gaussian_curve(profile.variance_mm2, profile.weight, energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write all maps of the scene."""
        if subject.scene is None:
            came = f"the skin {subject.name} came"
            refuse("maps", "a head, which they are painted for", came, "Name a head, with --profile")
        scene, side = subject.scene, check_side(self.side)
        settings = Settings(atlas=min(max(side, SIDES[0]), _ATLAS))
        baked = baked_maps(Renderer(self.adapter), scene, settings, side)
        return write_files(place, map_files(baked, scene, self._green))

    @property
    def _green(self) -> NormalY:
        return "down" if self.variant == "directx" else "up"


def exr(name: str, values: Floats) -> bytes:
    """Return a map as OpenEXR: channels R, G, B of colours and vectors, Y of one number."""
    letters = "Y" if values.ndim == 2 else "RGB"
    channels = [values] if values.ndim == 2 else list(np.moveaxis(values, -1, 0))
    return encode_exr_parts({name: dict(zip(letters, channels, strict=True))}, swift=True)


def levels(values: Floats, meaning: Meaning) -> tuple[NDArray[np.uint8 | np.uint16], Ranges]:
    """Return the levels of a map in a PNG, and how they become numbers."""
    if meaning.shown == "colour":
        return encode_srgb8(np.clip(values, 0.0, 1.0)), {"png": "sRGB"}
    if meaning.shown == "light":
        bright = float(np.percentile(values, _BRIGHT)) or 1.0
        return encode_srgb8(np.clip(values / bright, 0.0, 1.0)), {"png": "sRGB", "white": bright}
    if meaning.shown == "normal":
        return _sixteen(0.5 * values + 0.5), {"png": "value = 2 level / 65535 - 1"}
    if meaning.shown == "root":
        return _sixteen(np.sqrt(values)), {"png": "value = (level / 65535)^2"}
    if meaning.shown == "share":
        return _sixteen(values), {"png": "value = level / 65535"}
    low, high = float(values.min()), float(values.max())
    span = high - low or 1.0
    words = "value = black + level / 65535 (white - black)"
    return _sixteen((values - low) / span), {"png": words, "black": low, "white": low + span}


def with_green(normal: Floats, normal_y: NormalY) -> Floats:
    """Return normals whose green points to row 0 ("up", OpenGL) or away from it ("down", DirectX)."""
    if normal_y == "up":
        return normal
    return normal * np.array([1.0, -1.0, 1.0], np.float32)


def _sixteen(share: Floats) -> NDArray[np.uint16]:
    return np.rint(np.clip(share, 0.0, 1.0) * _MOST).astype(np.uint16)


def check_side(side: object) -> int:
    """Return the side of the maps.

    Raises DermisError for one that is none of `SIDES`.
    """
    if side not in SIDES or isinstance(side, bool):
        came = f"{side!r} came"
        refuse("size of the maps", f"a power of two from {SIDES[0]} to {SIDES[-1]}", came, "Take 2048")
    assert isinstance(side, int)
    return side


def baked_maps(renderer: Renderer, scene: Scene, settings: Settings, side: int) -> Baked:
    """Return the maps of the skin in the scene's light, with its relief as heights where it has such."""
    baked = bake(renderer, scene, settings, side)
    painted = renderer.kept_open.run(
        lambda: with_painted_maps(renderer.device, scene.head, min(max(side, LEAST_SIDE), MOST_SIDE))
    )
    height = painted.maps.height
    if height is None:
        baked.absent["height"] = "the head has no map of heights"
    else:
        baked.maps["height"] = resampled(height, side)
    return baked


def map_files(baked: Baked, scene: Scene, normal_y: NormalY) -> Iterator[tuple[str, bytes]]:
    """Return names and contents of the files, the JSON last."""
    described: dict[str, Ranges] = {}
    for name, meaning in MEANINGS.items():
        if name not in baked.maps:
            continue
        values = with_green(baked.maps[name], normal_y) if name == "normal" else baked.maps[name]
        _LOGGER.info("writing %s", name)
        yield f"{name}.exr", exr(name, values)
        inside = values[baked.covered]
        bounds = {"least": _plain(inside.min(axis=0)), "largest": _plain(inside.max(axis=0))}
        described[name] = {"unit": meaning.unit, "meaning": meaning.words, "exr": "linear", **bounds}
        if meaning.shown != "none":
            picture, scale = levels(values, meaning)
            yield f"{name}.png", encode_png(picture[..., None] if picture.ndim == 2 else picture, 6)
            described[name] |= scale
    yield "maps.json", (json.dumps(_description(baked, scene, normal_y, described), indent=1) + "\n").encode()


def _description(
    baked: Baked, scene: Scene, normal_y: NormalY, described: dict[str, Ranges]
) -> dict[str, object]:
    """Return what a reader of the maps must know."""
    lights = [light.model_dump(mode="json") for light in scene.lights]
    around = scene.environment
    return {
        "format": "dermis maps 1",
        "made_by": f"dermis {version()}",
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
    """Return a map (h, w) at another side: means of texels where that is smaller, else interpolated."""
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


def _plain(value: Floats) -> float | list[float]:
    found: float | list[float] = np.round(np.asarray(value, np.float64), 6).tolist()
    return found


TARGET = MapFolder()
