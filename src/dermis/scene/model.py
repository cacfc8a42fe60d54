"""The whole of what is to be seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from dermis.mesh.head import Head
from dermis.mesh.rig import Motion
from dermis.scene.camera import Camera, portrait
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, studio
from dermis.scene.pose import Pose
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class Scene:
    """A head, its skin, the light on it and the camera before it.

    lights : when left out the studio preset, or none with an environment
    camera : the portrait of the head when left out
    pose : how the head is moved, or weights of its morph targets by name; at rest when left out

    Raises DermisError for a pose that the head cannot take.
    """

    head: Head
    lights: Sequence[Light] = None  # type: ignore[assignment]
    camera: Camera = None  # type: ignore[assignment]
    skin: Skin = field(default_factory=Skin)
    environment: Environment | None = None
    pose: Pose | Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        if self.lights is None:
            object.__setattr__(self, "lights", () if self.environment else studio())
        if self.camera is None:
            object.__setattr__(self, "camera", portrait(self.head))
        if self.pose is not None:
            object.__setattr__(self, "pose", Pose.of(self.pose))
            self.motion  # noqa: B018 checks the pose

    @cached_property
    def motion(self) -> Motion | None:
        """The pose as numbers, None at rest."""
        pose = Pose.of(self.pose)
        return None if pose is None else pose.motion(self.head.control)
