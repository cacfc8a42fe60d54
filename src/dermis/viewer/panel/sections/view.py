"""Where the head is seen from, and what of the way to the picture is shown."""

from __future__ import annotations

from imgui_bundle import imgui

from dermis.viewer.controls import CAMERAS
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import button, choice
from dermis.viewer.views import VIEWS

TITLE = "View"
OPEN = True
_BUTTONS_IN_A_ROW = 3


def draw(desk: Desk) -> None:
    """Camera presets and views."""
    choice(desk, "show", desk.state.view, VIEWS, desk.state.in_view)
    for index, name in enumerate(CAMERAS):
        if index % _BUTTONS_IN_A_ROW:
            imgui.same_line()
        if button(desk, name):
            desk.controls.look(name)
