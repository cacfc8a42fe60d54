"""What the skin is made of, as far as its maps do not say."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.plain import Plain
from dermis.specular.names import EnergyName, FresnelName, SpecularName

_OILY_STRENGTH, _OILY_SMOOTHING = 3.0, 0.6


_Share = Annotated[float | None, Field(ge=0, le=1)]


class Pigments(Plain):
    """What replaces the pigments of a skin made of them; None leaves the skin's own.

    melanin : share of the epidermis' volume that is melanosomes [-]
    eumelanin : share of the melanosomes that hold eumelanin [-]
    blood : share of the dermis' volume that is blood [-]
    oxygen : share of the haemoglobin that carries oxygen [-]
    epidermis_mm : thickness of the epidermis [mm]
    """

    melanin: _Share = None
    eumelanin: _Share = None
    blood: _Share = None
    oxygen: _Share = None
    epidermis_mm: Annotated[float | None, Field(gt=0, le=2)] = None

    def given(self) -> dict[str, float]:
        """Those that replace something."""
        return self.model_dump(exclude_none=True)


class Skin(Plain):
    """Parameters of the two layers: the rough white surface, and what scatters below.

    profile : preset name or file of the diffusion profile
    albedo : "map" renormalises the profile to white and takes the colour from the map; "profile" keeps
        the profile's own colour and uses no map
    mix : share of the colour map applied before scattering, the rest after it [0..1]
    roughness : Beckmann roughness m [-]
    rho_s : strength of the surface lobe [-]
    oiliness : one dial over both, 0 as given to 1 for shiny skin, with 3 times the strength and 0.6 times the
        roughness; an artist's mapping, not a measured one
    specular : model of the lobe; "none" leaves it out
    fresnel : Schlick's curve with F0 = 0.028, or the exact one of index 1.4
    specular_colour : "white"; "wrong" tints reflections by the colour map, for comparison
    energy : what the surface reflects does not enter: "full"; "published" as the deck has it, with an albedo
        pi times too large; "none"
    pigments : what differs from those of the profile's skin: "spectral", "light", "medium", "dark", a file's

    Source: [dEonLuebke2007] sections 14.3-14.5; values of [Dudash2007].
    """

    profile: str = "gpu-gems-3"
    albedo: Literal["map", "profile"] = "map"
    mix: Annotated[float, Field(ge=0, le=1)] = 0.5
    roughness: Annotated[float, Field(ge=0.05, le=1)] = 0.3
    rho_s: Annotated[float, Field(ge=0, le=1)] = 0.18
    oiliness: Annotated[float, Field(ge=0, le=1)] = 0.0
    specular: SpecularName = "kelemen"
    fresnel: FresnelName = "schlick"
    specular_colour: Literal["white", "wrong"] = "white"
    energy: EnergyName = "full"
    pigments: Pigments | None = None

    @property
    def strength(self) -> float:
        """Strength rho_s of the lobe with the skin's oil, at most 1 [-]."""
        oily = min(1.0, self.rho_s * (1.0 + (_OILY_STRENGTH - 1.0) * self.oiliness))
        return 0.0 if self.specular == "none" else oily

    @property
    def smoothing(self) -> float:
        """Factor of the roughness that the skin's oil makes [-]."""
        return 1.0 - (1.0 - _OILY_SMOOTHING) * self.oiliness
