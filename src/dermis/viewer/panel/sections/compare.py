"""Before and after: a frozen state beside the live one."""

from __future__ import annotations

from imgui_bundle import imgui

from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import button

TITLE = "Before and after"
OPEN = False


def draw(desk: Desk) -> None:
    """Freeze what is shown for the left side; the divider is dragged in the picture."""
    split = desk.split
    if button(desk, "freeze"):
        split.freeze(desk.state)
    if split.before is None:
        return
    imgui.same_line()
    if button(desk, "swap"):
        frozen = split.before
        split.freeze(desk.state)
        desk.change(frozen.with_camera(desk.state.scene.camera))
    imgui.same_line()
    if button(desk, "release"):
        split.release()
