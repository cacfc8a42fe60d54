"""Point light, which emits equally in all directions."""

from __future__ import annotations

from dermis.frame.lights.kind import Kind
from dermis.scene.lights import PointLight


class _Point(Kind[PointLight]):
    always = True


KIND = _Point()
