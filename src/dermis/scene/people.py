"""Skin settings of parametric humans."""

from __future__ import annotations

from dermis.human.person import Human
from dermis.optics.pigments.parameters import SPECTRAL_PRESET
from dermis.scene.skin import Pigments, Skin


def skin_of(person: Human, base_skin: Skin | None = None) -> Skin:
    """Return skin settings whose subsurface scattering matches the pigments of a person.

    In darker skin, light scatters less far. The settings do not change the colour of the skin, as the painted
    maps of the person determine this colour.

    base_skin : skin settings from which all fields except `profile` and `pigments` are taken; None for the
        default skin
    """
    look = person.look
    pigments = Pigments(
        melanin=look.melanin,
        eumelanin=look.eumelanin,
        blood=look.blood,
        oxygen=look.oxygen,
        epidermis_mm=look.epidermis_mm,
    )
    return Skin(**((base_skin or Skin()).model_dump() | {"profile": SPECTRAL_PRESET, "pigments": pigments}))
