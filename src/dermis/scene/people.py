"""Skin settings of parametric humans."""

from __future__ import annotations

from dermis.human.person import Human
from dermis.optics.pigments.parameters import SPECTRAL_PRESET
from dermis.scene.skin import Pigments, Skin


def skin_of(person: Human, base: Skin | None = None) -> Skin:
    """Return skin settings whose subsurface scattering matches the pigments of a person.

    Darker skin scatters light less far. The colour of the skin does not change: it is that of the person's
    painted maps.

    base : settings to start from; the default skin if None
    """
    look = person.look
    pigments = Pigments(
        melanin=look.melanin,
        eumelanin=look.eumelanin,
        blood=look.blood,
        oxygen=look.oxygen,
        epidermis_mm=look.epidermis_mm,
    )
    return Skin(**((base or Skin()).model_dump() | {"profile": SPECTRAL_PRESET, "pigments": pigments}))
