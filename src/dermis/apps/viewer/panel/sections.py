"""Sections of the panel: light, movement, skin and the rest, in order."""

from __future__ import annotations

import colorsys
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from imgui_bundle import imgui, implot
from numpy.typing import NDArray

from dermis.apps.viewer.controls import CAMERAS
from dermis.apps.viewer.panel.fields import (
    LIGHT,
    LIGHT_KINDS,
    SURFACE,
    TECHNIQUE,
    Style,
    attempt,
    begin_plot,
    button,
    choose,
    clamped,
    combo,
    draw_fields,
    draw_rows,
    explain,
    hold,
    record_position,
    slider,
)
from dermis.apps.viewer.panel.skin import draw_profile, draw_surface
from dermis.apps.viewer.posing import angles_of, at_rest, matching, weight_of, with_angles, with_weight
from dermis.apps.viewer.session import Session, built_in
from dermis.apps.viewer.state import ATLAS, ViewerState, changed
from dermis.apps.viewer.views import LAYERS, VIEWS
from dermis.formats.samples import SAMPLES
from dermis.scene.environment import Environment
from dermis.scene.heads import HUMAN
from dermis.scene.lights import LIGHTS, Light, SpotLight, light_presets
from dermis.scene.plain import Range, choices_of, fields_under
from dermis.scene.talk import COMPARISONS

_CUSTOM = "custom"
_NO_ENVIRONMENT = "none"
_STOPS = Range(-6.0, 4.0)
_PLACE = (-500.0, 400.0, 800.0)  # of a new light, from the upper left of the portrait [mm]
_FADE = 0.5  # least width over which a cone fades [degrees]
_ENVIRONMENT = {"exposure": Style("brightness")}
_WEIGHTS, _TURNS = Range(0.0, 1.0), Range(-60.0, 60.0)
_LONG_NAME = 16  # letters beyond which the panel may be too narrow for it
Floats = NDArray[np.float64]
_TOTAL = "total"
_GOLDEN = 0.618034  # of the circle of hues between two stages, so that neighbours never look alike
_SEEDS = 10_000
_ENTERED = int(imgui.InputTextFlags_.enter_returns_true)
_BUTTONS_PER_ROW = 3
_SIDES = (256, 512, 1024, 2048, 4096)
_SETTINGS = {
    **TECHNIQUE,
    "atlas": Style(options=_SIDES),
    "shadow_size": Style("shadow map", options=_SIDES),
    "samples": Style(options=(1, 2, 4, 8, 16)),
    "exposure": Style(own=lambda session: session.studio.exposure),
    "background": Style(own=lambda session: (0.2, 0.2, 0.2)),
}
_PICTURE = ("exposure", "tone", "bloom", "background", "background_blur")
_NOWHERE = ("size", "parts")  # the window's, and a view


def draw_lights(session: Session) -> None:
    """The rig, the light that Shift and drag moves, and the environment."""
    combo(session, "rig", session.state.rig or _CUSTOM, light_presets(), session.state.with_rig)
    _select(session)
    combo(session, "add", "a light", LIGHTS, lambda kind: _added(session, kind), LIGHT_KINDS)
    lights, index = session.state.scene.lights, session.controls.light
    if index < len(lights):
        _light(session, index, lights[index])
    _environment(session)


def _added(session: Session, kind: str) -> ViewerState:
    """The state with a light of that kind more, which is selected."""
    places = {"position": _PLACE, "direction": tuple(-one for one in _PLACE)}
    required = {name for name, field in LIGHTS[kind].model_fields.items() if field.is_required()}
    told: dict[str, Any] = {name: place for name, place in places.items() if name in required}
    lights = session.state.scene.lights
    made = session.state.with_lights([*lights, LIGHTS[kind](**told)])
    session.controls.light = len(lights)
    return made


def _select(session: Session) -> None:
    """One radio button for each light and one for the environment."""
    lights, controls = session.state.scene.lights, session.controls
    for index, light in enumerate(lights):
        if imgui.radio_button(f"{index + 1}##{light.kind}", controls.light == index):
            controls.light = index
        imgui.same_line()
    if imgui.radio_button("environment##selected", controls.light >= len(lights)):
        controls.light = len(lights)


def _light(session: Session, index: int, light: Light) -> None:
    """The fields of a light; its place is changed by Shift and drag."""
    strength = max(*light.irradiance, 1e-6)

    def apply(**fields: object) -> ViewerState:
        return session.state.with_light(index, **fields)

    def scale(stops: float) -> ViewerState:
        factor = 2.0**stops * math.pi / strength
        return apply(irradiance=tuple(factor * c for c in light.irradiance))

    imgui.text_disabled(f"{LIGHT_KINDS.get(light.kind, light.kind)}, Shift and drag to move")
    slider(session, "strength", math.log2(strength / math.pi), scale, _STOPS, "%.2f stops")
    draw_fields(session, light, apply, LIGHT | _cone(light))
    if button(session, "copy"):  # refused when there are too many
        lights = session.state.scene.lights
        attempt(session, lambda: session.change(session.state.with_lights([*lights, light])))
        session.controls.light = len(lights)
    imgui.same_line()
    if button(session, "remove"):
        rest = [one for k, one in enumerate(session.state.scene.lights) if k != index]
        session.change(session.state.with_lights(rest))
        session.controls.light = max(0, index - 1)


def _cone(light: Light) -> dict[str, Style]:
    """Ranges of a spot's cone, whose outer angle is wider than its inner one."""
    if not isinstance(light, SpotLight):
        return {}
    inner, outer = Range(0.5, light.outer_degrees - _FADE), Range(light.inner_degrees + _FADE, 88.0)
    return {"inner_degrees": Style("inner cone", inner), "outer_degrees": Style("outer cone", outer)}


def _environment(session: Session) -> None:
    now, with_environment = session.state.scene.environment, session.state.with_environment
    samples = [name for name, sample in SAMPLES.items() if sample.kind == "environment"]

    def take(name: str) -> ViewerState:
        return with_environment(None if name == _NO_ENVIRONMENT else Environment(name=name))

    names = (_NO_ENVIRONMENT, "uniform", *samples)
    combo(session, "environment", now.name if now else _NO_ENVIRONMENT, names, take)
    if now:
        draw_fields(session, now, lambda **fields: with_environment(changed(now, **fields)), _ENVIRONMENT)


def has_expressions(session: Session) -> bool:
    """Return whether the head has morph targets or bones."""
    head = session.state.scene.head
    return bool(head.targets or head.bones)


def can_move(session: Session) -> bool:
    """Return whether there is a motion, or a head that one can move."""
    return has_expressions(session) or session.player.has_motion


def draw_expressions(session: Session) -> None:
    """Sliders of the morph targets whose names hold what is searched for, and of the bones."""
    head = session.state.scene.head
    cleared = int(imgui.InputTextFlags_.escape_clears_all)
    _, session.search = imgui.input_text_with_hint("##search", "search", session.search, cleared)
    record_position(session, "search")
    imgui.same_line()
    if button(session, "rest"):
        session.player.stop()
        session.change(session.state.with_pose(at_rest(session.state.scene)))
    targets, bones = matching(head.targets, session.search), matching(head.bones, session.search)
    moved = _moved(session)
    if targets:
        draw_rows("targets", len(targets), lambda row: _weight(session, targets[row], moved))
    if not (targets or bones):
        imgui.text_disabled("there is no such name")
    if bones:
        is_open = imgui.tree_node_ex("bones", 0, f"bones, {len(bones)}")
        record_position(session, "bones")
        if is_open:
            imgui.text_disabled("nod, turn, tilt [degrees]")
            draw_rows("turns", len(bones), lambda row: _angles(session, bones[row], moved))
            imgui.tree_pop()


def draw_motion(session: Session) -> None:
    """The motion's file, play and pause, and its time."""
    player, clip = session.player, session.player.clip
    _, session.motion_file = imgui.input_text("file", session.motion_file)
    if button(session, "open"):
        attempt(session, lambda: session.open_motion(session.motion_file))
    if clip is not None:
        imgui.same_line()
        if button(session, f"{'pause' if player.is_playing else 'play'}##motion"):
            player.toggle()
        imgui.same_line()
        _, player.loops = imgui.checkbox("loop", player.loops)
        record_position(session, "loop")
        span = Range(0.0, max(clip.duration_s, 1e-3))
        slider(session, "time", player.seconds, player.scrubbed, span, f"%.2f of {clip.duration_s:.2f} s")
    if player.note:
        imgui.text_wrapped(player.note)


def _moved(session: Session) -> frozenset[str]:
    """Names that the motion moves at present: their sliders only show it."""
    clip = session.player.clip if session.player.is_playing else None
    return frozenset() if clip is None else frozenset((*clip.targets, *clip.bones))


def _weight(session: Session, name: str, moved: frozenset[str]) -> None:
    def put(weight: float) -> ViewerState:
        return session.state.with_pose(with_weight(session.state.scene, name, weight))

    imgui.begin_disabled(name in moved)
    slider(session, f"{name}##target", weight_of(session.shown.scene, name), put, _WEIGHTS, "%.2f")
    imgui.end_disabled()
    if len(name) > _LONG_NAME:
        explain(name)


def _angles(session: Session, name: str, moved: frozenset[str]) -> None:
    """Three sliders; only the one that is moved changes, however far the others are turned."""
    now = angles_of(session.shown.scene, name)

    def put(found: list[float]) -> ViewerState:
        turned = max(range(3), key=lambda k: abs(found[k] - now[k]))
        degrees = [*now]
        degrees[turned] = clamped(found[turned], _TURNS)
        x, y, z = degrees
        return session.state.with_pose(with_angles(session.state.scene, name, (x, y, z)))

    imgui.begin_disabled(name in moved)
    result = imgui.slider_float3(f"{name}##bone", [*now], _TURNS.low, _TURNS.high, "%.0f")
    imgui.end_disabled()
    hold(session, f"{name}##bone", result, put)
    if len(name) > _LONG_NAME:
        explain(name)


def draw_head(session: Session) -> None:
    """Which head is shown, a person drawn by a number, and a file."""
    _choice(session)
    seed = _seed_of(session)
    told, number = imgui.input_int("person###seed", seed, flags=_ENTERED)
    record_position(session, "seed")
    explain("A person by a number, the same one each time; Enter draws it.")
    if told:
        session.heads.open(f"{HUMAN}:{max(0, number)}")
    imgui.same_line()
    if button(session, "dice"):
        session.heads.open(f"{HUMAN}:{random.randrange(_SEEDS)}")
    explain("A person by chance.")
    if session.ask_for_file is None:
        entered, session.head_file = imgui.input_text_with_hint(
            "###path", "path of a file", session.head_file, _ENTERED
        )
        record_position(session, "path")
        explain("A mesh (.glb .gltf .obj .ply), a person (.json) or a scene (.toml).")
        imgui.same_line()
        if button(session, "open###open file") or entered:
            session.heads.open(session.head_file)
    elif button(session, "upload a file"):
        session.ask_for_file()


def _choice(session: Session) -> None:
    """The heads of the package and recent files."""
    now = str(session.state.head.get("name", session.state.scene.head.name))
    names = dict.fromkeys((*built_in(), *session.heads.recent, now))
    chosen = choose(session, "head", now, names, {name: session.heads.called(name) for name in names})
    if chosen is not None:
        session.heads.open(chosen)


def _seed_of(session: Session) -> int:
    """Return the seed of the person shown, 0 for another head."""
    word = str(session.state.head.get("name", "")).removeprefix(f"{HUMAN}:")
    return int(word) if word.isdecimal() else 0


class Section(NamedTuple):
    """A part of the panel that can be opened and closed.

    applies : whether there is what it is about; it is left out otherwise
    """

    title: str
    draw: Callable[[Session], None]
    is_open: bool = False
    applies: Callable[[Session], bool] = lambda session: True


def draw_view(session: Session) -> None:
    """The view and the camera presets."""
    state = session.state
    combo(session, "show", state.view, VIEWS, state.in_view)
    if state.view == ATLAS:
        layers = {name: replace(state.chart, layer=name) for name in LAYERS}
        combo(session, "layer", state.chart.layer, layers, lambda name: state.with_chart(layers[name]))
        imgui.text_disabled("wheel: zoom; double click: show all")
    for index, name in enumerate(CAMERAS):
        if index % _BUTTONS_PER_ROW:
            imgui.same_line()
        if button(session, f"{name}##camera"):
            session.controls.look(name)


def draw_comparison(session: Session) -> None:
    """Freeze the state for the left side of the divider, swap the sides, release it."""
    split, state = session.split, session.state
    if button(session, "freeze"):
        split.freeze(session.shown)
    if split.before is None:
        return
    imgui.same_line()
    if button(session, "swap"):
        shown = session.shown
        session.player.stop()
        session.change(split.before.with_camera(state.scene.camera))
        split.freeze(shown)
    imgui.same_line()
    if button(session, "release"):
        split.release()


def draw_technique(session: Session) -> None:
    """All settings that no other section has, choices first: a new one appears here."""
    settings = session.state.settings
    kind, left_out = type(settings), {*_PICTURE, *_NOWHERE}
    names = sorted(
        (name for name in fields_under("", kind) if name not in left_out),
        key=lambda name: not choices_of(kind, name),
    )
    draw_fields(session, settings, session.state.with_settings, _SETTINGS, names)


def draw_picture(session: Session) -> None:
    """How linear light becomes the picture."""
    draw_fields(session, session.state.settings, session.state.with_settings, _SETTINGS, _PICTURE)


def draw_talk(session: Session) -> None:
    """Draw the comparisons of the talk of 2007: fields of the skin and of the settings."""
    state, skin, settings = session.state, session.state.scene.skin, session.state.settings
    draw_fields(session, skin, state.with_skin, SURFACE, fields_under(COMPARISONS, type(skin)))
    names = fields_under(COMPARISONS, type(settings))
    if settings.seams != "clear-colour":
        names.remove("seam_colour")
    draw_fields(session, settings, state.with_settings, _SETTINGS, names)


def draw_files(session: Session) -> None:
    """Draw the scene file, and screenshots of any size, by default that of the view."""
    _, session.scene_file = imgui.input_text("scene", session.scene_file)
    if button(session, "save"):
        attempt(session, lambda: session.save(Path(session.scene_file)))
    imgui.same_line()
    if button(session, "load"):
        attempt(session, lambda: session.load(Path(session.scene_file)))
    _, session.picture_file = imgui.input_text("picture", session.picture_file)
    size = session.picture_size if any(session.picture_size) else session.view_size
    told, sides = imgui.input_int2("size", list(size))
    record_position(session, "size")
    if told:
        session.picture_size = max(1, sides[0]), max(1, sides[1])
    if button(session, "screenshot"):
        attempt(session, lambda: session.screenshot(Path(session.picture_file), size))
    if any(session.picture_size):
        imgui.same_line()
        if button(session, "size of the view"):
            session.picture_size = 0, 0


def draw_timing(session: Session) -> None:
    """Plot the stages' times of the last frames, and list those of the last one."""
    series = stage_series(list(session.studio.times))
    if not series:
        imgui.text_disabled("this adapter reports no times")
        return
    total = np.sum(list(series.values()), axis=0)
    colours = [colorsys.hls_to_rgb((_GOLDEN * k) % 1.0, 0.6, 0.5) for k in range(len(series))]
    _plot_stacked(series, colours, total)
    for (name, values), colour in zip(series.items(), colours, strict=True):
        imgui.text_colored(imgui.ImVec4(*colour, 1.0), f"{values[-1]:8.2f} ms")
        imgui.same_line()
        imgui.text(f"{name}, mean {values.mean():.2f}")
    imgui.text(f"{total[-1]:8.2f} ms in total, mean of {len(total)} frames {total.mean():.2f}")


def stage_series(frames: Sequence[dict[str, float]]) -> dict[str, Floats]:
    """(n,) times of each stage over n frames, 0 in frames without it [ms]."""
    names = dict.fromkeys(name for frame in frames for name in frame if name != _TOTAL)
    return {name: np.array([frame.get(name, 0.0) for frame in frames], np.float64) for name in names}


def _plot_stacked(
    series: dict[str, Floats], colours: Sequence[tuple[float, float, float]], total: Floats
) -> None:
    """Areas stacked on one another, the last frame at the right edge."""
    last = max(1.0, len(total) - 1.0)
    if not begin_plot("stages", ("frames", "ms"), (0.0, last), max(float(total.max()), 1e-3)):
        return
    x, below = np.arange(len(total), dtype=np.float64), np.zeros(len(total))
    for (name, values), colour in zip(series.items(), colours, strict=True):
        spec = implot.Spec()
        spec.fill_color = imgui.ImVec4(*colour, 1.0)
        implot.plot_shaded(name, x, below, below + values, spec)
        below = below + values
    implot.end_plot()


SECTIONS = (
    Section("Head", draw_head, is_open=True),
    Section("View", draw_view, is_open=True),
    Section("Before and after", draw_comparison),
    Section("Expressions", draw_expressions, is_open=True, applies=has_expressions),
    Section("Motion", draw_motion, is_open=True, applies=can_move),
    Section("Profile", draw_profile, is_open=True),
    Section("Surface", draw_surface, is_open=True),
    Section("Light", draw_lights),
    Section("Technique", draw_technique),
    Section("Picture", draw_picture),
    Section("Timing", draw_timing),
    Section("Scene", draw_files, is_open=True),
    Section(COMPARISONS, draw_talk),
)
