"""Immutable state of the viewer, its scene file, and the undo history."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from dermis.apps.viewer.posing import poses_equal
from dermis.base.errors import refuse
from dermis.human.person import Human
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose, merge_poses
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.files import head_table, load_lights, load_scene
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.head_table import has_region_table
from dermis.scene.heads import load_head
from dermis.scene.lights import NO_LIGHTS, Light
from dermis.scene.living import SkinState, is_living_head
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.pulse import Pulse
from dermis.scene.saving import save_scene
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS, Settings
from dermis.scene.skin import Pigments

ATLAS_VIEW_NAME = "atlas"
"""Name of the view that shows the atlas as a flat image."""
_MIN_ATLAS_SPAN, _MAX_ATLAS_SPAN = 2.0**-10, 2.0


@dataclass(frozen=True)
class AtlasView:
    """Part of the atlas that the view "atlas" shows.

    layer : map to show, one of `views.ATLAS_LAYERS`
    centre : uv at the centre of the picture, u to the right and v down [-]
    span : length shown along the picture's shorter side, as a fraction of the side of the atlas [-]
    """

    layer: str = "irradiance"
    centre: tuple[float, float] = (0.5, 0.5)
    span: float = 1.05

    def panned(self, right_shift: float, down_shift: float) -> AtlasView:
        """Return the view moved by a drag of the pointer.

        right_shift : motion of the pointer to the right, as a fraction of the picture's shorter side
        down_shift : motion of the pointer downwards, as a fraction of the picture's shorter side
        """
        u, v = self.centre
        return self._with_centre(u - self.span * right_shift, v - self.span * down_shift)

    def zoomed(self, span_factor: float, x: float, y: float) -> AtlasView:
        """Return the view zoomed around the cursor.

        span_factor : factor by which the visible length is multiplied; a factor below 1 zooms in
        x, y : position of the cursor relative to the picture's centre, x to the right and y down, as
            fractions of the picture's shorter side
        """
        span = min(_MAX_ATLAS_SPAN, max(_MIN_ATLAS_SPAN, span_factor * self.span))
        (u, v), reduction = self.centre, self.span - span
        return replace(self, span=span)._with_centre(u + reduction * x, v + reduction * y)

    def _with_centre(self, centre_u: float, centre_v: float) -> AtlasView:
        return replace(self, centre=(min(1.0, max(0.0, centre_u)), min(1.0, max(0.0, centre_v))))


P = TypeVar("P", bound=FrozenModel)
Table = Mapping[str, Any]
"""The [head] table of a scene file."""
PICTURE_VIEW_NAME = "picture"
LIGHT_COMPONENT_VIEWS = {"diffuse": "diffuse", "specular": "specular"}
"""Dictionary from views that show only a part of the light to their values of `Settings.parts`."""


@dataclass(frozen=True, eq=False)
class ViewerState:
    """State of the viewer: the scene, the render settings, and the view that is displayed.

    settings : render settings; their `size` is ignored, because the window determines the size
    head : table from which the head was loaded, with the keys of the [head] table of a scene file; empty for
        a head created in memory
    view : picture or intermediate result to display, one of `views.VIEW_NAMES`
    light_preset : name of the light preset; empty for custom lights
    atlas_view : part of the atlas that the view "atlas" shows
    seconds : time in the motion from which the pose was taken [s]
    """

    scene: Scene
    settings: Settings = field(default_factory=Settings)
    head: Table = field(default_factory=dict)
    view: str = PICTURE_VIEW_NAME
    light_preset: str = "studio"
    atlas_view: AtlasView = field(default_factory=AtlasView)
    seconds: float = 0.0

    @property
    def head_table(self) -> Table:
        """Return the table `head` plus the head's subdivision level; empty for a head created in memory."""
        return self.head and {"subdivide": self.scene.head.levels, **self.head}

    def with_skin(self, **fields: object) -> ViewerState:
        """Return a copy with new values of some fields of the skin.

        Raises DermisError for invalid values.
        """
        return self._with_scene(skin=validated_copy(self.scene.skin, **fields))

    def with_pigments(self, **fields: object) -> ViewerState:
        """Return a copy with new values of some pigments of the skin."""
        pigments = self.scene.skin.pigments or Pigments()
        return self.with_skin(pigments=validated_copy(pigments, **fields).model_dump())

    def with_settings(self, **fields: object) -> ViewerState:
        """Return a copy with new values of some render settings."""
        return replace(self, settings=validated_copy(self.settings, **fields))

    def with_camera(self, camera: Camera) -> ViewerState:
        """Return a copy with another camera."""
        return self._with_scene(camera=camera)

    def with_lights(self, lights: Sequence[Light], light_preset: str = "") -> ViewerState:
        """Return a copy with other lights.

        light_preset : name of the light preset; empty for custom lights
        """
        return replace(self._with_scene(lights=tuple(lights)), light_preset=light_preset)

    def with_light_preset(self, preset_name: str) -> ViewerState:
        """Return a copy with the lights of a preset."""
        return self.with_lights(load_lights(preset_name, self.scene.head), preset_name)

    def with_light(self, light_index: int, **fields: object) -> ViewerState:
        """Return a copy with new values of some fields of one light."""
        lights = list(self.scene.lights)
        lights[light_index] = validated_copy(lights[light_index], **fields)
        return self.with_lights(lights)

    def with_environment(self, environment: Environment | None) -> ViewerState:
        """Return a copy with another environment; None removes the environment."""
        return self._with_scene(environment=environment)

    def with_view(self, view_name: str) -> ViewerState:
        """Return a copy that shows another view, one of `views.VIEW_NAMES`."""
        return replace(self, view=view_name)

    def with_atlas_view(self, atlas_view: AtlasView) -> ViewerState:
        """Return a copy that shows another part of the atlas."""
        return replace(self, atlas_view=atlas_view)

    def with_pose(self, pose: Pose | None) -> ViewerState:
        """Return a copy with another pose, where None means the rest pose."""
        return self._with_scene(pose=pose)

    def with_motion(self, clip: Clip, time_in_motion_s: float) -> ViewerState:
        """Return a copy posed by a motion; morph targets and bones not in the motion keep their values.

        time_in_motion_s : time in the motion [s]

        Raises DermisError if a frame cannot be read.
        """
        pose = merge_poses(clip.pose_at(time_in_motion_s), self.scene.pose)
        return replace(self.with_pose(pose), seconds=time_in_motion_s)

    def with_skin_state(self, state_name: str, weight: float) -> ViewerState:
        """Return a copy with another weight of a state of the skin, such as "blush"."""
        state = self.scene.state
        weights = {**(state.weights if state else {}), state_name: weight}
        present = {name: value for name, value in weights.items() if value > 0.0}
        blood = state.blood if state else None
        return self._with_scene(state=SkinState(present, blood) if present or blood is not None else None)

    def with_pulse(self, pulse: Pulse, seconds: float) -> ViewerState:
        """Return a copy with the blood volume and the head rotation of a pulse at a time [s]."""
        return replace(self, scene=pulse.scene_at(self.scene, seconds))

    def with_head(self, head: Head, head_table: Table, rho_s: float) -> ViewerState:
        """Return a copy with another head, or with other maps for the same head.

        States of the skin are removed if the skin of the new head is not painted from pigments.

        head_table : table from which the head was loaded, with the keys of the [head] table of a scene file
        rho_s : mean specular strength [-]
        """
        skin = validated_copy(self.scene.skin, rho_s=rho_s)
        state = self.scene.state if is_living_head(head, skin.albedo) else None
        return replace(self._with_scene(head=head, skin=skin, state=state), head=head_table)

    def _with_scene(self, **fields: Any) -> ViewerState:
        return replace(self, scene=replace(self.scene, **fields))


def states_equal(first_state: ViewerState, second_state: ViewerState) -> bool:
    """Return whether two states are equal; heads only count as equal if they are the same object."""

    def compared_values(state: ViewerState) -> tuple[object, ...]:
        scene = state.scene
        skin_state = scene.state and (dict(scene.state.weights), str(scene.state.blood))
        scene_values = tuple(scene.lights), scene.camera, scene.skin, skin_state, scene.environment
        view_values = state.view, state.light_preset, state.atlas_view, state.seconds
        return *scene_values, state.settings, state.head_table, *view_values

    is_head_same = first_state.scene.head is second_state.scene.head and poses_equal(
        first_state.scene.pose, second_state.scene.pose
    )
    return is_head_same and compared_values(first_state) == compared_values(second_state)


def validated_copy(model: P, /, **fields: object) -> P:
    """Return a copy of a pydantic model with new values of some fields, validated."""
    return type(model)(**(model.model_dump() | fields))


def save_state(path: Path, state: ViewerState) -> None:
    """Write a state as a scene file that `dermis render` and `dermis view` can open.

    The file does not store which intermediate result, such as irradiance or normals, the viewer displays.

    Raises DermisError if the head was created in memory, or if the file cannot be written.
    """
    if not state.head:
        refuse(path, "a head from a file or a sample", "it was created in memory", "Write it to a file first")
    parts = state.view if state.view in LIGHT_COMPONENT_VIEWS else state.settings.parts
    save_scene(path, state.scene, validated_copy(state.settings, parts=parts), state.head_table)


def _load_state_by_name(name_or_path: str) -> ViewerState:
    """Return the state of a scene file, or of a built-in head, a sample or a mesh file in studio light."""
    if Path(name_or_path).suffix.lower() == ".toml":
        return load_state(Path(name_or_path))
    path = str(Path(name_or_path).resolve()) if Path(name_or_path).is_file() else name_or_path
    return ViewerState(Scene(load_head(name_or_path)), Settings(**PHOTOGRAPHIC_SETTINGS), {"name": path})


def make_state(subject: Head | Human | Scene | ViewerState | str | os.PathLike[str]) -> ViewerState:
    """Return the initial state of a viewer for a head, person or scene.

    subject : head, person or scene, or its name or file; a viewer state is returned unchanged

    Raises DermisError for a subject of another type, and if a named subject cannot be loaded.
    """
    if isinstance(subject, ViewerState):
        return subject
    settings = Settings(**PHOTOGRAPHIC_SETTINGS)
    if isinstance(subject, Human):
        return ViewerState(Scene(subject.head(), skin=skin_of(subject)), settings)
    if isinstance(subject, Head):
        return ViewerState(Scene(subject), settings)
    if isinstance(subject, Scene):
        return ViewerState(subject, settings, light_preset="")
    if not isinstance(subject, str | os.PathLike):
        actual = f"got a {type(subject).__name__}"
        refuse("view", "a head, a person, a scene or a name", actual, "Try dermis.Human()")
    return _load_state_by_name(os.fspath(subject))


def load_state(path: Path, current_state: ViewerState | None = None) -> ViewerState:
    """Return the state of a scene file.

    current_state : state whose head is reused if it was loaded from an equal [head] table

    Raises DermisError if the file is not a scene.
    """
    table = head_table(path)
    same_table = current_state is not None and table in (current_state.head, current_state.head_table)
    known_head = (
        current_state.scene.head if current_state and same_table and not has_region_table(table) else None
    )
    scene, scene_settings = load_scene(path, known_head)
    settings = Settings(**{**PHOTOGRAPHIC_SETTINGS, **scene_settings.model_dump(exclude_unset=True)})
    return initial_state(scene, settings, table, preset_name="" if scene.lights else NO_LIGHTS)


def initial_state(scene: Scene, settings: Settings, head_table: Table, preset_name: str) -> ViewerState:
    """Return the initial state of a scene.

    If `settings.parts` selects only the diffuse or only the specular light, the initial view shows only this
    light.

    head_table : table from which the head was loaded, with the keys of the [head] table of a scene file
    preset_name : name of the light preset; empty for custom lights
    """
    view = settings.parts if settings.parts in LIGHT_COMPONENT_VIEWS else PICTURE_VIEW_NAME
    return ViewerState(scene, validated_copy(settings, parts="all"), head_table, view, preset_name)


_MAX_UNDO_STEPS = 200


class UndoHistory:
    """Undo history of viewer states.

    A gesture, such as a drag, changes the state many times; all these changes are undone in one step.
    """

    def __init__(self, state: ViewerState) -> None:
        self._past = [state]
        self._undone: list[ViewerState] = []
        self._gesture = ""

    @property
    def state(self) -> ViewerState:
        """Return the current state."""
        return self._past[-1]

    @property
    def states(self) -> list[ViewerState]:
        """Return all stored states, including the states that were undone."""
        return [*self._past, *self._undone]

    @property
    def can_undo(self) -> bool:
        """Return whether there is a state before the current state."""
        return len(self._past) > 1

    @property
    def can_redo(self) -> bool:
        """Return whether there is an undone state that can be restored."""
        return bool(self._undone)

    def change(self, state: ViewerState, gesture_name: str = "") -> None:
        """Add a state; within one gesture, the new state replaces the last state.

        gesture_name : name of the gesture; empty for a change that is undone separately
        """
        if states_equal(state, self.state):
            return
        if gesture_name and gesture_name == self._gesture:
            self._past[-1] = state
        else:
            self._past.append(state)
            del self._past[: -_MAX_UNDO_STEPS - 1]
        self._gesture = gesture_name
        self._undone.clear()

    def end_gesture(self) -> None:
        """End the gesture, so that the next change becomes a separate step of the undo history."""
        self._gesture = ""

    def undo(self) -> None:
        """Return to the previous state."""
        self.end_gesture()
        if self.can_undo:
            self._undone.append(self._past.pop())

    def redo(self) -> None:
        """Restore the state that was undone last."""
        self.end_gesture()
        if self._undone:
            self._past.append(self._undone.pop())
