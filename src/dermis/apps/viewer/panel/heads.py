"""The section of the head: people by number, samples, files."""

from __future__ import annotations

import random

from imgui_bundle import imgui

from dermis.apps.viewer.heads import built_in
from dermis.apps.viewer.panel.fields import button, explain, record_position
from dermis.apps.viewer.session import Session
from dermis.scene.heads import HUMAN

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
    is_open = imgui.begin_combo("head", session.heads.called(now))
    if not is_open:
        record_position(session, "head")
        return
    for name in names:
        clicked, _ = imgui.selectable(f"{session.heads.called(name)}###{name}", name == now)
        record_position(session, f"head/{name}")
        if clicked and name != now:
            session.heads.open(name)
    imgui.end_combo()


def _seed_of(session: Session) -> int:
    """Of the person shown, 0 for another head."""
    word = str(session.state.head.get("name", "")).removeprefix(f"{HUMAN}:")
    return int(word) if word.isdecimal() else 0
