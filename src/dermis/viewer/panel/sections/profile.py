"""The diffusion profile: presets, and pigments whose profile is fitted as they move."""

from __future__ import annotations

from dermis.optics.pigments.skin import EXAMPLES, SkinParameters
from dermis.optics.profiles import preset_names
from dermis.optics.tissue import SPECTRAL
from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import choice, field_choice, slider
from dermis.viewer.state import ViewerState

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
