"""What the viewer shows, as plain data: every change makes a new state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from dermis.errors import refuse
from dermis.mesh.head import Head
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.files import NO_LIGHTS, head_table, load_lights, load_scene
from dermis.scene.heads import load_head
from dermis.scene.lights import Light
from dermis.scene.model import Scene
from dermis.scene.plain import Plain
from dermis.scene.saving import save_scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments
from dermis.viewer.chart import Chart

P = TypeVar("P", bound=Plain)
PICTURE = "picture"
PARTS = {"diffuse": "diffuse", "specular": "specular"}
"""Views that are the picture with some of its light, as `Settings.parts` names it."""


@dataclass(frozen=True, eq=False)
class ViewerState:
    """A scene, how it is rendered, and what of it is looked at.

    settings : `size` is of no account, the window has its own
    head : the [head] table that the head came from
    view : one of `views.VIEWS`: the picture, or something on the way to it
    rig : the lights' preset, empty when they are no preset's
    chart : the part of the atlas that the view "atlas" shows
    """

    scene: Scene
    settings: Settings = field(default_factory=Settings)
    head: Mapping[str, Any] = field(default_factory=dict)
    view: str = PICTURE
    rig: str = "studio"
    chart: Chart = field(default_factory=Chart)

    def with_skin(self, **fields: Any) -> ViewerState:
        """With other values of the skin; impossible ones raise DermisError."""
        return self._with_scene(skin=changed(self.scene.skin, **fields))

    def with_pigments(self, **fields: Any) -> ViewerState:
        """With other pigments of the skin."""
        pigments = self.scene.skin.pigments or Pigments()
        return self.with_skin(pigments=changed(pigments, **fields).model_dump())

    def with_settings(self, **fields: Any) -> ViewerState:
        """With other settings."""
        return replace(self, settings=changed(self.settings, **fields))

    def with_camera(self, camera: Camera) -> ViewerState:
        """From another place."""
        return self._with_scene(camera=camera)

    def with_lights(self, lights: Sequence[Light], rig: str = "") -> ViewerState:
        """In the light of others."""
        return replace(self._with_scene(lights=tuple(lights)), rig=rig)

    def with_rig(self, name: str) -> ViewerState:
        """In the light of a preset."""
        return self.with_lights(load_lights(name), name)

    def with_light(self, index: int, **fields: Any) -> ViewerState:
        """With other values of one light."""
        lights = list(self.scene.lights)
        lights[index] = changed(lights[index], **fields)
        return self.with_lights(lights)

    def with_environment(self, environment: Environment | None) -> ViewerState:
        """With other light from all around, or none."""
        return self._with_scene(environment=environment)

    def in_view(self, name: str) -> ViewerState:
        """Looking at something else."""
        return replace(self, view=name)

    def with_chart(self, chart: Chart) -> ViewerState:
        """Looking at another part of the atlas."""
        return replace(self, chart=chart)

    def with_head(self, head: Head, table: Mapping[str, Any], rho_s: float) -> ViewerState:
        """With another head, or other maps of it.

        table : the [head] table that it came from
        rho_s : its skin's mean strength of reflection [-]
        """
        skin = changed(self.scene.skin, rho_s=rho_s)
        return replace(self._with_scene(head=head, skin=skin), head=table)

    def _with_scene(self, **fields: Any) -> ViewerState:
        return replace(self, scene=replace(self.scene, **fields))


def same(a: ViewerState, b: ViewerState) -> bool:
    """Whether two states are alike; heads are compared by identity, without touching their arrays."""

    def rest(state: ViewerState) -> tuple[Any, ...]:
        scene = state.scene
        seen = tuple(scene.lights), scene.camera, scene.skin, scene.environment
        return (*seen, state.settings, state.head, state.view, state.rig, state.chart)

    return a.scene.head is b.scene.head and rest(a) == rest(b)


def changed(values: P, **fields: Any) -> P:
    """A copy with other values, checked."""
    return type(values)(**(values.model_dump() | fields))


def save_state(path: Path, state: ViewerState) -> None:
    """Write the scene that `dermis render` and `dermis view` take; views of what is no light are left out.

    Raises DermisError when that is not possible.
    """
    if not state.head:
        refuse(path, "a head from a file or a sample", "it was made in memory", "Write it to a file first")
    parts = state.view if state.view in PARTS else state.settings.parts
    save_scene(path, state.scene, changed(state.settings, parts=parts), state.head)


def named_state(name: str) -> ViewerState:
    """The built-in bust, a sample or a mesh file in the studio's light, or the scene of a TOML file.

    Raises DermisError for what is none of these.
    """
    if Path(name).suffix.lower() == ".toml":
        return load_state(Path(name))
    place = str(Path(name).resolve()) if Path(name).is_file() else name
    return ViewerState(Scene(load_head(name)), head={"name": place})


def load_state(path: Path, before: ViewerState | None = None) -> ViewerState:
    """The state that a scene's file describes; a head that is the same as before is not loaded again.

    Raises DermisError for a file that is no scene.
    """
    table = head_table(path)
    known = before.scene.head if before and before.head == table and "regions" not in table else None
    scene, settings = load_scene(path, known)
    return opened(scene, settings, table, rig="" if scene.lights else NO_LIGHTS)


def opened(scene: Scene, settings: Settings, head: Mapping[str, Any], rig: str) -> ViewerState:
    """A scene as the viewer shows it first: the part of the light that its settings choose is a view."""
    view = settings.parts if settings.parts in PARTS else PICTURE
    return ViewerState(scene, changed(settings, parts="all"), head, view, rig)
