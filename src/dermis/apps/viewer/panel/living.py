"""Section of the panel with sliders for states of the skin, such as a blush."""

from __future__ import annotations

from functools import partial

from dermis.apps.viewer.panel.fields import draw_slider
from dermis.apps.viewer.session import Session
from dermis.human.living.zones import STATE_NAMES
from dermis.scene.frozen_model import SliderRange
from dermis.scene.living import is_living_head

_WEIGHT_RANGE = SliderRange(0.0, 1.0)


def has_living_skin(session: Session) -> bool:
    """Return whether the skin of the head is painted from pigments, which states change."""
    scene = session.state.scene
    return is_living_head(scene.head, scene.skin.albedo)


def draw_skin_states(session: Session) -> None:
    """Draw a slider for the weight of each state of the skin."""
    state = session.displayed_state.scene.state
    weights = state.weights if state else {}
    for name in STATE_NAMES:
        change = partial(session.state.with_skin_state, name)
        draw_slider(session, f"{name}##state", weights.get(name, 0.0), change, _WEIGHT_RANGE, "%.2f")
