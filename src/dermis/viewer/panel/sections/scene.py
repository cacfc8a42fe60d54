"""Files and screenshots."""

from __future__ import annotations

from pathlib import Path

from imgui_bundle import imgui

from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import attempt, button

TITLE = "Scene"
OPEN = True


def draw(desk: Desk) -> None:
    """The scene's file, and pictures of any size."""
    names = desk.names
    _, names.scene = imgui.input_text("scene", names.scene)
    if button(desk, "save"):
        attempt(desk, lambda: desk.save(Path(names.scene)))
    imgui.same_line()
    if button(desk, "load"):
        attempt(desk, lambda: desk.load(Path(names.scene)))
    _, names.picture = imgui.input_text("picture", names.picture)
    _, sides = imgui.input_int2("size", list(names.size))
    names.size = max(1, sides[0]), max(1, sides[1])
    if button(desk, "screenshot"):
        attempt(desk, lambda: desk.screenshot(Path(names.picture), names.size))
