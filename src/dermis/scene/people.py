"""Scattering settings of the skin of a parametric human."""

from __future__ import annotations

from dermis.human.person import Human
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL
from dermis.scene.skin import Pigments, Skin


def skin_of(person: Human, base: Skin | None = None) -> Skin:
    """Return skin settings whose scattering follows the pigments of a person.

    base : settings to start from; the default skin when left out

    The colour is still that of the person's painted maps; darker skin scatters light less far.
    """
    look = person.look
    pigments = Pigments(
        melanin=look.melanin,
        eumelanin=look.eumelanin,
        blood=look.blood,
        oxygen=look.oxygen,
        epidermis_mm=DEFAULT_SKIN.epidermis_mm,
    )
    return Skin(**((base or Skin()).model_dump() | {"profile": SPECTRAL, "pigments": pigments}))
