"""The sections of the panel, from top to bottom.

To add a section, write a function that draws it and add it to `SECTIONS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from imgui_bundle import imgui

from dermis.apps.viewer.chart import ATLAS
from dermis.apps.viewer.controls import CAMERAS
from dermis.apps.viewer.panel.fields import Style, attempt, button, combo, draw_fields, record_position
from dermis.apps.viewer.panel.heads import draw_head
from dermis.apps.viewer.panel.light import draw_lights
from dermis.apps.viewer.panel.movement import can_move, draw_expressions, draw_motion, has_expressions
from dermis.apps.viewer.panel.plots import draw_timing
from dermis.apps.viewer.panel.skin import draw_profile, draw_surface
from dermis.apps.viewer.panel.words import SURFACE, TECHNIQUE
from dermis.apps.viewer.session import Session
from dermis.apps.viewer.views import LAYERS, VIEWS
from dermis.scene.plain import choices_of, fields_under
from dermis.scene.talk import COMPARISONS

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
    """The scene file, and screenshots of any size, that of the view unless told."""
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
