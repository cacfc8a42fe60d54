"""Scattering below the skin of a person of the parametric human."""

from __future__ import annotations

from dermis.human.person import Human
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL
from dermis.scene.skin import Pigments, Skin


def skin_of(person: Human, base: Skin | None = None) -> Skin:
    """Skin in which light spreads as far as the person's pigments let it: less the darker the skin is.

    base : of all else; the default skin when left out

    The colour stays that of the person's painted maps.
    """
    look = person.look
    own = Pigments(
        melanin=look.melanin,
        eumelanin=look.eumelanin,
        blood=look.blood,
        oxygen=look.oxygen,
        epidermis_mm=DEFAULT_SKIN.epidermis_mm,
    )
    return Skin(**((base or Skin()).model_dump() | {"profile": SPECTRAL, "pigments": own}))
