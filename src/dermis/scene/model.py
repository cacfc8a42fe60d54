"""Scene: head, skin, lights, environment, camera and pose."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rig import PoseArrays
from dermis.scene.camera import Camera, portrait
from dermis.scene.conversions import as_camera, as_environment, as_head, as_lights, as_model
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, studio
from dermis.scene.living import SkinState, check_living_head
from dermis.scene.skin import Skin

if TYPE_CHECKING:
    from dermis.human.person import Human


@dataclass(frozen=True, init=False)
class Scene:
    """A head with skin and pose, lights, environment and camera.

    Scenes are immutable; `scene.replace(skin=...)` returns a changed copy.

    Parameters
    ----------
    head : Head, Human, str or path
        A head, a person, or a name or file that `load_head` accepts.
    lights : sequence of lights, light or str, optional
        Lights or the name of a preset; by default the preset "studio", or no lights if there is an
        environment.
    camera : Camera, str or callable, optional
        A camera, the name of a preset, or a function of the head; by default `portrait`.
    skin : Skin or mapping, optional
        Skin settings, or a mapping from fields of `Skin` to values; by default `Skin()`.
    environment : Environment, str or path, optional
        An environment or the name of its panorama.
    pose : Pose or mapping, optional
        Pose of the head, or a mapping from morph targets to weights; by default the rest pose.
    state : SkinState or mapping, optional
        State of the skin of a person, or a mapping from states ("blush", "pallor", "cold", "exertion",
        "crying") to weights; by default skin at rest.

    Raises
    ------
    DermisError
        For a pose that the head cannot assume, for a state of a head whose skin is not painted, and for
        arguments of other types.

    Examples
    --------
    >>> import dermis
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0), lights="window")
    >>> len(scene.lights), scene.skin.profile
    (2, 'gpu-gems-3')
    """

    head: Head
    lights: Sequence[Light]
    camera: Camera
    skin: Skin
    environment: Environment | None
    pose: Pose | None
    state: SkinState | None

    def __init__(
        self,
        head: Head | Human | str | os.PathLike[str],
        lights: Iterable[Light] | Light | str | None = None,
        camera: Camera | str | Callable[[Head], Camera] | None = None,
        skin: Skin | Mapping[str, Any] | None = None,
        environment: Environment | str | os.PathLike[str] | None = None,
        pose: Pose | Mapping[str, float] | None = None,
        state: SkinState | Mapping[str, float] | None = None,
    ) -> None:
        self._set_field("head", as_head(head))
        self._set_field("environment", as_environment(environment))
        self._set_field("skin", Skin() if skin is None else as_model(Skin, skin, "skin", 'profile="medium"'))
        if lights is None:
            self._set_field("lights", () if self.environment else studio(self.head))
        else:
            self._set_field("lights", as_lights(lights, self.head))
        self._set_field("camera", portrait(self.head) if camera is None else as_camera(camera, self.head))
        self._set_field("pose", Pose.coerce(pose))
        if self.pose is not None:
            self.pose_arrays  # noqa: B018 checks the pose
        self._set_field("state", SkinState.coerce(state))
        if self.state is not None:
            check_living_head(self.head, self.skin.albedo)

    @classmethod
    def coerce(cls, scene: object) -> Scene:
        """Return a scene unchanged, or make a scene with default lights and camera from a head.

        Raises DermisError for any other object.
        """
        return scene if isinstance(scene, Scene) else cls(scene)  # type: ignore[arg-type]

    def replace(self, **parts: Any) -> Scene:
        """Return a validated copy in which the fields passed as keywords, such as skin, have new values."""
        return replace(self, **parts)

    def _set_field(self, field_name: str, field_value: object) -> None:
        object.__setattr__(self, field_name, field_value)

    @cached_property
    def pose_arrays(self) -> PoseArrays | None:
        """Return the pose as arrays of target weights and bone matrices, or None for the rest pose."""
        return None if self.pose is None else self.pose.to_arrays(self.head.control_rig)
