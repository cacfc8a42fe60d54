"""Spot light, a point light that is limited to a cone."""

from __future__ import annotations

import math

from dermis.frame.lights.kind import LightKind, StructMembers
from dermis.frame.projection import Triple
from dermis.scene.lights import SpotLight


class _SpotLightKind(LightKind[SpotLight]):
    always = True

    def shader_members(self, light: SpotLight, head_centre: Triple, target_distance: float) -> StructMembers:
        inner, outer = math.radians(light.inner_degrees), math.radians(light.outer_degrees)
        return {"cos_inner": math.cos(inner), "cos_outer": math.cos(outer)}


KIND = _SpotLightKind()
