"""Lights as plain data; places are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from dermis.base.registry import Registry
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import Colour, Direction, FrozenModel, Vector, slider

__all__ = [
    "LIGHTS",
    "DirectionalLight",
    "Light",
    "PointLight",
    "RectangleLight",
    "SphereLight",
    "SpotLight",
    "StripeLight",
    "light_presets",
    "preset_lights",
    "preset_toml",
    "studio",
]

_Degrees = Annotated[
    float,
    Field(ge=0.01, le=89, json_schema_extra=slider(0.5, 88, log=True)),
    BoundsReason("degrees of half a cone before the lamp"),
]
_LAMP_REASON = BoundsReason("mm: lamps are neither thinner than paper nor larger than a square")
_Length = Annotated[float, Field(ge=0.1, le=1e5, json_schema_extra=slider(1, 3000, log=True)), _LAMP_REASON]

_BRIGHTNESS_SYNONYMS = ("brightness", "color", "colour", "energy", "intensity", "power", "strength")


def _equal_channels(value: Any) -> Any:
    """A number as that of all three channels."""
    return (value,) * 3 if isinstance(value, int | float) and not isinstance(value, bool) else value


class _LightBase(FrozenModel):
    """What every light has."""

    synonyms: ClassVar[Mapping[str, str]] = dict.fromkeys(_BRIGHTNESS_SYNONYMS, "irradiance")

    irradiance: Annotated[Colour, BeforeValidator(_equal_channels)] = (3.14, 3.14, 3.14)
    """Irradiance of a surface at the target that faces the light, linear Rec. 709; pi makes white skin 1."""
    shadows: bool = True
    """Whether it casts shadows."""
    softness_mm: Annotated[
        float,
        Field(ge=1e-3, le=1000, json_schema_extra=slider(0.1, 100, log=True)),
        BoundsReason("mm: finer than light's own waves no edge is"),
    ] = 1.5
    """Width over which a shadow's edge fades, at most 12 texels of the shadow map; for lights of some size it
    is the least width [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        """Keys of the bibliography: what its kind is drawn by."""
        return ()


class PointLight(_LightBase):
    """Light from a point in all directions; falls off with the square of the distance."""

    kind: Literal["point"] = "point"
    """Word for this kind of light in scene files."""
    position: Vector = Field(kw_only=False)
    """Where it stands [mm]."""
    target: Vector = (0.0, 0.0, 0.0)
    """Where it is directed, and where its irradiance is given [mm]."""

    @model_validator(mode="after")
    def _check_distance(self) -> PointLight:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("a position away from the target")
        return self


class SpotLight(PointLight):
    """A point light within a cone around the line to the target."""

    kind: Literal["spot"] = "spot"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    inner_degrees: _Degrees = 25.0
    """Half angle at which the cone begins to fade."""
    outer_degrees: _Degrees = 35.0
    """Half angle at which the cone ends."""

    @model_validator(mode="after")
    def _check_cone(self) -> SpotLight:
        if self.inner_degrees >= self.outer_degrees:
            raise ValueError("inner_degrees less than outer_degrees")
        return self


class RectangleLight(PointLight):
    """A window or softbox: an even rectangle that faces the target, one pair of sides level."""

    kind: Literal["rectangle"] = "rectangle"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    width_mm: _Length = 600.0
    """Length of the level sides [mm]."""
    height_mm: _Length = 600.0
    """Length of the other sides [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        return "Baum1989", "Roberts2018"


class SphereLight(PointLight):
    """An evenly bright sphere, as a lamp with a globe."""

    kind: Literal["sphere"] = "sphere"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    radius_mm: Annotated[
        float, Field(ge=0.1, le=1e5, json_schema_extra=slider(1, 500, log=True)), _LAMP_REASON
    ] = 100.0
    """Radius of the sphere [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        return "ShirleyChiu1997", "Roberts2018"

    @model_validator(mode="after")
    def _check_target_outside(self) -> SphereLight:
        if np.linalg.norm(np.subtract(self.target, self.position)) <= self.radius_mm:
            raise ValueError("a target outside the sphere")
        return self


class DirectionalLight(_LightBase):
    """Parallel light, as from the sun."""

    kind: Literal["directional"] = "directional"
    """Word for this kind of light in scene files."""
    direction: Direction = Field(kw_only=False)
    """The way in which the light travels."""
    angle_degrees: Annotated[float, Field(ge=0, le=20), BoundsReason("degrees; wider light is no beam")] = 0.0
    """Angle that its source spans, 0.53 for the sun: shadows harden towards what casts them."""

    @property
    def sources(self) -> tuple[str, ...]:
        return ("Roberts2018",) if self.angle_degrees > 0 else ()


class StripeLight(DirectionalLight):
    """A sheet of parallel light, as from a laser through a cylindrical lens."""

    kind: Literal["stripe"] = "stripe"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    position: Vector = (0.0, 0.0, 0.0)
    """A point in the middle of the sheet [mm]."""
    up: Direction = (0.0, 1.0, 0.0)
    """The way along which the stripe is long."""
    width_mm: _Length = 1.5
    """Width of a Gaussian across, between the edges at 1/e^2 of its middle [mm]."""
    length_mm: _Length = 300.0
    """Length of the stripe [mm]."""

    @model_validator(mode="after")
    def _check_sheet(self) -> StripeLight:
        if self.angle_degrees > 0:
            raise ValueError("no angle_degrees, for a sheet of light is parallel")
        if np.linalg.norm(np.cross(self.direction, self.up)) < 1e-6 * np.linalg.norm(self.up):
            raise ValueError("up in another direction than the light's")
        return self


Light = PointLight | DirectionalLight
"""Every kind is one or the other, with more to it."""

LIGHTS: Registry[type[Light]] = Registry(
    "light",
    {
        "point": PointLight,
        "spot": SpotLight,
        "rectangle": RectangleLight,
        "sphere": SphereLight,
        "directional": DirectionalLight,
        "stripe": StripeLight,
    },
)
"""Kinds by their names in scene files. `dermis.frame.lights.kind.KINDS` draws them, MITSUBA and CYCLES of
`dermis.apps.truths.lights` judge them; exports take others for the kind they derive from."""


NO_LIGHTS = "none"
"""Name of the rig without lights, for an environment alone."""


def light_presets() -> list[str]:
    """Names of the rigs of the package."""
    names = [entry.name for entry in (resources.files("dermis.scene") / "presets").iterdir()]
    return sorted([NO_LIGHTS, *(name.removesuffix(".toml") for name in names if name.endswith(".toml"))])


def preset_lights(name: str) -> tuple[Light, ...]:
    """The lights of a rig of the package, by its name."""
    if name == NO_LIGHTS:
        return ()
    return tuple(LIGHTS[table["kind"]](**table) for table in tomllib.loads(preset_toml(name))["lights"])


def preset_toml(name: str) -> str:
    """The file of a rig of the package."""
    return (resources.files("dermis.scene") / "presets" / f"{name}.toml").read_text(encoding="utf-8")


def studio() -> tuple[Light, ...]:
    """Three shadowed spots: a warm key from the upper left, a weak fill, a cool rim from behind."""
    return preset_lights("studio")
