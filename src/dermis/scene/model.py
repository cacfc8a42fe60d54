"""The whole of what is to be seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from dermis.mesh.head import Head
from dermis.mesh.rig import Motion
from dermis.scene.camera import Camera, portrait
from dermis.scene.environment import Environment
from dermis.scene.given import given_camera, given_environment, given_head, given_lights, given_plain
from dermis.scene.lights import Light, studio
from dermis.scene.pose import Pose
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class Scene:
    """A head, its skin, the light on it and the camera before it.

    head : or what `load_head` takes, or a `Human`
    lights : several, one or the name of a preset; the studio preset when left out, or none with an
        environment
    camera : or the name of a preset; the portrait of the head when left out
    skin : or its values by name
    environment : or its name
    pose : how the head is moved, or weights of its morph targets by name; at rest when left out

    A scene does not change; `scene.replace(skin=...)` is another one.

    Raises DermisError for a pose that the head cannot take, and for parts of another kind.
    """

    head: Head
    lights: Sequence[Light] = None  # type: ignore[assignment]
    camera: Camera = None  # type: ignore[assignment]
    skin: Skin = field(default_factory=Skin)
    environment: Environment | None = None
    pose: Pose | Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        self._set("head", given_head(self.head))
        self._set("environment", given_environment(self.environment))
        self._set("skin", given_plain(Skin, self.skin, "skin", 'profile="medium"'))
        if self.lights is None:
            self._set("lights", () if self.environment else studio())
        else:
            self._set("lights", given_lights(self.lights))
        camera = portrait(self.head) if self.camera is None else given_camera(self.camera, self.head)
        self._set("camera", camera)
        if self.pose is not None:
            self._set("pose", Pose.of(self.pose))
            self.motion  # noqa: B018 checks the pose

    @classmethod
    def of(cls, given: object) -> Scene:
        """A scene that is one, or that of a head alone.

        Raises DermisError for anything else.
        """
        return given if isinstance(given, Scene) else cls(given)  # type: ignore[arg-type]

    def replace(self, **parts: Any) -> Scene:
        """The same with other parts, checked."""
        return replace(self, **parts)

    def _set(self, part: str, value: object) -> None:
        object.__setattr__(self, part, value)

    @cached_property
    def motion(self) -> Motion | None:
        """The pose as numbers, None at rest."""
        pose = Pose.of(self.pose)
        return None if pose is None else pose.motion(self.head.control)
