"""The whole of what is to be seen."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rig import Motion
from dermis.scene.camera import Camera, portrait
from dermis.scene.conversions import as_camera, as_environment, as_head, as_lights, as_model
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, studio
from dermis.scene.skin import Skin

if TYPE_CHECKING:
    from dermis.human.person import Human


@dataclass(frozen=True, init=False)
class Scene:
    """A head, its skin, the light on it and the camera before it.

    head : or what `load_head` takes, or a `Human`
    lights : several, one or the name of a preset; the studio preset when left out, or none with an
        environment
    camera : or the name of a preset; the portrait of the head when left out
    skin : or its values by name; the default skin when left out
    environment : or its name
    pose : how the head is moved, or weights of its morph targets by name; at rest when left out

    A scene does not change; `scene.replace(skin=...)` is another one.

    Raises DermisError for a pose that the head cannot take, and for parts of another kind.
    """

    head: Head
    lights: Sequence[Light]
    camera: Camera
    skin: Skin
    environment: Environment | None
    pose: Pose | None

    def __init__(
        self,
        head: Head | Human | str | os.PathLike[str],
        lights: Iterable[Light] | Light | str | None = None,
        camera: Camera | str | Callable[[Head], Camera] | None = None,
        skin: Skin | Mapping[str, Any] | None = None,
        environment: Environment | str | os.PathLike[str] | None = None,
        pose: Pose | Mapping[str, float] | None = None,
    ) -> None:
        self._set("head", as_head(head))
        self._set("environment", as_environment(environment))
        self._set("skin", Skin() if skin is None else as_model(Skin, skin, "skin", 'profile="medium"'))
        if lights is None:
            self._set("lights", () if self.environment else studio())
        else:
            self._set("lights", as_lights(lights))
        self._set("camera", portrait(self.head) if camera is None else as_camera(camera, self.head))
        self._set("pose", Pose.of(pose))
        if self.pose is not None:
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
        return None if self.pose is None else self.pose.motion(self.head.control)
