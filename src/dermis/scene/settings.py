"""How a picture is computed and encoded."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dermis.scene.plain import Colour, Plain

_Side = Annotated[int, Field(ge=1, le=16384)]
_MOST_SAMPLES = 64
MOST_WORK = 2**27


class Settings(Plain):
    """Sizes, quality, and what leaves linear light.

    size : width and height of the image [pixel]
    atlas : side of the irradiance map [texel]
    samples : samples of each pixel
    technique : "texture-space" scatters light over the atlas; "none" is the dry, unscattered skin; baselines
        are "one-blur" (a single blur of the light map), "published" (the passes of 2007 as they were) and
        what engines do: "screen-space" scatters over the picture, "pre-integrated" by tables over curvature
    stretch : "full" corrects blurs for the map's stretch and shear, "axes" takes u and v for at right angles,
        "none" blurs alike everywhere, for comparison
    seams : "stitch" lets light cross the map's seams; "none" and the talk's remedies "clear-colour",
        "stretch-map", "alpha" and "multi-uv" are for comparison
    seam_colour : light beside the charts for "clear-colour", as irradiance over pi
    transmission : "thin" lets light through thin parts: ears, nostrils; "none" takes all for thick
    shadow_size : side of each shadow map [texel]
    occlusion : "baked" dims an environment's light where the head is in its way
    exposure : factor from radiance to the image [-]
    bloom : share of the light that the lens scatters around [0..1]
    tone : curve before the encoding of bytes: "none", "filmic", or the Khronos group's "neutral"
    gamma : "wrong" takes the colour map for linear and leaves the encoding out, for comparison
    background : linear Rec. 709
    parts : which light is shown: "all", only the "diffuse" from below, or the "specular" off the surface
    """

    size: tuple[_Side, _Side] = (1024, 1024)
    atlas: Annotated[int, Field(ge=64)] = 2048
    samples: Annotated[int, Field(ge=1, le=_MOST_SAMPLES)] = 4
    technique: Literal["texture-space", "none", "one-blur", "published", "screen-space", "pre-integrated"] = (
        "texture-space"
    )
    stretch: Literal["full", "axes", "none"] = "full"
    seams: Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"] = "stitch"
    seam_colour: Colour = (0.5, 0.35, 0.3)
    transmission: Literal["thin", "none"] = "thin"
    shadow_size: Annotated[int, Field(ge=64, le=8192)] = 2048
    occlusion: Literal["baked", "none"] = "baked"
    exposure: Annotated[float, Field(ge=1e-6, le=1e6)] = 1.0
    bloom: Annotated[float, Field(ge=0, le=1)] = 0.0
    tone: Literal["none", "filmic", "neutral"] = "none"
    gamma: Literal["right", "wrong"] = "right"
    background: Colour = (0.0, 0.0, 0.0)
    parts: Literal["all", "diffuse", "specular"] = "all"

    @model_validator(mode="after")
    def _fits_in_memory(self) -> Settings:
        if self.size[0] * self.size[1] * self.samples > MOST_WORK:
            raise ValueError(f"width times height times samples of at most {MOST_WORK // 10**6} million")
        return self
