"""The sections of the panel, from top to bottom.

To add a section, write a function that draws it and add it to `SECTIONS`.
"""

from __future__ import annotations

import colorsys
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from imgui_bundle import imgui, implot
from numpy.typing import NDArray

from dermis.apps.viewer.controls import CAMERAS
from dermis.apps.viewer.panel.fields import (
    SURFACE,
    TECHNIQUE,
    Style,
    attempt,
    begin_plot,
    button,
    choose,
    combo,
    draw_fields,
    explain,
    record_position,
)
from dermis.apps.viewer.panel.light import draw_lights
from dermis.apps.viewer.panel.movement import can_move, draw_expressions, draw_motion, has_expressions
from dermis.apps.viewer.panel.skin import draw_profile, draw_surface
from dermis.apps.viewer.session import Session, built_in
from dermis.apps.viewer.state import ATLAS
from dermis.apps.viewer.views import LAYERS, VIEWS
from dermis.scene.heads import HUMAN
from dermis.scene.plain import choices_of, fields_under
from dermis.scene.talk import COMPARISONS

Floats = NDArray[np.float64]
_TOTAL = "total"
_GOLDEN = 0.618034  # of the circle of hues between two stages, so that neighbours never look alike
_SEEDS = 10_000
_ENTERED = int(imgui.InputTextFlags_.enter_returns_true)


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
