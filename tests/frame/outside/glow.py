"""Kind of a light from outside the package."""

from __future__ import annotations

from typing import Any

from outside.glow_light import GlowLight

from dermis.frame.lights.kind import Kind
from dermis.frame.projection import Triple


class _Glow(Kind[GlowLight]):
    def members(self, light: GlowLight, centre: Triple, distance: float) -> dict[str, Any]:
        return {"cos_inner": light.power}


GLOW = _Glow()
