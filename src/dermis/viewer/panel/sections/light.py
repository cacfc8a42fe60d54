"""Lights and the environment; Shift and a drag carry the chosen one around the head."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from dermis.mesh.samples import SAMPLES
from dermis.scene.environment import Environment
from dermis.scene.files import light_presets
from dermis.scene.lights import Light, SpotLight
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import attempt, button, choice, colour, field_slider, slider, tick
from dermis.viewer.state import ViewerState, changed

TITLE = "Light"
OPEN = False
_NO_ENVIRONMENT = "none"
_OWN = "(own)"
_FADE = 0.5  # least width over which a cone fades [degrees]
_SHAPES = {  # label, range and unit of what some kinds of light have
    "width_mm": ("width", 1.0, 3000.0, "%.0f mm"),
    "height_mm": ("height", 1.0, 3000.0, "%.0f mm"),
    "length_mm": ("length", 1.0, 3000.0, "%.0f mm"),
    "radius_mm": ("radius", 1.0, 500.0, "%.0f mm"),
    "inner_degrees": ("inner cone", 0.5, 80.0, "%.1f°"),
    "outer_degrees": ("outer cone", 0.5, 88.0, "%.1f°"),
    "angle_degrees": ("angle", 0.0, 20.0, "%.2f°"),
    "softness_mm": ("softness", 0.1, 100.0, "%.1f mm"),
}


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

    def apply(**fields: object) -> ViewerState:
        return desk.state.with_light(index, **fields)

    imgui.text_disabled(f"{light.kind}, Shift and drag to move")
    value = math.log2(max(strength, 1e-6) / math.pi)
    slider(desk, "strength", value, stronger, -6.0, 4.0, form="%.2f stops")
    colour(desk, "irradiance", light.irradiance, lambda found: apply(irradiance=found))
    for field, (label, low, high, form) in _SHAPES.items():
        if field in type(light).model_fields:
            low, high = _least(light, field, low), _most(light, field, high)
            field_slider(desk, label, light, field, apply, low, high, log=low > 0, form=form)
    tick(desk, "shadows", light.shadows, lambda found: apply(shadows=found))
    _number_of_lights(desk, index)


def _least(light: Light, field: str, low: float) -> float:
    """A cone ends outside where it begins to fade."""
    return light.inner_degrees + _FADE if isinstance(light, SpotLight) and field == "outer_degrees" else low


def _most(light: Light, field: str, high: float) -> float:
    return light.outer_degrees - _FADE if isinstance(light, SpotLight) and field == "inner_degrees" else high


def _number_of_lights(desk: Desk, index: int) -> None:
    """Another light like the chosen one, or one less."""
    lights = list(desk.state.scene.lights)
    if button(desk, "copy"):  # which the frame may refuse when there are too many
        attempt(desk, lambda: desk.change(desk.state.with_lights([*lights, lights[index]])))
        desk.controls.light = len(lights)
    imgui.same_line()
    if button(desk, "remove"):
        desk.change(desk.state.with_lights(lights[:index] + lights[index + 1 :]))
        desk.controls.light = max(0, index - 1)


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

    field_slider(desk, "turn", now, "rotation_degrees", apply, -180.0, 180.0, form="%.0f°")
    field_slider(desk, "brightness", now, "exposure", apply, 0.02, 10.0, log=True)
    tick(desk, "seen behind", now.visible, lambda found: apply(visible=found))
