"""Lights and the environment; Shift and a drag carry the chosen one around the head."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from dermis.assets.samples import SAMPLES
from dermis.scene.environment import Environment
from dermis.scene.files import light_presets
from dermis.scene.lights import Light
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import choice, colour, field_slider, slider, tick
from dermis.viewer.state import ViewerState, changed

TITLE = "Light"
OPEN = False
_NO_ENVIRONMENT = "none"
_OWN = "(own)"


def draw(desk: Desk) -> None:
    """The rig, the light that Shift and a drag move, and what is all around."""
    choice(desk, "rig", desk.state.rig or _OWN, light_presets(), desk.state.with_rig)
    _chosen_light(desk)
    _environment(desk)


def _chosen_light(desk: Desk) -> None:
    lights, controls = desk.state.scene.lights, desk.controls
    for index, light in enumerate(lights):
        if index:
            imgui.same_line()
        if imgui.radio_button(f"{index + 1}##{light.kind}", controls.light == index):
            controls.light = index
    if lights:
        imgui.same_line()
    if imgui.radio_button("around", controls.light >= len(lights)):
        controls.light = len(lights)
    if controls.light < len(lights):
        _light(desk, controls.light, lights[controls.light])


def _light(desk: Desk, index: int, light: Light) -> None:
    strength = max(light.irradiance)

    def stronger(stops: float) -> ViewerState:
        factor = 2.0**stops * math.pi / max(strength, 1e-6)
        return desk.state.with_light(index, irradiance=tuple(factor * c for c in light.irradiance))

    imgui.text_disabled(f"{light.kind}, Shift and drag to move")
    slider(desk, "stops", math.log2(max(strength, 1e-6) / math.pi), stronger, -6.0, 4.0, form="%.2f")
    colour(desk, "irradiance", light.irradiance, lambda found: desk.state.with_light(index, irradiance=found))
    tick(desk, "shadows", light.shadows, lambda found: desk.state.with_light(index, shadows=found))


def _environment(desk: Desk) -> None:
    now = desk.state.scene.environment
    samples = [name for name, sample in SAMPLES.items() if sample.kind == "environment"]

    def take(name: str) -> ViewerState:
        chosen = None if name == _NO_ENVIRONMENT else Environment(name=name)
        return desk.state.with_environment(chosen)

    names = (_NO_ENVIRONMENT, "uniform", *samples)
    choice(desk, "environment", now.name if now else _NO_ENVIRONMENT, names, take)
    if now is None:
        return

    def apply(**fields: object) -> ViewerState:
        return desk.state.with_environment(changed(now, **fields) if now else None)

    field_slider(desk, "turn", now, "rotation_degrees", apply, -180.0, 180.0, form="%.0f")
    field_slider(desk, "brightness", now, "exposure", apply, 0.02, 10.0, log=True)
    tick(desk, "seen behind", now.visible, lambda found: apply(visible=found))
