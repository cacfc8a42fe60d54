"""Settings of rendering and encoding: sizes, quality, technique, exposure, background."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from dermis.base.registry import RegisteredName
from dermis.scene.field_errors import AcceptedWords, BoundsReason
from dermis.scene.frozen_model import Colour, FrozenModel, slider
from dermis.scene.talk_comparisons import GammaHandling, SeamColour, SeamTreatment, StretchCorrection
from dermis.scene.techniques import TECHNIQUES

_PictureSide = Annotated[int, Field(ge=1, le=16384), BoundsReason("pixels: what the largest GPUs hold")]
_MAX_SAMPLES_PER_PIXEL = 64
MAX_SAMPLE_COUNT = 2**27
METERED_EXPOSURES = "auto", "skin"
"""Values of `exposure` for which the exposure is metered in the picture."""
_HEX_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")


def _parse_colour(typed_colour: Any) -> Any:
    """Convert "#rrggbb" or "red,green,blue" to linear Rec. 709; return other values unchanged."""
    if not isinstance(typed_colour, str):
        return typed_colour
    if not _HEX_COLOUR.fullmatch(typed_colour):
        try:
            red, green, blue = map(float, typed_colour.split(","))
        except ValueError:
            raise ValueError("a colour: three linear numbers, or #rrggbb") from None
        return red, green, blue
    import numpy as np

    from dermis.images.colour import decode_srgb_levels

    levels = np.frombuffer(bytes.fromhex(typed_colour[1:]), np.uint8)
    return tuple(float(one) for one in decode_srgb_levels(levels))


if TYPE_CHECKING:
    Exposure = float | Literal["auto", "skin"]
    Background = Colour | Literal["none", "gradient", "environment"]
else:
    Exposure = Annotated[
        float,
        Field(ge=1e-6, le=1e6, json_schema_extra=slider(0.05, 20, logarithmic=True)),
        BoundsReason("20 stops either way"),
        AcceptedWords(*METERED_EXPOSURES),
    ]
    _BACKGROUNDS = AcceptedWords("none", "gradient", "environment")
    Background = Annotated[Colour, BeforeValidator(_parse_colour), _BACKGROUNDS]


def _square_size(typed_size: Any) -> Any:
    """Convert an integer to the width and height of a square; return other values unchanged."""
    return (typed_size, typed_size) if isinstance(typed_size, int) else typed_size


class Settings(FrozenModel):
    """Settings of a picture: size, antialiasing, technique, exposure and background.

    Examples
    --------
    >>> import dermis
    >>> dermis.Settings(size=256).size
    (256, 256)
    """

    synonyms: ClassVar[Mapping[str, str]] = {"resolution": "size", "spp": "samples"}

    size: Annotated[tuple[_PictureSide, _PictureSide], BeforeValidator(_square_size)] = (1024, 1024)
    """Width and height of the picture [pixel]."""
    atlas: Annotated[int, Field(ge=64, le=16384), BoundsReason("texels: what the largest GPUs hold")] = 2048
    """Side of the atlas, the map in which light is diffused [texel]."""
    samples: Annotated[
        int, Field(ge=1, le=_MAX_SAMPLES_PER_PIXEL), BoundsReason("more make no visible difference")
    ] = 4
    """Samples per pixel for antialiasing."""
    technique: Annotated[str, RegisteredName(TECHNIQUES)] = "texture-space"
    """Technique for subsurface scattering."""
    stretch: StretchCorrection = "full"
    seams: SeamTreatment = "stitch"
    seam_colour: SeamColour = (0.5, 0.35, 0.3)
    transmission: Literal["thin", "none"] = "thin"
    """Translucency: "thin" for thin parts such as ears and nostrils, "none" to leave it out."""
    shadow_size: Annotated[
        int, Field(ge=64, le=8192), BoundsReason("texels: finer than the pores of skin")
    ] = 2048
    """Side of each shadow map [texel]."""
    occlusion: Literal["baked", "rest", "none"] = "baked"
    """Occlusion of the environment by the head itself: "baked" is updated when the head moves, "rest" is
    computed for the rest pose only, "none" leaves it out."""
    interreflection: bool = True
    """Light reflected from skin to skin: in ears, around the eyes, under chin and nose."""
    exposure: Exposure = 1.0
    """Factor from radiance to picture values; "auto" meters the irradiance on the visible skin, "skin" also
    its reflectance, and exposes dark skin longer, as is usual in portraits."""
    bloom: Annotated[float, Field(ge=0, le=1, json_schema_extra=slider(0, 0.5))] = 0.0
    """Fraction of the light that the lens scatters."""
    tone: Literal["none", "filmic", "neutral"] = "none"
    """Tone curve before the sRGB encoding; "neutral" is the Khronos Group's curve."""
    gamma: GammaHandling = "right"
    background: Background = "none"
    """Backdrop behind the head, which emits no light: "none" for pictures with alpha, a grey studio
    "gradient", the "environment", or a colour as linear Rec. 709 or #rrggbb."""
    background_blur: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Blur of an environment in the background: the roughness of a mirror that blurs it as much. 0 is sharp;
    values between 0 and 0.018 count as 0.018."""
    strands: bool = True
    """Whether to draw hair strands: hair, beard, brows and lashes of heads that have them."""
    parts: Literal["all", "diffuse", "specular"] = "all"
    """Components of the light to show: "all", only the "diffuse" subsurface light, or only the "specular"
    reflection."""
    polarisation: Literal["parallel", "cross"] | None = None
    """Polarisers before the lights and the camera. Light that the surface reflects keeps its polarisation,
    and light that was scattered below it has lost it: "parallel" shows all of the reflection and half of the
    scattered light, "cross" only half of the scattered light. Without polarisers if left out."""

    @model_validator(mode="after")
    def _check_fits_in_memory(self) -> Settings:
        if self.size[0] * self.size[1] * self.samples > MAX_SAMPLE_COUNT:
            limit = MAX_SAMPLE_COUNT // 10**6
            raise ValueError(f"width times height times samples of at most {limit} million")
        return self


PHOTOGRAPHIC_SETTINGS: Mapping[str, Any] = MappingProxyType({"exposure": "skin", "background": "gradient"})
"""Defaults of `dermis render`, `animate` and `view` where they differ from the defaults of `Settings`."""
