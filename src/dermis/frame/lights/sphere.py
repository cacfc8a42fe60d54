"""Spherical area light, with the same radiance at all points and in all directions."""

from __future__ import annotations

import math

import numpy as np

from dermis.base.errors import refuse
from dermis.frame.lights.kind import LightKind, StructMembers, area_light_members
from dermis.frame.projection import Triple, world_position
from dermis.mesh.head import Head
from dermis.scene.lights import SphereLight


class _SphereLightKind(LightKind[SphereLight]):
    punctual = False

    def check(self, light: SphereLight, head: Head, error_subject: str) -> None:
        middle = world_position(light.position, head.centre_mm)
        near = float(np.linalg.norm(head.mesh.positions - np.array(middle), axis=1).min())
        if near <= light.radius_mm:
            actual = f"the head is {near:.0f} mm from its middle"
            refuse(
                error_subject, f"a head outside the sphere of {light.radius_mm:g} mm", actual, "Move it away"
            )

    def shader_members(
        self, light: SphereLight, head_centre: Triple, target_distance: float
    ) -> StructMembers:
        radiance = 1.0 / (math.pi * (light.radius_mm / target_distance) ** 2)
        return area_light_members(light, radiance, light.radius_mm, light.radius_mm)


KIND = _SphereLightKind()
