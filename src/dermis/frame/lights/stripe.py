"""Thin sheet of parallel light, which illuminates a stripe on the skin."""

from __future__ import annotations

import numpy as np

from dermis.frame.lights.kind import LightKind, StructMembers
from dermis.frame.projection import Triple, view_axes_array, world_position
from dermis.scene.lights import StripeLight


class _StripeLightKind(LightKind[StripeLight]):
    sheet = True

    def shader_members(
        self, light: StripeLight, head_centre: Triple, target_distance: float
    ) -> StructMembers:
        right, up, _ = view_axes_array(np.array(light.direction), np.array(light.up))
        across, along = 2.0 * right / light.width_mm, 2.0 * up / light.length_mm
        return {"position": world_position(light.position, head_centre), "half_u": across, "half_v": along}


KIND = _StripeLightKind()
