"""Export of a head's maps as pictures in the uv layout, with irradiance before and after diffusion."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import cumulative_gaussian_profile
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, get_value, replace_values, write_files
from dermis.base.errors import refuse
from dermis.base.version import version
from dermis.frame.baking import BakedMaps, bake
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.frame.renderer import Renderer
from dermis.human.skin.painted import MAX_SIDE, MIN_SIDE
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.images.io import encode_exr_parts
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]
RangeEntries = dict[str, str | float | list[float]]
NormalY = Literal["up", "down"]
MAP_SIDES = tuple(1 << k for k in range(8, 14))
"""Supported sides of the maps [texel]."""
_MAX_PNG_LEVEL, _WHITE_PERCENTILE = 65535, 99.9
_LOGGER = logging.getLogger("dermis")
PngEncoding = Literal["colour", "light", "normal", "fraction", "range", "root", "none"]
"""Encoding of a map as PNG. "colour": 8-bit sRGB; "light": 8-bit sRGB of light divided by its 99.9th
percentile; "normal": a normal n as (n + 1) / 2 in 16 bits; "fraction": a value from 0 to 1 in 16 bits;
"range": the interval from minimum to maximum in 16 bits; "root": the square root in 16 bits; "none": no PNG
is written."""
_SCATTERING_PARAMETER_NAME = "scattered"
_MAX_DIFFUSION_ATLAS_SIDE = 2048  # of the map in which light is diffused [texel]


@dataclass(frozen=True)
class MapInfo:
    """Properties of an exported map.

    unit : unit of the texels in the OpenEXR file; "" for texels without a unit
    png_encoding : encoding of the texels in the PNG file
    description : meaning of the texels, for the JSON file
    """

    unit: str
    png_encoding: PngEncoding
    description: str


MAP_INFOS: Mapping[str, MapInfo] = MappingProxyType(
    {
        "albedo": MapInfo("", "colour", "diffuse reflectance, linear Rec. 709"),
        "normal": MapInfo("", "normal", "normal with relief in tangent space: x along +u, z outwards"),
        "height": MapInfo("mm", "range", "height of the same relief, with an arbitrary origin"),
        "roughness": MapInfo("", "root", "Beckmann m, including the relief finer than a texel"),
        "rho_s": MapInfo("", "fraction", "factor of the specular reflection"),
        "reflected": MapInfo("", "fraction", "mean albedo of the specular reflection over all directions"),
        "melanin": MapInfo("", "fraction", "volume fraction of melanosomes in the epidermis"),
        "blood": MapInfo("", "fraction", "volume fraction of blood in the dermis"),
        "thickness": MapInfo("mm", "range", "thickness of the tissue, up to the depth that light reaches"),
        "curvature": MapInfo("1/mm", "range", "root mean square of the principal curvatures, smoothed"),
        "stretch": MapInfo("mm", "none", "length on the skin of the maps' width (R) and height (G)"),
        "irradiance": MapInfo("irradiance", "light", "irradiance that enters the skin, before diffusion"),
        "scattered": MapInfo("irradiance", "light", "pi times radiance along the normal, after diffusion"),
    }
)
"""Properties of the maps by name, which is also the name of their files."""


class MapFolder(Target):
    """Folder of maps: OpenEXR with linear values, PNG for viewing, and a JSON file with units and ranges."""

    name = "maps"
    title = "maps"
    suffixes = ("",)
    versions = ("1",)
    variants = ("opengl", "directx")
    import_steps = (
        "Read maps.json for the unit and the range of each map.",
        "Load the OpenEXR files as linear data; the PNG files are for viewing.",
        "Apply the maps in the uv layout of the head, which exports to `gltf` and `usd` contain.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "maps.json": "units, ranges, quantisation of the PNG files, and missing maps with the reason",
        "*.exr": "map with linear values",
        "*.png": "map for viewing",
    }
    limitations = (
        "Light is baked for one pose and one scene, in the direction of the normal. The profile is the sum "
        "of Gaussians of the renderer. Specular reflection is not included, as it depends on the viewer."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the maps' size, the direction of y in normal maps, and whether light is diffused."""
        return (
            Parameter("size", self.side, "texel", "side of the maps"),
            Parameter(
                "normal_green", self._normal_y, "-", "direction of green: towards row 0, or away from it"
            ),
            Parameter(
                _SCATTERING_PARAMETER_NAME,
                True,
                "-",
                "the light to display is the diffused one, scattered.exr",
            ),
        )

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters for an ordinary light map, without diffusion."""
        return replace_values(self.parameters(subject, version), {_SCATTERING_PARAMETER_NAME: False})

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of the sum of Gaussians that the renderer uses to diffuse light.

        Without diffusion, all light leaves where it enters, so the cumulative profile is 1 at all radii
        above 0.
        """
        energy = subject.curve.energy
        if not get_value(parameters, _SCATTERING_PARAMETER_NAME) or subject.scene is None:
            return CumulativeProfile.from_function(lambda r: np.tile(r[:, None] > 0.0, 3), energy)
        profile = SkinProfiles().profile(subject.scene.skin)
        return cumulative_gaussian_profile(profile.variance_mm2, profile.weight, energy)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Bake all maps of the scene and write them into the output folder."""
        if subject.scene is None:
            actual = f"got the skin {subject.name}"
            refuse("maps", "a head", actual, "Name a head, and the skin with --profile")
        scene, side = subject.scene, check_map_side(self.side)
        settings = Settings(atlas=min(max(side, MAP_SIDES[0]), _MAX_DIFFUSION_ATLAS_SIDE))
        baked = bake_maps(Renderer(self.adapter), scene, settings, side)
        return write_files(output, map_files(baked, scene, self._normal_y))

    @property
    def _normal_y(self) -> NormalY:
        return "down" if self.variant == "directx" else "up"


def encode_map_exr(map_name: str, texels: Floats) -> bytes:
    """Return a map as OpenEXR, with channels R, G, B for colours and vectors, and Y for scalars."""
    names = "Y" if texels.ndim == 2 else "RGB"
    channels = [texels] if texels.ndim == 2 else list(np.moveaxis(texels, -1, 0))
    return encode_exr_parts({map_name: dict(zip(names, channels, strict=True))}, use_run_length_encoding=True)


def quantise_map(
    texels: Floats, png_encoding: PngEncoding
) -> tuple[NDArray[np.uint8 | np.uint16], RangeEntries]:
    """Return a map quantised to integers for PNG, and JSON entries that say how to decode the integers.

    png_encoding : encoding of the integers: sRGB for "colour" and "light", the square root for "root", and
        linear for all others
    """
    if png_encoding == "colour":
        return encode_srgb8(np.clip(texels, 0.0, 1.0)), {"png": "sRGB"}
    if png_encoding == "light":
        white = float(np.percentile(texels, _WHITE_PERCENTILE)) or 1.0
        return encode_srgb8(np.clip(texels / white, 0.0, 1.0)), {"png": "sRGB", "white": white}
    if png_encoding == "normal":
        return _to_uint16(0.5 * texels + 0.5), {"png": "value = 2 level / 65535 - 1"}
    if png_encoding == "root":
        return _to_uint16(np.sqrt(texels)), {"png": "value = (level / 65535)^2"}
    if png_encoding == "fraction":
        return _to_uint16(texels), {"png": "value = level / 65535"}
    low, high = float(texels.min()), float(texels.max())
    span = high - low or 1.0
    formula = "value = black + level / 65535 (white - black)"
    return _to_uint16((texels - low) / span), {"png": formula, "black": low, "white": low + span}


def orient_normal_map(normals: Floats, normal_y: NormalY) -> Floats:
    """Return normals whose y, the green channel, points towards row 0 of the map or away from row 0.

    normals : (h, w, 3) normals whose y points towards row 0
    normal_y : "up" if y is to point towards row 0, as in OpenGL; "down" if away from row 0, as in DirectX
    """
    if normal_y == "up":
        return normals
    return normals * np.array([1.0, -1.0, 1.0], np.float32)


def _to_uint16(fraction: Floats) -> NDArray[np.uint16]:
    return np.rint(np.clip(fraction, 0.0, 1.0) * _MAX_PNG_LEVEL).astype(np.uint16)


def check_map_side(map_side: object) -> int:
    """Return the requested side of the maps [texel] after checking that the side is supported.

    Raises DermisError for a side that is not one of `MAP_SIDES`.
    """
    if map_side not in MAP_SIDES or isinstance(map_side, bool):
        actual = f"got {map_side!r}"
        refuse(
            "size of the maps",
            f"a power of two from {MAP_SIDES[0]} to {MAP_SIDES[-1]}",
            actual,
            "Choose 2048",
        )
    assert isinstance(map_side, int)
    return map_side


def bake_maps(renderer: Renderer, scene: Scene, settings: Settings, map_side: int) -> BakedMaps:
    """Return the maps of a skin, baked from the skin's material and from the light of the scene.

    The maps contain material properties such as albedo, normal and roughness, and the irradiance of the skin.
    If the head has a height map, there is also a map of the height.

    map_side : side of the maps [texel]
    """
    baked = bake(renderer, scene, settings, map_side)
    painted = renderer.reopening_device.run(
        lambda: with_painted_maps(renderer.device, scene.head, min(max(map_side, MIN_SIDE), MAX_SIDE))
    )
    height = painted.maps.height
    if height is None:
        baked.absent["height"] = "the head has no height map"
    else:
        baked.maps["height"] = resample_map(height, map_side)
    return baked


def map_files(baked_maps: BakedMaps, scene: Scene, normal_y: NormalY) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file: OpenEXR and PNG of each map, then the JSON that describes them.

    normal_y : direction of y in the written normal map, see `orient_normal_map`
    """
    described: dict[str, RangeEntries] = {}
    for name, info in MAP_INFOS.items():
        if name not in baked_maps.maps:
            continue
        values = (
            orient_normal_map(baked_maps.maps[name], normal_y) if name == "normal" else baked_maps.maps[name]
        )
        _LOGGER.info("writing %s", name)
        yield f"{name}.exr", encode_map_exr(name, values)
        inside = values[baked_maps.covered]
        bounds = {
            "least": _round_to_lists(inside.min(axis=0)),
            "largest": _round_to_lists(inside.max(axis=0)),
        }
        described[name] = {"unit": info.unit, "meaning": info.description, "exr": "linear", **bounds}
        if info.png_encoding != "none":
            picture, scale = quantise_map(values, info.png_encoding)
            yield f"{name}.png", encode_png(picture[..., None] if picture.ndim == 2 else picture, 6)
            described[name] |= scale
    yield (
        "maps.json",
        (json.dumps(_maps_description(baked_maps, scene, normal_y, described), indent=1) + "\n").encode(),
    )


def _maps_description(
    baked_maps: BakedMaps, scene: Scene, normal_y: NormalY, map_entries: dict[str, RangeEntries]
) -> dict[str, object]:
    """Return the description of all maps for maps.json: layout, lights, units and ranges.

    normal_y : direction of y in the written normal map, see `orient_normal_map`
    map_entries : dictionary from the name of each map to its unit, meaning, range and PNG encoding
    """
    return {
        "format": "dermis maps 1",
        "made_by": f"dermis {version()}",
        "size": len(baked_maps.covered),
        "layout": "uv of the head, sampled at texel centres; row 0 is the top, v = 1 if v points upwards",
        "covered": float(baked_maps.covered.mean()),
        "beyond_the_skin": "the nearest texel of the skin, so that filters never read black",
        "normal_green": "up (OpenGL)" if normal_y == "up" else "down (DirectX)",
        "relief": "normal and height contain the same relief: use one of them",
        "colours": "linear Rec. 709 in OpenEXR",
        "irradiance_unit": "as for the lights; white skin has radiance 1 at an irradiance of pi",
        "lights": [light.model_dump(mode="json") for light in scene.lights],
        "environment": scene.environment and scene.environment.model_dump(mode="json"),
        "profile": scene.skin.profile,
        "maps": map_entries,
        "absent": baked_maps.absent,
    }


def resample_map(texels: Floats, new_side: int) -> Floats:
    """Return a map (h, w) resampled to a square map.

    The map is halved by averaging while both sides are even and at least twice the new side, and then
    interpolated linearly.

    new_side : side of the returned map [texel]
    """
    height, width = texels.shape
    while min(height, width) >= 2 * new_side and not (height | width) & 1:
        texels = 0.25 * (texels[0::2, 0::2] + texels[1::2, 0::2] + texels[0::2, 1::2] + texels[1::2, 1::2])
        height, width = texels.shape
    if (height, width) == (new_side, new_side):
        return np.ascontiguousarray(texels, np.float32)
    for axis, length in enumerate((height, width)):
        position = np.clip((np.arange(new_side) + 0.5) / new_side * length - 0.5, 0.0, length - 1.0)
        low = np.minimum(position.astype(np.int64), max(length - 2, 0))
        fraction = np.expand_dims((position - low).astype(np.float32), 1 - axis)
        high = np.minimum(low + 1, length - 1)
        texels = (1.0 - fraction) * texels.take(low, axis) + fraction * texels.take(high, axis)
    return np.ascontiguousarray(texels, np.float32)


def _round_to_lists(numbers: Floats) -> float | list[float]:
    rounded: float | list[float] = np.round(np.asarray(numbers, np.float64), 6).tolist()
    return rounded


TARGET = MapFolder()
