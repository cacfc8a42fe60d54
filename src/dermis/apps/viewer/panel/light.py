"""The section of the lights and the environment."""

from __future__ import annotations

import math
from typing import Any

from imgui_bundle import imgui

from dermis.apps.viewer.panel.fields import (
    LIGHT,
    LIGHT_KINDS,
    Style,
    attempt,
    button,
    combo,
    draw_fields,
    slider,
)
from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState, changed
from dermis.formats.samples import SAMPLES
from dermis.scene.environment import Environment
from dermis.scene.lights import LIGHTS, Light, SpotLight, light_presets
from dermis.scene.plain import Range

_CUSTOM = "custom"
_NO_ENVIRONMENT = "none"
_STOPS = Range(-6.0, 4.0)
_PLACE = (-500.0, 400.0, 800.0)  # of a new light, from the upper left of the portrait [mm]
_FADE = 0.5  # least width over which a cone fades [degrees]
_ENVIRONMENT = {"exposure": Style("brightness")}


def draw_lights(session: Session) -> None:
    """The rig, the light that Shift and drag moves, and the environment."""
    combo(session, "rig", session.state.rig or _CUSTOM, light_presets(), session.state.with_rig)
    _select(session)
    combo(session, "add", "a light", LIGHTS, lambda kind: _added(session, kind), LIGHT_KINDS)
    lights, index = session.state.scene.lights, session.controls.light
    if index < len(lights):
        _light(session, index, lights[index])
    _environment(session)


def _added(session: Session, kind: str) -> ViewerState:
    """The state with a light of that kind more, which is selected."""
    places = {"position": _PLACE, "direction": tuple(-one for one in _PLACE)}
    required = {name for name, field in LIGHTS[kind].model_fields.items() if field.is_required()}
    told: dict[str, Any] = {name: place for name, place in places.items() if name in required}
    lights = session.state.scene.lights
    made = session.state.with_lights([*lights, LIGHTS[kind](**told)])
    session.controls.light = len(lights)
    return made


def _select(session: Session) -> None:
    """One radio button for each light and one for the environment."""
    lights, controls = session.state.scene.lights, session.controls
    for index, light in enumerate(lights):
        if imgui.radio_button(f"{index + 1}##{light.kind}", controls.light == index):
            controls.light = index
        imgui.same_line()
    if imgui.radio_button("environment##selected", controls.light >= len(lights)):
        controls.light = len(lights)


def _light(session: Session, index: int, light: Light) -> None:
    """The fields of a light; its place is changed by Shift and drag."""
    strength = max(*light.irradiance, 1e-6)

    def apply(**fields: object) -> ViewerState:
        return session.state.with_light(index, **fields)

    def scale(stops: float) -> ViewerState:
        factor = 2.0**stops * math.pi / strength
        return apply(irradiance=tuple(factor * c for c in light.irradiance))

    imgui.text_disabled(f"{LIGHT_KINDS.get(light.kind, light.kind)}, Shift and drag to move")
    slider(session, "strength", math.log2(strength / math.pi), scale, _STOPS, "%.2f stops")
    draw_fields(session, light, apply, LIGHT | _cone(light))
    if button(session, "copy"):  # refused when there are too many
        lights = session.state.scene.lights
        attempt(session, lambda: session.change(session.state.with_lights([*lights, light])))
        session.controls.light = len(lights)
    imgui.same_line()
    if button(session, "remove"):
        rest = [one for k, one in enumerate(session.state.scene.lights) if k != index]
        session.change(session.state.with_lights(rest))
        session.controls.light = max(0, index - 1)


def _cone(light: Light) -> dict[str, Style]:
    """Ranges of a spot's cone, whose outer angle is wider than its inner one."""
    if not isinstance(light, SpotLight):
        return {}
    inner, outer = Range(0.5, light.outer_degrees - _FADE), Range(light.inner_degrees + _FADE, 88.0)
    return {"inner_degrees": Style("inner cone", inner), "outer_degrees": Style("outer cone", outer)}


def _environment(session: Session) -> None:
    now, with_environment = session.state.scene.environment, session.state.with_environment
    samples = [name for name, sample in SAMPLES.items() if sample.kind == "environment"]

    def take(name: str) -> ViewerState:
        return with_environment(None if name == _NO_ENVIRONMENT else Environment(name=name))

    names = (_NO_ENVIRONMENT, "uniform", *samples)
    combo(session, "environment", now.name if now else _NO_ENVIRONMENT, names, take)
    if now:
        draw_fields(session, now, lambda **fields: with_environment(changed(now, **fields)), _ENVIRONMENT)
