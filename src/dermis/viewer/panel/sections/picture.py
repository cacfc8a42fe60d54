"""From light to the display."""

from __future__ import annotations

from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import colour, field_choice, field_slider

TITLE = "Picture"
OPEN = False


def draw(desk: Desk) -> None:
    """Exposure, the curve, and the mistakes that are there for comparison."""
    settings, apply = desk.state.settings, desk.state.with_settings
    field_slider(desk, "exposure", settings, "exposure", apply, 0.05, 20.0, log=True)
    field_choice(desk, "tone", settings, "tone", apply)
    field_choice(desk, "gamma", settings, "gamma", apply)
    field_slider(desk, "bloom", settings, "bloom", apply, 0.0, 0.5)
    colour(desk, "background", settings.background, lambda found: apply(background=found))
