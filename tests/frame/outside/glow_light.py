"""Light from outside the package: a point whose light is concentrated in its direction."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.lights import PointLight


class GlowLight(PointLight):
    """Point light that falls off with a power of the cosine from the line to its target."""

    kind: Literal["after-glow"] = "after-glow"  # type: ignore[assignment]
    power: Annotated[float, Field(ge=1, le=64)] = 4.0
    """Power of the cosine."""

    @property
    def sources(self) -> tuple[str, ...]:
        return ("Phong1975",)
