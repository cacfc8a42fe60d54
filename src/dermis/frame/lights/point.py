"""Point light, which emits equally in all directions."""

from __future__ import annotations

from dermis.frame.lights.kind import LightKind
from dermis.scene.lights import PointLight


class _PointLightKind(LightKind[PointLight]):
    always = True


KIND = _PointLightKind()
