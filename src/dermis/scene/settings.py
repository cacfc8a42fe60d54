"""How a picture is computed and encoded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from dermis.registry import Named
from dermis.scene.plain import Colour, Plain, slider
from dermis.scene.techniques import TECHNIQUES

_Side = Annotated[int, Field(ge=1, le=16384)]
_MOST_SAMPLES = 64
MOST_WORK = 2**27


def _square(value: Any) -> Any:
    """A number as both sides."""
    return (value, value) if isinstance(value, int) else value


class Settings(Plain):
    """Sizes, quality, and what leaves linear light."""

    meant: ClassVar[Mapping[str, str]] = {"resolution": "size", "spp": "samples"}

    size: Annotated[tuple[_Side, _Side], BeforeValidator(_square)] = (1024, 1024)
    """Width and height of the picture [pixel]."""
    atlas: Annotated[int, Field(ge=64)] = 2048
    """Side of the atlas, the map in which light scatters [texel]."""
    samples: Annotated[int, Field(ge=1, le=_MOST_SAMPLES)] = 4
    """Samples of each pixel, for smooth edges."""
    technique: Annotated[str, Named(TECHNIQUES)] = "texture-space"
    """How light scatters below the surface."""
    stretch: Literal["full", "axes", "none"] = "full"
    """Correction of blurs for the uv layout: "full" for its stretch and shear, "axes" as if u and v were at
    right angles, "none" to blur alike everywhere."""
    seams: Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"] = "stitch"
    """What is done at the seams of the uv layout: "stitch" lets light cross them; the others are the talk's
    remedies, for comparison. Techniques that cannot stitch take "clear-colour" instead."""
    seam_colour: Colour = (0.5, 0.35, 0.3)
    """Light between the charts for "clear-colour" seams, as irradiance over pi."""
    transmission: Literal["thin", "none"] = "thin"
    """Light through the head: "thin" for thin parts such as ears and nostrils, "none" for no part."""
    shadow_size: Annotated[int, Field(ge=64, le=8192)] = 2048
    """Side of each shadow map [texel]."""
    occlusion: Literal["baked", "rest", "none"] = "baked"
    """Ambient occlusion, which dims the environment's light where the head is in its way: "baked" follows a
    head that moves, "rest" leaves it as the head rests, "none" for none."""
    exposure: Annotated[float, Field(ge=1e-6, le=1e6, json_schema_extra=slider(0.05, 20, log=True))] = 1.0
    """Factor from radiance to the picture."""
    bloom: Annotated[float, Field(ge=0, le=1, json_schema_extra=slider(0, 0.5))] = 0.0
    """Share of the light that the lens scatters around."""
    tone: Literal["none", "filmic", "neutral"] = "none"
    """Tone curve before the encoding as bytes; "neutral" is the Khronos group's."""
    gamma: Literal["right", "wrong"] = "right"
    """Colour space: "wrong" takes the colour map to be linear and leaves the encoding out, for comparison."""
    background: Colour = (0.0, 0.0, 0.0)
    """Colour behind the head, linear Rec. 709."""
    strands: bool = True
    """Hairs of heads that have them, as the human's brows and lashes."""
    parts: Literal["all", "diffuse", "specular"] = "all"
    """Which light is shown: "all", only the "diffuse" from below the surface, or the "specular" off it."""

    @model_validator(mode="after")
    def _fits_in_memory(self) -> Settings:
        if self.size[0] * self.size[1] * self.samples > MOST_WORK:
            raise ValueError(f"width times height times samples of at most {MOST_WORK // 10**6} million")
        return self
