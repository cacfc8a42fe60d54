"""What the skin is made of, as far as its maps do not say."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.plain import Plain
from dermis.specular.models import EnergyName, FresnelName, SpecularName

StructureName = Literal["dj2006", "donner2008", "biospec"]
MOST_LAYERS = 8
_OILY_STRENGTH, _OILY_SMOOTHING = 3.0, 0.6


_Share = Annotated[float | None, Field(ge=0, le=1)]
_Absorption = Annotated[float, Field(ge=0, le=1e4)]
_Scattering = Annotated[float, Field(gt=0, le=1e4)]


class Pigments(Plain):
    """What replaces the pigments of a skin made of them; None leaves the skin's own.

    structure : its layers: "dj2006" two, "donner2008" two and a sheet of melanin, "biospec" four
    melanin : share of the epidermis' volume that is melanosomes [-]
    eumelanin : share of the melanosomes that hold eumelanin [-]
    blood : share of the dermis' volume that is blood [-]
    oxygen : share of the haemoglobin that carries oxygen [-]
    epidermis_mm : thickness of the epidermis [mm]
    epidermal_blood : share of the epidermis' volume that is blood, of "donner2008" only [-]
    """

    structure: StructureName | None = None
    melanin: _Share = None
    eumelanin: _Share = None
    blood: _Share = None
    oxygen: _Share = None
    epidermis_mm: Annotated[float | None, Field(gt=0, le=2)] = None
    epidermal_blood: _Share = None

    def given(self) -> dict[str, float]:
        """Shares and thicknesses that replace something."""
        return self.model_dump(exclude={"structure"}, exclude_none=True)


class TissueLayer(Plain):
    """One layer of a medium, its coefficients for red, green and blue.

    name : what it is
    thickness_mm : None for a layer without end, which only the last can be [mm]
    absorption_per_mm : [1/mm]
    scattering_per_mm : reduced scattering [1/mm]
    """

    name: str = "layer"
    thickness_mm: Annotated[float | None, Field(gt=0, le=1000)] = None
    absorption_per_mm: tuple[_Absorption, _Absorption, _Absorption]
    scattering_per_mm: tuple[_Scattering, _Scattering, _Scattering]


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
    direction : "lambertian" skin returns light alike from and to all directions; "half-space" as one of the
        skin's mean colour does: more of what comes aslant, and what scattered only once leaves mostly aslant.
        Without a surface lobe it is index-matched, else of index 1.4
    pigments : what differs from those of the profile's skin: "spectral", "light", "medium", "dark", a file's
    layers : what the profile's medium consists of instead, topmost first: of "dj3", "skin1", a file's ...

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
    direction: Literal["lambertian", "half-space"] = "lambertian"
    pigments: Pigments | None = None
    layers: Annotated[tuple[TissueLayer, ...], Field(max_length=MOST_LAYERS)] = ()

    @property
    def has_own_tissue(self) -> bool:
        """Whether pigments or layers replace what the profile's name stands for."""
        return self.pigments is not None or bool(self.layers)

    @property
    def strength(self) -> float:
        """Strength rho_s of the lobe with the skin's oil, at most 1 [-]."""
        oily = min(1.0, self.rho_s * (1.0 + (_OILY_STRENGTH - 1.0) * self.oiliness))
        return 0.0 if self.specular == "none" else oily

    @property
    def smoothing(self) -> float:
        """Factor of the roughness that the skin's oil makes [-]."""
        return 1.0 - (1.0 - _OILY_SMOOTHING) * self.oiliness
