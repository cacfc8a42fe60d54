"""The diffusion profile: presets, and pigments or layers whose profile is fitted as they move."""

from __future__ import annotations

import numpy as np

from dermis.errors import DermisError
from dermis.optics.profiles import preset_names
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import choice, field_choice
from dermis.viewer.panel.plots import curves
from dermis.viewer.panel.sections.tissue import draw_tissue
from dermis.viewer.state import ViewerState

_RADII_MM = np.geomspace(0.01, 30.0, 160)
CHANNELS = ((0.9, 0.35, 0.3), (0.35, 0.8, 0.4), (0.4, 0.55, 1.0))

TITLE = "Profile"
OPEN = True


def draw(desk: Desk) -> None:
    """The profile's name, where its colour goes, and what it is made of."""
    skin = desk.state.scene.skin

    def take(name: str) -> ViewerState:
        return desk.state.with_skin(profile=name, pigments=None, layers=())

    choice(desk, "profile", skin.profile, preset_names(), take)
    field_choice(desk, "colour from", skin, "albedo", desk.state.with_skin)
    draw_tissue(desk)
    _plot(desk)


def _plot(desk: Desk) -> None:
    """r R(r) of the Gaussians that the frame blurs with, by channel."""
    scene = desk.state.scene
    try:
        profile = desk.studio.renderer.profile_of(scene.skin)
    except DermisError:  # which is told over the picture
        return
    r, values = _RADII_MM, profile.radiant_exitance(_RADII_MM)
    series = {name: r * values[:, k] for k, name in enumerate(("red", "green", "blue"))}
    curves("profile", r, series, CHANNELS, "r [mm], r R(r) [1/mm]")
