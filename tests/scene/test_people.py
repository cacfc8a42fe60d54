"""Subsurface scattering in the skin of people."""

from __future__ import annotations

from dermis import Human
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.optics.gaussians import GaussianSum
from dermis.scene.people import skin_of
from dermis.scene.skin import Skin


def profile(person: Human) -> GaussianSum:
    return SkinProfiles().profile(skin_of(person))


def mean_square_mm2(sum_of: GaussianSum) -> float:
    """Return the mean squared distance of red light, normalised by its total."""
    red = sum_of.weight[:, 0]
    return float((red * sum_of.variance_mm2).sum() / red.sum())


def test_light_spreads_less_in_darker_skin() -> None:
    pale, dark = (Human(african=share, asian=0, caucasian=1 - share) for share in (0.0, 1.0))
    assert dark.look.melanin > 5 * pale.look.melanin
    assert mean_square_mm2(profile(pale)) > 1.1 * mean_square_mm2(profile(dark))


def test_other_properties_are_kept() -> None:
    person = Human()
    skin = skin_of(person, Skin(oiliness=0.4, roughness=0.25))
    assert (skin.oiliness, skin.roughness, skin.albedo) == (0.4, 0.25, "map")
    assert skin.pigments is not None and skin.pigments.melanin == person.look.melanin
