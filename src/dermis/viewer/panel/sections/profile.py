"""The diffusion profile: presets, and pigments whose profile is fitted as they move."""

from __future__ import annotations

import numpy as np

from dermis.errors import DermisError
from dermis.optics.pigments.skin import EXAMPLES, SkinParameters
from dermis.optics.profiles import preset_names
from dermis.optics.tissue import SPECTRAL
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import choice, field_choice, slider
from dermis.viewer.panel.plots import curves
from dermis.viewer.state import ViewerState

_RADII_MM = np.geomspace(0.01, 30.0, 160)
CHANNELS = ((0.9, 0.35, 0.3), (0.35, 0.8, 0.4), (0.4, 0.55, 1.0))

TITLE = "Profile"
OPEN = True
_PIGMENTS = (
    ("melanin", 0.0005, 0.6, True),
    ("eumelanin", 0.0, 1.0, False),
    ("blood", 0.0005, 0.2, True),
    ("oxygen", 0.0, 1.0, False),
    ("epidermis_mm", 0.05, 0.5, False),
)


def draw(desk: Desk) -> None:
    """The profile's name, where its colour goes, and its pigments when it is made of some."""
    skin = desk.state.scene.skin

    def take(name: str) -> ViewerState:
        return desk.state.with_skin(profile=name, pigments=None)

    choice(desk, "profile", skin.profile, preset_names(), take)
    field_choice(desk, "colour from", skin, "albedo", desk.state.with_skin)
    if skin.profile in (SPECTRAL, *EXAMPLES):
        _pigments(desk)
    _plot(desk)


def _pigments(desk: Desk) -> None:
    skin = desk.state.scene.skin
    own = EXAMPLES.get(skin.profile, SkinParameters())
    given = skin.pigments.given() if skin.pigments else {}
    for name, low, high, log in _PIGMENTS:
        value = float(given.get(name, getattr(own, name)))

        def apply(found: float, name: str = name) -> ViewerState:
            return desk.state.with_pigments(**{name: found})

        label = "epidermis [mm]" if name == "epidermis_mm" else name
        slider(desk, label, value, apply, low, high, log=log, form="%.4f" if log else "%.2f")


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
