"""State of the viewer as immutable data, and its undo history: every change makes a new state."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from dermis.apps.viewer.posing import same_pose
from dermis.base.errors import refuse
from dermis.human.person import Human
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose, laid_over
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.files import head_table, load_lights, load_scene
from dermis.scene.head_table import names_regions
from dermis.scene.heads import load_head
from dermis.scene.lights import NO_LIGHTS, Light
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.plain import Plain
from dermis.scene.saving import save_scene
from dermis.scene.settings import PHOTOGRAPHED, Settings
from dermis.scene.skin import Pigments

ATLAS = "atlas"
"""Name of the view of the atlas as a flat picture."""
_LEAST_SPAN, _MOST_SPAN = 2.0**-10, 2.0


@dataclass(frozen=True)
class Chart:
    """The part of the atlas that fills the picture.

    layer : one of `views.LAYERS`
    centre : uv at the middle of the picture, u to the right and v down [-]
    span : extent of the picture's shorter side, in sides of the atlas [-]
    """

    layer: str = "irradiance"
    centre: tuple[float, float] = (0.5, 0.5)
    span: float = 1.05

    def panned(self, right: float, down: float) -> Chart:
        """Drag the atlas, in fractions of the picture's shorter side."""
        u, v = self.centre
        return self._at(u - self.span * right, v - self.span * down)

    def zoomed(self, factor: float, x: float, y: float) -> Chart:
        """Zoom in (factor below 1) or out, keeping the point under the cursor fixed.

        x, y : of the cursor from the picture's middle, right and down, in fractions of its shorter side
        """
        span = min(_MOST_SPAN, max(_LEAST_SPAN, factor * self.span))
        (u, v), shrunk = self.centre, self.span - span
        return replace(self, span=span)._at(u + shrunk * x, v + shrunk * y)

    def _at(self, u: float, v: float) -> Chart:
        return replace(self, centre=(min(1.0, max(0.0, u)), min(1.0, max(0.0, v))))


P = TypeVar("P", bound=Plain)
Table = Mapping[str, Any]
"""The [head] table of a scene file."""
PICTURE = "picture"
PARTS = {"diffuse": "diffuse", "specular": "specular"}
"""Views that are the picture with part of its light, by the value of `Settings.parts`."""


@dataclass(frozen=True, eq=False)
class ViewerState:
    """A scene, how it is rendered, and which view of it is shown.

    settings : `size` is ignored: the window has its own
    head : the [head] table that the head was loaded from
    view : one of `views.VIEWS`: the picture or an intermediate result
    rig : the lights' preset, empty for custom lights
    chart : the part of the atlas that the view "atlas" shows
    seconds : where in the motion the pose is [s]
    """

    scene: Scene
    settings: Settings = field(default_factory=Settings)
    head: Table = field(default_factory=dict)
    view: str = PICTURE
    rig: str = "studio"
    chart: Chart = field(default_factory=Chart)
    seconds: float = 0.0

    @property
    def table(self) -> Table:
        """The [head] table with the levels of subdivision that were found; empty for one made in memory."""
        return self.head and {"subdivide": self.scene.head.levels, **self.head}

    def with_skin(self, **fields: object) -> ViewerState:
        """Change fields of the skin.

        Raises DermisError for impossible values.
        """
        return self._with_scene(skin=changed(self.scene.skin, **fields))

    def with_pigments(self, **fields: object) -> ViewerState:
        """Change pigments of the skin."""
        pigments = self.scene.skin.pigments or Pigments()
        return self.with_skin(pigments=changed(pigments, **fields).model_dump())

    def with_settings(self, **fields: object) -> ViewerState:
        """Change settings."""
        return replace(self, settings=changed(self.settings, **fields))

    def with_camera(self, camera: Camera) -> ViewerState:
        """Replace the camera."""
        return self._with_scene(camera=camera)

    def with_lights(self, lights: Sequence[Light], rig: str = "") -> ViewerState:
        """Replace the lights."""
        return replace(self._with_scene(lights=tuple(lights)), rig=rig)

    def with_rig(self, name: str) -> ViewerState:
        """Replace the lights by a preset."""
        return self.with_lights(load_lights(name), name)

    def with_light(self, index: int, **fields: object) -> ViewerState:
        """Change fields of one light."""
        lights = list(self.scene.lights)
        lights[index] = changed(lights[index], **fields)
        return self.with_lights(lights)

    def with_environment(self, environment: Environment | None) -> ViewerState:
        """Replace the environment."""
        return self._with_scene(environment=environment)

    def in_view(self, name: str) -> ViewerState:
        """Switch to another view."""
        return replace(self, view=name)

    def with_chart(self, chart: Chart) -> ViewerState:
        """Show another part of the atlas."""
        return replace(self, chart=chart)

    def with_pose(self, pose: Pose | None) -> ViewerState:
        """Replace the pose; None for at rest."""
        return self._with_scene(pose=pose)

    def at(self, clip: Clip, seconds: float) -> ViewerState:
        """Take the pose that a motion has at a time [s]; what it does not move stays.

        Raises DermisError for a frame that cannot be read.
        """
        pose = laid_over(clip.pose_at(seconds), self.scene.pose)
        return replace(self.with_pose(pose), seconds=seconds)

    def with_head(self, head: Head, table: Table, rho_s: float) -> ViewerState:
        """Replace the head or its maps.

        table : the [head] table that it was loaded from
        rho_s : mean strength of the surface reflection [-]
        """
        skin = changed(self.scene.skin, rho_s=rho_s)
        return replace(self._with_scene(head=head, skin=skin), head=table)

    def _with_scene(self, **fields: Any) -> ViewerState:
        return replace(self, scene=replace(self.scene, **fields))


def same(a: ViewerState, b: ViewerState) -> bool:
    """Return whether two states are equal; heads are compared by identity, not by their arrays."""

    def rest(state: ViewerState) -> tuple[object, ...]:
        scene = state.scene
        seen = tuple(scene.lights), scene.camera, scene.skin, scene.environment
        return (*seen, state.settings, state.table, state.view, state.rig, state.chart, state.seconds)

    one, other = a.scene, b.scene
    return one.head is other.head and same_pose(one.pose, other.pose) and rest(a) == rest(b)


def changed(values: P, **fields: object) -> P:
    """Return a validated copy with other values."""
    return type(values)(**(values.model_dump() | fields))


def save_state(path: Path, state: ViewerState) -> None:
    """Write the scene file that `dermis render` and `dermis view` take; views of intermediates are not saved.

    Raises DermisError for a head made in memory and for a path that cannot be written.
    """
    if not state.head:
        refuse(path, "a head from a file or a sample", "it was made in memory", "Write it to a file first")
    parts = state.view if state.view in PARTS else state.settings.parts
    save_scene(path, state.scene, changed(state.settings, parts=parts), state.table)


def _named_state(name: str) -> ViewerState:
    """Return a built-in head, a sample or a mesh file in studio light, or the scene of a TOML file."""
    if Path(name).suffix.lower() == ".toml":
        return load_state(Path(name))
    path = str(Path(name).resolve()) if Path(name).is_file() else name
    return ViewerState(Scene(load_head(name)), Settings(**PHOTOGRAPHED), {"name": path})


def state_of(shown: Head | Human | Scene | ViewerState | str | os.PathLike[str]) -> ViewerState:
    """Return the first state of a viewer: a head or a person in studio light, a scene, or one by name.

    Raises DermisError for anything else.
    """
    if isinstance(shown, ViewerState):
        return shown
    if isinstance(shown, Human):
        return ViewerState(Scene(shown.head(), skin=skin_of(shown)), Settings(**PHOTOGRAPHED))
    if isinstance(shown, Head):
        return ViewerState(Scene(shown), Settings(**PHOTOGRAPHED))
    if isinstance(shown, Scene):
        return ViewerState(shown, Settings(**PHOTOGRAPHED), rig="")
    if not isinstance(shown, str | os.PathLike):
        came = f"a {type(shown).__name__} came"
        refuse("view", "a head, a person, a scene or a name", came, "Try dermis.Human()")
    return _named_state(os.fspath(shown))


def load_state(path: Path, before: ViewerState | None = None) -> ViewerState:
    """Return the state of a scene file; the head is not loaded again if `before` has the same one.

    Raises DermisError for a file that is not a scene.
    """
    table = head_table(path)
    alike = before is not None and table in (before.head, before.table)
    known = before.scene.head if before and alike and not names_regions(table) else None
    scene, described = load_scene(path, known)
    settings = Settings(**{**PHOTOGRAPHED, **described.model_dump(exclude_unset=True)})
    return opened(scene, settings, table, rig="" if scene.lights else NO_LIGHTS)


def opened(scene: Scene, settings: Settings, head: Table, rig: str) -> ViewerState:
    """Return the first state of a scene: `Settings.parts` becomes the view."""
    view = settings.parts if settings.parts in PARTS else PICTURE
    return ViewerState(scene, changed(settings, parts="all"), head, view, rig)


_MOST_STEPS = 200


class History:
    """Undo history of states.

    A gesture (a drag, a slider held down) changes the state many times and is undone in one step.
    """

    def __init__(self, state: ViewerState) -> None:
        self._past = [state]
        self._undone: list[ViewerState] = []
        self._gesture = ""

    @property
    def state(self) -> ViewerState:
        """The current state."""
        return self._past[-1]

    @property
    def states(self) -> list[ViewerState]:
        """All states, those that were undone included."""
        return [*self._past, *self._undone]

    @property
    def can_undo(self) -> bool:
        """Whether there is an earlier state."""
        return len(self._past) > 1

    @property
    def can_redo(self) -> bool:
        """Whether the last step was an undo."""
        return bool(self._undone)

    def change(self, state: ViewerState, gesture: str = "") -> None:
        """Add a state; during one gesture it replaces the last one."""
        if same(state, self.state):
            return
        if gesture and gesture == self._gesture:
            self._past[-1] = state
        else:
            self._past.append(state)
            del self._past[: -_MOST_STEPS - 1]
        self._gesture = gesture
        self._undone.clear()

    def end_gesture(self) -> None:
        """Make the next change a step of its own."""
        self._gesture = ""

    def undo(self) -> None:
        """Go back one step."""
        self.end_gesture()
        if self.can_undo:
            self._undone.append(self._past.pop())

    def redo(self) -> None:
        """Repeat the step undone last."""
        self.end_gesture()
        if self._undone:
            self._past.append(self._undone.pop())
