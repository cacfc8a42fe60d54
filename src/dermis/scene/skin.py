"""What the skin is made of, as far as its maps do not say."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from dermis.base.errors import format_value, refuse
from dermis.optics.pigments.parameters import Structure
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider
from dermis.scene.talk import Energy, SpecularColour
from dermis.specular.models import FresnelName, SpecularName

DirectionName = Literal["lambertian", "half-space"]
MAX_LAYERS = 8
MAX_OTHER_PROFILES = 2
"""Profiles that a map can mix into another."""
_OILY_RHO_S_FACTOR, _OILY_ROUGHNESS_FACTOR = 2.0, 0.6
DEFAULT_ROUGHNESS, DEFAULT_RHO_S = 0.3, 0.45
PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "deck-2007": {"specular": "kelemen", "rho_s": 0.18, "direction": "lambertian"},
}
"""Fields of skins by name: what dermis takes for skin, and what the talk of 2007 had."""


_Fraction = Annotated[float | None, Field(ge=0, le=1)]
_COEFFICIENT_REASON = BoundsReason("1/mm: white paint has some hundreds")
_Absorption = Annotated[float, Field(ge=0, le=1e4), _COEFFICIENT_REASON]
_Scattering = Annotated[float, Field(ge=1e-6, le=1e4), _COEFFICIENT_REASON]
_COEFFICIENT_SLIDER = Field(json_schema_extra=slider(1e-4, 50, log=True))


class Pigments(FrozenModel):
    """What replaces the pigments of a skin made of them; None leaves the skin's own."""

    structure: Structure | None = None
    """Layers of the skin: "dj2006" has two, "donner2008" a sheet of melanin too, "biospec" four."""
    melanin: Annotated[_Fraction, Field(json_schema_extra=slider(0.0005, 0.6, log=True))] = None
    """Share of the epidermis' volume that is melanosomes."""
    eumelanin: _Fraction = None
    """Share of the melanosomes that hold eumelanin."""
    blood: Annotated[_Fraction, Field(json_schema_extra=slider(0.0005, 0.2, log=True))] = None
    """Share of the dermis' volume that is blood."""
    oxygen: _Fraction = None
    """Share of the haemoglobin that carries oxygen."""
    epidermis_mm: Annotated[
        float | None,
        Field(ge=1e-3, le=2, json_schema_extra=slider(0.02, 0.5)),
        BoundsReason("mm: from less than a cell to a callous heel"),
    ] = None
    """Thickness of the epidermis [mm]."""
    epidermal_blood: Annotated[_Fraction, Field(json_schema_extra=slider(0, 0.1))] = None
    """Share of the epidermis' volume that is blood, for "donner2008" only."""

    def overrides(self) -> dict[str, float]:
        """Shares and thicknesses that replace something."""
        return self.model_dump(exclude={"structure"}, exclude_none=True)


class TissueLayer(FrozenModel):
    """One layer of a medium, its coefficients for red, green and blue."""

    name: str = "layer"
    """What the layer is called."""
    thickness_mm: Annotated[
        float | None,
        Field(ge=1e-4, le=1000, json_schema_extra=slider(0.01, 5, log=True)),
        BoundsReason("mm: from less than a cell's wall to more than a body"),
    ] = None
    """Thickness; none for the last layer, if it has no end [mm]."""
    absorption_per_mm: Annotated[tuple[_Absorption, _Absorption, _Absorption], _COEFFICIENT_SLIDER]
    """Absorption coefficient [1/mm]."""
    scattering_per_mm: Annotated[tuple[_Scattering, _Scattering, _Scattering], _COEFFICIENT_SLIDER]
    """Reduced scattering coefficient [1/mm]."""


class Skin(FrozenModel):
    """What the skin is: the rough white surface, and what scatters below it.

    Source: [dEonLuebke2007] sections 14.3-14.5; values of [Dudash2007].
    """

    profile: str = "gpu-gems-3"
    """Diffusion profile: "gpu-gems-3", a medium or skin (dj3, skin1, light ...), a .toml file such as
    `dermis profile -o` writes, or a CSV file with variance_mm2,red,green,blue."""
    profile_map: str | None = None
    """Picture of where the skin has other profiles, in the head's uv, plain numbers: grey, or red, for the
    first other's share of the skin; green for the second's."""
    other_profiles: Annotated[tuple[str, ...], Field(max_length=MAX_OTHER_PROFILES)] = ()
    """One or two profiles that `profile_map` mixes in; texture space alone does so."""
    albedo: Literal["map", "profile"] = "map"
    """Where skin gets its colour: "map" makes the profile white and takes the colour map; "profile" keeps the
    profile's own colour and uses no map."""
    mix: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Share of the colour map applied before scattering, the rest after it."""
    roughness: Annotated[
        float, Field(ge=0.05, le=1), BoundsReason("smoother skin would mirror, facets lean no farther")
    ] = DEFAULT_ROUGHNESS
    """Beckmann roughness m of the surface; where a head has a map of it, 0.3 leaves that as it is, and 0.6
    makes it twice as rough."""
    rho_s: Annotated[float, Field(ge=0, le=1)] = DEFAULT_RHO_S
    """Strength of the surface reflection: 1 is that of a smooth boundary of index 1.4 cut into facets."""
    oiliness: Annotated[float, Field(ge=0, le=1)] = 0.0
    """One dial over strength and roughness: 1 is shiny skin, twice as strong and 0.6 times as rough; an
    artist's mapping, not a measured one."""
    specular: SpecularName = "two-lobe"
    """Model of the surface reflection; "none" leaves it out."""
    fresnel: FresnelName = "schlick"
    """Schlick's curve with F0 = 0.028, or the exact one of index 1.4."""
    specular_colour: SpecularColour = "white"
    energy: Energy = "full"
    direction: DirectionName = "half-space"
    """How skin returns light: "lambertian" alike from and to all directions; "half-space" as a half-space
    of the skin's mean colour: more of what arrives at a slant, and light scattered once leaves at a slant."""
    anisotropy: Annotated[
        float, Field(ge=0, le=0.95), BoundsReason("of more, the law takes nearly all as going straight on")
    ] = 0.0
    """Mean cosine of scattering in half-space skin, whose reduced scattering stays as it is: at 0.8, as in
    real flesh, more comes back of light at a slant, and more passes thin parts."""
    pigments: Pigments | None = None
    """What replaces pigments of the profile's skin, of "spectral", "light", "medium", "dark" or a file."""
    layers: Annotated[tuple[TissueLayer, ...], Field(max_length=MAX_LAYERS)] = ()
    """What replaces the layers of the profile's medium ("dj3", "skin1", a file's), topmost first."""

    @classmethod
    def preset(cls, name: str) -> Skin:
        """The skin of a name in `PRESETS`.

        Raises DermisError for any other name.
        """
        if not isinstance(name, str) or name not in PRESETS:
            refuse("skin", f"one of {', '.join(PRESETS)}", f"got {format_value(name)}", "Choose one of them")
        return cls(**PRESETS[name])

    @property
    def overrides_tissue(self) -> bool:
        """Whether pigments or layers replace what the profile's name stands for."""
        return self.pigments is not None or bool(self.layers)

    @property
    def strength(self) -> float:
        """Strength rho_s of the lobe with the skin's oil, at most 1 [-]."""
        oily = min(1.0, self.rho_s * (1.0 + (_OILY_RHO_S_FACTOR - 1.0) * self.oiliness))
        return 0.0 if self.specular == "none" else oily

    @property
    def smoothing(self) -> float:
        """Factor of the roughness that the skin's oil makes [-]."""
        return 1.0 - (1.0 - _OILY_ROUGHNESS_FACTOR) * self.oiliness


def lobe_name(skin: Skin) -> str:
    """Return the name of the skin's lobe; skin without one keeps the default, for wet materials beside it."""
    from dermis.specular.models import MODELS

    return next(iter(MODELS)) if skin.specular == "none" else skin.specular
