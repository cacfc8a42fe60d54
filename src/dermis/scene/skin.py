"""Settings of the skin: specular reflection and subsurface scattering."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dermis.base.errors import format_value, refuse
from dermis.base.renamed import renamed_attribute
from dermis.optics.pigments.parameters import Structure
from dermis.optics.reduced_scattering import check_reduced
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider
from dermis.scene.talk_comparisons import EnergyConservation, SpecularColour
from dermis.specular.models import FresnelName, SpecularName

DiffuseDirectionName = Literal["lambertian", "half-space"]
MAX_LAYERS = 8
MAX_OTHER_PROFILES = 2
"""Number of profiles that a map can mix with the main profile."""
_OILY_RHO_S_FACTOR, _OILY_ROUGHNESS_FACTOR = 2.0, 0.6
DEFAULT_ROUGHNESS, DEFAULT_RHO_S = 0.3, 0.45
SKIN_PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "deck-2007": {"specular": "kelemen", "rho_s": 0.18, "direction": "lambertian"},
}
"""For each preset, the settings that differ from the default; "deck-2007" is the skin of the 2007 talk."""


_Fraction = Annotated[float | None, Field(ge=0, le=1)]
_COEFFICIENT_REASON = BoundsReason("1/mm: white paint has some hundreds")
_AbsorptionCoefficient = Annotated[float, Field(ge=0, le=1e4), _COEFFICIENT_REASON]
_ScatteringCoefficient = Annotated[float, Field(ge=1e-6, le=1e4), _COEFFICIENT_REASON]
_COEFFICIENT_SLIDER = Field(json_schema_extra=slider(1e-4, 50, logarithmic=True))


class Pigments(FrozenModel):
    """Overrides of the pigments of a skin profile; a field that is None keeps the pigment of the profile."""

    structure: Structure | None = None
    """Model of the layers: "dj2006" has two, "donner2008" adds a layer of melanin, "biospec" has four."""
    melanin: Annotated[_Fraction, Field(json_schema_extra=slider(0.0005, 0.6, logarithmic=True))] = None
    """Volume fraction of melanosomes in the epidermis."""
    eumelanin: _Fraction = None
    """Fraction of eumelanin in the melanosomes; the rest is pheomelanin."""
    blood: Annotated[_Fraction, Field(json_schema_extra=slider(0.0005, 0.2, logarithmic=True))] = None
    """Volume fraction of blood in the dermis."""
    oxygen: _Fraction = None
    """Oxygen saturation of the blood."""
    epidermis_mm: Annotated[
        float | None,
        Field(ge=1e-3, le=2, json_schema_extra=slider(0.02, 0.5)),
        BoundsReason("mm: from less than a cell to a callus"),
    ] = None
    """Thickness of the epidermis [mm]."""
    epidermal_blood: Annotated[_Fraction, Field(json_schema_extra=slider(0, 0.1))] = None
    """Volume fraction of blood in the epidermis, for "donner2008" only."""
    baseline: _Fraction = None
    """Absorption of tissue without blood and melanin, relative to the values of [Jacques1998]."""

    def overrides(self) -> dict[str, float]:
        """Return a dictionary from field names to the values that override pigments of the profile."""
        return self.model_dump(exclude={"structure"}, exclude_none=True)


class TissueLayer(FrozenModel):
    """Layer of a skin medium, with absorption and reduced scattering for red, green and blue."""

    name: str = "layer"
    """Name of the layer."""
    thickness_mm: Annotated[
        float | None,
        Field(ge=1e-4, le=1000, json_schema_extra=slider(0.01, 5, logarithmic=True)),
        BoundsReason("mm: from a cell membrane to more than a body"),
    ] = None
    """Thickness; None for a last layer that is infinitely deep [mm]."""
    absorption_per_mm: Annotated[
        tuple[_AbsorptionCoefficient, _AbsorptionCoefficient, _AbsorptionCoefficient], _COEFFICIENT_SLIDER
    ]
    """Absorption coefficient [1/mm]."""
    scattering_per_mm: Annotated[
        tuple[_ScatteringCoefficient, _ScatteringCoefficient, _ScatteringCoefficient], _COEFFICIENT_SLIDER
    ]
    """Reduced scattering coefficient [1/mm]."""

    @model_validator(mode="before")
    @classmethod
    def _check_reduced_scattering(cls, fields: object) -> object:
        if isinstance(fields, Mapping):
            check_reduced("layers", fields)
        return fields


class Skin(FrozenModel):
    """Surface reflection and subsurface scattering of skin.

    Sources: [dEonLuebke2007] sections 14.3-14.5, [Dudash2007].

    Examples
    --------
    >>> import dermis
    >>> skin = dermis.Skin(oiliness=0.5)
    >>> round(skin.specular_strength, 3), skin.replace(mix=0).mix
    (0.675, 0.0)
    """

    profile: str = "gpu-gems-3"
    """Diffusion profile: "gpu-gems-3", a medium or skin (dj3, skin1, light ...), a .toml file as written by
    `dermis profile -o`, or a CSV file with variance_mm2,red,green,blue."""
    profile_map: str | None = None
    """Map of the weights of the other profiles, in the head's uv, linear values: red (or grey) for the first,
    green for the second."""
    other_profiles: Annotated[tuple[str, ...], Field(max_length=MAX_OTHER_PROFILES)] = ()
    """One or two profiles that `profile_map` mixes with the main one; only for the technique
    "texture-space"."""
    albedo: Literal["map", "profile"] = "map"
    """Source of the skin's colour: "map" normalises the profile to white and uses the colour map; "profile"
    keeps the colour of the profile and ignores the map."""
    mix: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Fraction of the colour map that is applied before scattering; the rest is applied after it."""
    roughness: Annotated[
        float, Field(ge=0.05, le=1), BoundsReason("from near-mirror skin to slopes of 45 degrees")
    ] = DEFAULT_ROUGHNESS
    """Beckmann roughness m of the surface. A roughness map is multiplied by this value divided by 0.3: 0.6
    doubles the values of the map."""
    rho_s: Annotated[float, Field(ge=0, le=1)] = DEFAULT_RHO_S
    """Specular strength, relative to a rough dielectric boundary of index 1.4."""
    oiliness: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Single control of strength and roughness: 1 is shiny skin, with twice the strength and 0.6 times the
    roughness; an artist's mapping, not a measured one."""
    specular: SpecularName = "two-lobe"
    """Specular lobe; "none" leaves it out."""
    fresnel: FresnelName = "schlick"
    """Fresnel reflectance: Schlick's approximation with F0 = 0.028, or exact for an index of 1.4."""
    specular_colour: SpecularColour = "white"
    energy: EnergyConservation = "full"
    direction: DiffuseDirectionName = "half-space"
    """Directional dependence of diffuse light: "lambertian" for none; "half-space" as for a scattering
    half-space of the skin's mean colour, which reflects more at oblique incidence and for oblique views."""
    anisotropy: Annotated[
        float,
        Field(ge=0, le=0.95),
        BoundsReason("more is nearly unscattered light, which the model does not describe"),
    ] = 0.0
    """Mean cosine of the scattering angle, used with direction "half-space"; it does not change the reduced
    scattering. At 0.8, as in real tissue, skin reflects more of the light at oblique incidence, and more
    light passes through thin parts."""
    pigments: Pigments | None = None
    """Overrides of the pigments of the profile, which is "spectral", "light", "medium", "dark" or a file."""
    layers: Annotated[tuple[TissueLayer, ...], Field(max_length=MAX_LAYERS)] = ()
    """Layers that replace the layers of the profile's medium ("dj3", "skin1" or a file), topmost first."""

    @classmethod
    def preset(cls, name: str) -> Skin:
        """Return the settings of a skin preset.

        Parameters
        ----------
        name : str
            A key of `SKIN_PRESETS`: "default" or "deck-2007".

        Returns
        -------
        Skin
            The preset's settings.

        Raises
        ------
        DermisError
            For any other name.
        """
        if not isinstance(name, str) or name not in SKIN_PRESETS:
            refuse(
                "skin", f"one of {', '.join(SKIN_PRESETS)}", f"got {format_value(name)}", "Choose one of them"
            )
        return cls(**SKIN_PRESETS[name])

    @property
    def overrides_tissue(self) -> bool:
        """Return whether `pigments` or `layers` replace optical properties that the profile describes."""
        return self.pigments is not None or bool(self.layers)

    @property
    def specular_strength(self) -> float:
        """Return the specular strength: rho_s increased by oiliness, at most 1; 0 without a lobe [-]."""
        oily = min(1.0, self.rho_s * (1.0 + (_OILY_RHO_S_FACTOR - 1.0) * self.oiliness))
        return 0.0 if self.specular == "none" else oily

    @property
    def roughness_factor(self) -> float:
        """Return the factor, at most 1, by which the roughness is multiplied to account for oiliness [-]."""
        return 1.0 - (1.0 - _OILY_ROUGHNESS_FACTOR) * self.oiliness

    smoothing = renamed_attribute("smoothing", "roughness_factor")
    strength = renamed_attribute("strength", "specular_strength")


def lobe_name(skin: Skin) -> str:
    """Return the name of the specular lobe of a skin, or of the default lobe if the skin has none.

    The default is needed because wet materials, such as eyes, have a lobe even if the skin has none.
    """
    from dermis.specular.models import MODELS

    return next(iter(MODELS)) if skin.specular == "none" else skin.specular
