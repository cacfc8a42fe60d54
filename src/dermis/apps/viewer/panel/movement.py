"""Sections of what moves: a control for each of the head's targets and bones, and the motion that plays."""

from __future__ import annotations

from imgui_bundle import imgui

from dermis.apps.viewer.panel.fields import (
    attempt,
    button,
    clamped,
    draw_rows,
    explain,
    hold,
    record_position,
    slider,
)
from dermis.apps.viewer.posing import angles_of, at_rest, matching, weight_of, with_angles, with_weight
from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.scene.plain import Range

_WEIGHTS, _TURNS = Range(0.0, 1.0), Range(-60.0, 60.0)
_LONG_NAME = 16  # letters beyond which the panel may be too narrow for it


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
