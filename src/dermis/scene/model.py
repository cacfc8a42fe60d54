"""The whole of what is to be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from dermis.assets.head import Head
from dermis.scene.camera import Camera, portrait
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight, studio
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class Scene:
    """A head, its skin, the lights on it and the camera before it.

    lights : the studio preset when left out
    camera : the portrait of the head when left out
    """

    head: Head
    lights: Sequence[PointLight | SpotLight | DirectionalLight] = field(default_factory=studio)
    camera: Camera = None  # type: ignore[assignment]
    skin: Skin = field(default_factory=Skin)

    def __post_init__(self) -> None:
        if self.camera is None:
            object.__setattr__(self, "camera", portrait(self.head))
