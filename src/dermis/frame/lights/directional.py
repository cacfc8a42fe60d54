"""Directional light: parallel light, or light from a disc at infinity, such as the sun."""

from __future__ import annotations

import math

from dermis.frame.lights.kind import Kind, Members
from dermis.frame.projection import Triple
from dermis.scene.lights import DirectionalLight


class _Directional(Kind[DirectionalLight]):
    always = True

    def has_size(self, light: DirectionalLight) -> bool:
        return light.angle_degrees > 0

    def members(self, light: DirectionalLight, centre: Triple, distance: float) -> Members:
        return {"extent": math.tan(0.5 * math.radians(light.angle_degrees))}


KIND = _Directional()
