"""Lights. Positions are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from dermis.base.registry import Registry
from dermis.mesh.head import Head
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

_ConeHalfAngle = Annotated[
    float,
    Field(ge=0.01, le=89, json_schema_extra=slider(0.5, 88, logarithmic=True)),
    BoundsReason("degrees: half angle of a cone in front of the lamp"),
]
_LAMP_LENGTH_REASON = BoundsReason("mm: from the thickness of paper to 100 m")
_LampLength = Annotated[
    float, Field(ge=0.1, le=1e5, json_schema_extra=slider(1, 3000, logarithmic=True)), _LAMP_LENGTH_REASON
]

_BRIGHTNESS_SYNONYMS = ("brightness", "color", "colour", "energy", "intensity", "power", "strength")


def _equal_channels(number_or_colour: Any) -> Any:
    """Convert a number to three equal channels (red, green, blue); return other values unchanged."""
    return (
        (number_or_colour,) * 3
        if isinstance(number_or_colour, int | float) and not isinstance(number_or_colour, bool)
        else number_or_colour
    )


class _LightBase(FrozenModel):
    """Base class of lights, with the fields that all lights have: irradiance and properties of shadows."""

    synonyms: ClassVar[Mapping[str, str]] = dict.fromkeys(_BRIGHTNESS_SYNONYMS, "irradiance")

    irradiance: Annotated[Colour, BeforeValidator(_equal_channels)] = (3.14, 3.14, 3.14)
    """Irradiance at the target, on a surface that faces the light, linear Rec. 709; with pi, white skin has
    radiance 1."""
    shadows: bool = True
    """Whether the light casts shadows."""
    softness_mm: Annotated[
        float,
        Field(ge=1e-3, le=1000, json_schema_extra=slider(0.1, 100, logarithmic=True)),
        BoundsReason("mm: from the wavelength of light to a metre"),
    ] = 1.5
    """Width over which the edge of a shadow fades, at most 12 texels of the shadow map; for area lights the
    minimum width [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        """Return the bibliography keys of the shading method for this type of light."""
        return ()


class PointLight(_LightBase):
    """Point light that emits equally in all directions, with inverse-square falloff.

    Examples
    --------
    >>> import dermis
    >>> dermis.PointLight((0, 300, 900), irradiance=2).irradiance
    (2.0, 2.0, 2.0)
    """

    kind: Literal["point"] = "point"
    """Word for this kind of light in scene files."""
    position: Vector = Field(kw_only=False)
    """Position of the light [mm]."""
    target: Vector = (0.0, 0.0, 0.0)
    """Point that the light is aimed at, where its irradiance is specified [mm]."""

    @model_validator(mode="after")
    def _check_distance(self) -> PointLight:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("a position away from the target")
        return self


class SpotLight(PointLight):
    """Point light restricted to a cone around the line from the light to its target.

    Examples
    --------
    >>> import dermis
    >>> dermis.SpotLight((0, 300, 900), inner_degrees=10, outer_degrees=20).kind
    'spot'
    """

    kind: Literal["spot"] = "spot"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    inner_degrees: _ConeHalfAngle = 25.0
    """Half angle up to which the light has full strength."""
    outer_degrees: _ConeHalfAngle = 35.0
    """Half angle at which the light has faded to zero."""

    @model_validator(mode="after")
    def _check_cone(self) -> SpotLight:
        if self.inner_degrees >= self.outer_degrees:
            raise ValueError("inner_degrees less than outer_degrees")
        return self


class RectangleLight(PointLight):
    """Rectangular area light of uniform radiance, such as a window or a softbox.

    The rectangle faces its target, and two of its sides are horizontal.

    Examples
    --------
    >>> import dermis
    >>> dermis.RectangleLight((900, 300, 900), width_mm=400, height_mm=800).sources
    ('Baum1989', 'Roberts2018')
    """

    kind: Literal["rectangle"] = "rectangle"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    width_mm: _LampLength = 600.0
    """Length of the horizontal sides [mm]."""
    height_mm: _LampLength = 600.0
    """Length of the other sides [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        """Return the bibliography keys of the shading method for rectangular lights."""
        return "Baum1989", "Roberts2018"


class SphereLight(PointLight):
    """Spherical area light of uniform radiance, such as a globe lamp.

    Examples
    --------
    >>> import dermis
    >>> dermis.SphereLight((0, 300, 900), radius_mm=50).radius_mm
    50.0
    """

    kind: Literal["sphere"] = "sphere"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    radius_mm: Annotated[
        float, Field(ge=0.1, le=1e5, json_schema_extra=slider(1, 500, logarithmic=True)), _LAMP_LENGTH_REASON
    ] = 100.0
    """Radius of the sphere [mm]."""

    @property
    def sources(self) -> tuple[str, ...]:
        """Return the bibliography keys of the shading method for spherical lights."""
        return "ShirleyChiu1997", "Roberts2018"

    @model_validator(mode="after")
    def _check_target_outside(self) -> SphereLight:
        if np.linalg.norm(np.subtract(self.target, self.position)) <= self.radius_mm:
            raise ValueError("a target outside the sphere")
        return self


class DirectionalLight(_LightBase):
    """Parallel light, such as the sun.

    `angle_degrees` is the angle that the source of the light subtends. If it is above 0, shadows are soft,
    and `sources` has the bibliography key of the method that draws them; otherwise, `sources` is empty.

    Examples
    --------
    >>> import dermis
    >>> sun = dermis.DirectionalLight((0, -1, -1), angle_degrees=0.53)
    >>> sun.replace(angle_degrees=0).sources
    ()
    """

    kind: Literal["directional"] = "directional"
    """Word for this kind of light in scene files."""
    direction: Direction = Field(kw_only=False)
    """Direction in which the light travels."""
    angle_degrees: Annotated[
        float, Field(ge=0, le=20), BoundsReason("degrees: wider light is not parallel")
    ] = 0.0
    """Angular diameter of the source, 0.53 for the sun; shadows are sharper near the surface that casts
    them."""

    @property
    def sources(self) -> tuple[str, ...]:
        """Return the bibliography keys of the method for soft shadows; empty if `angle_degrees` is 0."""
        return ("Roberts2018",) if self.angle_degrees > 0 else ()


class StripeLight(DirectionalLight):
    """Sheet of parallel light, such as a laser through a cylindrical lens.

    Examples
    --------
    >>> import dermis
    >>> dermis.StripeLight((0, 0, -1), width_mm=1).length_mm
    300.0
    """

    kind: Literal["stripe"] = "stripe"  # type: ignore[assignment]
    """Word for this kind of light in scene files."""
    position: Vector = (0.0, 0.0, 0.0)
    """Point in the middle of the sheet [mm]."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction of the stripe's length."""
    width_mm: _LampLength = 1.5
    """Width of the Gaussian cross-section, between its points at 1/e^2 of the maximum [mm]."""
    length_mm: _LampLength = 300.0
    """Length of the stripe [mm]."""

    @model_validator(mode="after")
    def _check_sheet(self) -> StripeLight:
        if self.angle_degrees > 0:
            raise ValueError("angle_degrees of 0, as a sheet of light is parallel")
        if np.linalg.norm(np.cross(self.direction, self.up)) < 1e-6 * np.linalg.norm(self.up):
            raise ValueError("up not parallel to the direction of the light")
        return self


Light = PointLight | DirectionalLight
"""Base classes of all lights."""

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
"""Classes of lights by their names in scene files.

A new class also needs an entry in `dermis.frame.lights.kind.KINDS`, which draws lights. With entries in
MITSUBA_LIGHTS and CYCLES_LIGHTS of `dermis.apps.truths.lights`, the reference renderers draw it too. Exports
write its lights as lights of the class that it derives from."""


# Reach of a typical head, and largest reach for which the lights of presets are not moved away.
_HEAD_REACH_MM, _MAX_HEAD_REACH_MM = 400.0, 1000.0
_NARROW_SPOT_DEGREES = 10.0
_LAMP_SIZE_FIELDS = "width_mm", "height_mm", "radius_mm"
_VECTOR_FIELDS = "position", "target", "direction", "up"
NO_LIGHTS = "none"
"""Name of the preset without lights, for an environment alone."""


def light_presets() -> list[str]:
    """Return the names of the light presets, such as "studio"."""
    names = [entry.name for entry in (resources.files("dermis.scene") / "presets").iterdir()]
    return sorted([NO_LIGHTS, *(name.removesuffix(".toml") for name in names if name.endswith(".toml"))])


def preset_lights(preset_name: str, head: Head | None = None) -> tuple[Light, ...]:
    """Return the lights that a light preset places for a head.

    head : head to light; None for a head of ordinary size that faces +Z

    For a body larger than a metre, the lights are proportionally farther away and larger, except for narrow
    spot lights, which light only a part of the head. For a flat piece of skin, the lights are on the side
    that the skin faces.
    """
    if preset_name == NO_LIGHTS:
        return ()
    lights = tuple(
        LIGHTS[table["kind"]](**table) for table in tomllib.loads(preset_toml(preset_name))["lights"]
    )
    return lights if head is None else tuple(_place_light(light, head) for light in lights)


def _place_light(light: Light, head: Head) -> Light:
    reach = head.reach_mm
    factor = (
        reach / _HEAD_REACH_MM
        if reach > _MAX_HEAD_REACH_MM and not _is_independent_of_body_size(light)
        else 1.0
    )
    if factor == 1.0 and np.array_equal(head.front_view_axes, np.eye(3)):
        return light
    values: dict[str, Any] = {
        name: factor * getattr(light, name) for name in _LAMP_SIZE_FIELDS if hasattr(light, name)
    }
    for name in _VECTOR_FIELDS:
        if hasattr(light, name):
            values[name] = tuple((np.array(getattr(light, name)) @ head.front_view_axes).tolist())
    if isinstance(light, PointLight):
        target = np.array(light.target)
        values["position"] = tuple(
            ((target + factor * (light.position - target)) @ head.front_view_axes).tolist()
        )
    return light.replace(**values)


def _is_independent_of_body_size(light: Light) -> bool:
    """Return whether a light is placed independently of the body's size: parallel light or a narrow spot."""
    return not isinstance(light, PointLight) or (
        isinstance(light, SpotLight) and light.outer_degrees < _NARROW_SPOT_DEGREES
    )


def preset_toml(preset_name: str) -> str:
    """Return the [[lights]] tables of a light preset as TOML text."""
    return (resources.files("dermis.scene") / "presets" / f"{preset_name}.toml").read_text(encoding="utf-8")


def studio(head: Head | None = None) -> tuple[Light, ...]:
    """Return the preset "studio": three spot lights with shadows.

    Parameters
    ----------
    head : Head, optional
        Head for which the lights are placed; lights for a body larger than a metre are farther away.

    Returns
    -------
    tuple of SpotLight
        A warm key light from the upper left, a weak fill light, and a cool rim light from behind.

    Examples
    --------
    >>> import dermis
    >>> [light.kind for light in dermis.studio()]
    ['spot', 'spot', 'spot']
    """
    return preset_lights("studio", head)
