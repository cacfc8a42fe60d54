"""Lights as plain data; places are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from dermis.scene.plain import Colour, Direction, Plain, Vector

_Degrees = Annotated[float, Field(gt=0, lt=89)]


class _Source(Plain):
    """What every light has.

    irradiance : on a surface at the target that faces the light, linear Rec. 709; pi makes white skin 1
    shadows : whether it casts shadows
    softness_mm : width over which a shadow's edge fades, at most 12 texels of the shadow map [mm]
    """

    irradiance: Colour = (3.14, 3.14, 3.14)
    shadows: bool = True
    softness_mm: Annotated[float, Field(gt=0, le=1000)] = 1.5


class PointLight(_Source):
    """Light from a point in all directions; falls off with the square of the distance."""

    kind: Literal["point"] = "point"
    position: Vector
    target: Vector = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _apart(self) -> PointLight:
        if np.linalg.norm(np.subtract(self.target, self.position)) < 1e-3:
            raise ValueError("a position away from the target")
        return self


class SpotLight(PointLight):
    """A point light within a cone around the line to the target.

    inner_degrees, outer_degrees : half angles where the cone begins and ends to fade
    """

    kind: Literal["spot"] = "spot"  # type: ignore[assignment]
    inner_degrees: _Degrees = 25.0
    outer_degrees: _Degrees = 35.0

    @model_validator(mode="after")
    def _fades(self) -> SpotLight:
        if self.inner_degrees >= self.outer_degrees:
            raise ValueError("inner_degrees less than outer_degrees")
        return self


class DirectionalLight(_Source):
    """Parallel light, as from the sun.

    direction : the way the light travels
    """

    kind: Literal["directional"] = "directional"
    direction: Direction


Light = PointLight | SpotLight | DirectionalLight


def studio() -> tuple[Light, ...]:
    """Three shadowed spots: a warm key from the upper left, a weak fill, a cool rim from behind."""
    from dermis.scene.files import preset_lights

    return preset_lights("studio")
