"""How a picture is computed and encoded."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from dermis.base.registry import RegisteredName
from dermis.scene.field_errors import BoundsReason, Keywords
from dermis.scene.frozen_model import Colour, FrozenModel, slider
from dermis.scene.talk import Gamma, SeamColour, Seams, Stretch
from dermis.scene.techniques import TECHNIQUES

_Side = Annotated[int, Field(ge=1, le=16384), BoundsReason("pixels: what the largest GPUs hold")]
_MAX_SAMPLES = 64
MAX_SAMPLE_COUNT = 2**27
_HEX = re.compile(r"#[0-9a-fA-F]{6}")


def _parse_colour(value: Any) -> Any:
    """#rrggbb and "red,green,blue" as linear Rec. 709."""
    if not isinstance(value, str):
        return value
    if not _HEX.fullmatch(value):
        try:
            red, green, blue = map(float, value.split(","))
        except ValueError:
            raise ValueError("a colour: three linear numbers, or #rrggbb") from None
        return red, green, blue
    import numpy as np

    from dermis.images.colour import decode_srgb_levels

    levels = np.frombuffer(bytes.fromhex(value[1:]), np.uint8)
    return tuple(float(one) for one in decode_srgb_levels(levels))


if TYPE_CHECKING:
    Exposure = float | Literal["auto"]
    Background = Colour | Literal["none", "gradient", "environment"]
else:
    Exposure = Annotated[
        float,
        Field(ge=1e-6, le=1e6, json_schema_extra=slider(0.05, 20, log=True)),
        BoundsReason("20 stops either way"),
        Keywords("auto"),
    ]
    Background = Annotated[
        Colour, BeforeValidator(_parse_colour), Keywords("none", "gradient", "environment")
    ]


def _both_sides(value: Any) -> Any:
    """A number as both sides."""
    return (value, value) if isinstance(value, int) else value


class Settings(FrozenModel):
    """Sizes, quality, and what leaves linear light."""

    synonyms: ClassVar[Mapping[str, str]] = {"resolution": "size", "spp": "samples"}

    size: Annotated[tuple[_Side, _Side], BeforeValidator(_both_sides)] = (1024, 1024)
    """Width and height of the picture [pixel]."""
    atlas: Annotated[int, Field(ge=64, le=16384), BoundsReason("texels: what the largest GPUs hold")] = 2048
    """Side of the atlas, the map in which light scatters [texel]."""
    samples: Annotated[int, Field(ge=1, le=_MAX_SAMPLES), BoundsReason("more show no difference")] = 4
    """Samples of each pixel, for smooth edges."""
    technique: Annotated[str, RegisteredName(TECHNIQUES)] = "texture-space"
    """How light scatters below the surface."""
    stretch: Stretch = "full"
    seams: Seams = "stitch"
    seam_colour: SeamColour = (0.5, 0.35, 0.3)
    transmission: Literal["thin", "none"] = "thin"
    """Light through the head: "thin" for thin parts such as ears and nostrils, "none" for no part."""
    shadow_size: Annotated[int, Field(ge=64, le=8192), BoundsReason("texels: finer than skin's pores")] = 2048
    """Side of each shadow map [texel]."""
    occlusion: Literal["baked", "rest", "none"] = "baked"
    """Ambient occlusion, which dims the environment's light where the head is in its way: "baked" follows a
    head that moves, "rest" leaves it as the head rests, "none" for none."""
    interreflection: bool = True
    """Light from skin to skin through the air: in ears, around eyes, under chin and nose."""
    exposure: Exposure = 1.0
    """Factor from radiance to the picture; "auto" meters the light that falls on the skin in view."""
    bloom: Annotated[float, Field(ge=0, le=1, json_schema_extra=slider(0, 0.5))] = 0.0
    """Share of the light that the lens scatters around."""
    tone: Literal["none", "filmic", "neutral"] = "none"
    """Tone curve before the encoding as bytes; "neutral" is the Khronos group's."""
    gamma: Gamma = "right"
    background: Background = "none"
    """What is behind the head, which sheds no light: "none", so that pictures have alpha, a studio's grey
    "gradient", the "environment", or a colour, linear Rec. 709 or #rrggbb."""
    background_blur: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Roughness of the mirror in which the environment behind the head is seen, at least 0.018; 0 for none,
    so that it is sharp."""
    strands: bool = True
    """Hairs of heads that have them, as the human's hair, beard, brows and lashes."""
    parts: Literal["all", "diffuse", "specular"] = "all"
    """Which light is shown: "all", only the "diffuse" from below the surface, or the "specular" off it."""

    @model_validator(mode="after")
    def _fits_in_memory(self) -> Settings:
        if self.size[0] * self.size[1] * self.samples > MAX_SAMPLE_COUNT:
            raise ValueError(
                f"width times height times samples of at most {MAX_SAMPLE_COUNT // 10**6} million"
            )
        return self


PHOTOGRAPHIC_SETTINGS: Mapping[str, Any] = MappingProxyType({"exposure": "auto", "background": "gradient"})
"""Settings that `dermis render`, `animate` and `view` choose where nothing is said."""
