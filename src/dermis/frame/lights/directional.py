"""Directional light: parallel light, or light from a disc at infinity, such as the sun."""

from __future__ import annotations

import math

from dermis.frame.lights.kind import LightKind, StructMembers
from dermis.frame.projection import Triple
from dermis.scene.lights import DirectionalLight


class _DirectionalLightKind(LightKind[DirectionalLight]):
    always = True

    def has_penumbra(self, light: DirectionalLight) -> bool:
        return light.angle_degrees > 0

    def shader_members(
        self, light: DirectionalLight, head_centre: Triple, target_distance: float
    ) -> StructMembers:
        return {"extent": math.tan(0.5 * math.radians(light.angle_degrees))}


KIND = _DirectionalLightKind()
