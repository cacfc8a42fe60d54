"""Kind of a light from outside the package."""

from __future__ import annotations

from typing import Any

from outside.glow_light import GlowLight

from dermis.frame.lights.kind import LightKind
from dermis.frame.projection import Triple


class _GlowLightKind(LightKind[GlowLight]):
    def shader_members(self, light: GlowLight, head_centre: Triple, target_distance: float) -> dict[str, Any]:
        return {"cos_inner": light.power}


GLOW = _GlowLightKind()
