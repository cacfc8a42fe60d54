"""Spot light, a point light that is limited to a cone."""

from __future__ import annotations

import math

from dermis.frame.lights.kind import Kind, Members
from dermis.frame.projection import Triple
from dermis.scene.lights import SpotLight


class _Spot(Kind[SpotLight]):
    always = True

    def members(self, light: SpotLight, centre: Triple, distance: float) -> Members:
        inner, outer = math.radians(light.inner_degrees), math.radians(light.outer_degrees)
        return {"cos_inner": math.cos(inner), "cos_outer": math.cos(outer)}


KIND = _Spot()
