"""The whole of what is to be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dermis.mesh.head import Head
from dermis.scene.camera import Camera, portrait
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, studio
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class Scene:
    """A head, its skin, the light on it and the camera before it.

    lights : when left out the studio preset, or none with an environment
    camera : the portrait of the head when left out
    """

    head: Head
    lights: Sequence[Light] = None  # type: ignore[assignment]
    camera: Camera = None  # type: ignore[assignment]
    skin: Skin = field(default_factory=Skin)
    environment: Environment | None = None

    def __post_init__(self) -> None:
        if self.lights is None:
            object.__setattr__(self, "lights", () if self.environment else studio())
        if self.camera is None:
            object.__setattr__(self, "camera", portrait(self.head))
