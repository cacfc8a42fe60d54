"""Section of the panel for states of the skin, such as a blush, and for the pulse."""

from __future__ import annotations

from functools import partial
from typing import Any

from imgui_bundle import imgui

from dermis.apps.viewer.panel.fields import clamp_to_range, draw_slider, draw_tooltip, record_position
from dermis.apps.viewer.session import Session
from dermis.human.living.zones import STATE_NAMES
from dermis.scene.frozen_model import SliderRange, field_help, field_slider_range
from dermis.scene.living import is_living_head
from dermis.scene.pulse import Pulse

_WEIGHT_RANGE = SliderRange(0.0, 1.0)
_PULSE_SLIDERS = {"rate_per_min": "%.0f per minute", "amplitude": "%.3f"}  # printf formats by field name


def has_living_skin(session: Session) -> bool:
    """Return whether the skin of the head is painted from pigments, which states change."""
    scene = session.state.scene
    return is_living_head(scene.head, scene.skin.albedo)


def draw_skin_states(session: Session) -> None:
    """Draw a slider for the weight of each state of the skin, and the controls of the pulse."""
    state = session.displayed_state.scene.state
    weights = state.weights if state else {}
    for name in STATE_NAMES:
        change = partial(session.state.with_skin_state, name)
        draw_slider(session, f"{name}##state", weights.get(name, 0.0), change, _WEIGHT_RANGE, "%.2f")
    _draw_pulse(session)


def _draw_pulse(session: Session) -> None:
    """Draw a check box for the pulse and, while it runs, sliders for its rate and amplitude."""
    pulse = session.heartbeat.pulse
    _, runs = imgui.checkbox("pulse", pulse is not None)
    record_position(session, "pulse")
    draw_tooltip("Change the skin with the heartbeat. Scenes and pictures show it at one time.")
    session.heartbeat.pulse = pulse = (pulse or Pulse()) if runs else None
    if pulse is None:
        return
    fields: dict[str, Any] = {}
    for name, number_format in _PULSE_SLIDERS.items():
        value_range = field_slider_range(Pulse, name) or _WEIGHT_RANGE
        label, before = name.partition("_")[0], getattr(pulse, name)
        edited, value = imgui.slider_float(label, before, value_range.low, value_range.high, number_format)
        fields[name] = clamp_to_range(value, value_range) if edited else before
        record_position(session, label)
        draw_tooltip(field_help(Pulse, name))
    session.heartbeat.pulse = Pulse(**fields)
