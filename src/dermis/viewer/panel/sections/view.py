"""Where the head is seen from, and what of the way to the picture is shown."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from dermis.viewer.chart import ATLAS
from dermis.viewer.controls import CAMERAS
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import button, choice
from dermis.viewer.views import LAYERS, VIEWS

TITLE = "View"
OPEN = True
_BUTTONS_IN_A_ROW = 3


def draw(desk: Desk) -> None:
    """Camera presets and views."""
    choice(desk, "show", desk.state.view, VIEWS, desk.state.in_view)
    if desk.state.view == ATLAS:
        _chart(desk)
    for index, name in enumerate(CAMERAS):
        if index % _BUTTONS_IN_A_ROW:
            imgui.same_line()
        if button(desk, f"{name}##camera"):
            desk.controls.look(name)


def _chart(desk: Desk) -> None:
    chart = desk.state.chart
    choice(desk, "layer", chart.layer, LAYERS, lambda name: desk.state.with_chart(replace(chart, layer=name)))
    imgui.text_disabled("wheel zooms, double click shows all")
