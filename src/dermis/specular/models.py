"""Every model of the surface by its name, behind one protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from numpy.typing import ArrayLike

from dermis.specular.blinn_phong import blinn_phong, blinn_phong_plain
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.kelemen import kelemen
from dermis.specular.phong import phong, phong_plain
from dermis.specular.torrance_sparrow import torrance_sparrow, torrance_sparrow_smith
from dermis.specular.two_lobe import two_lobe


class Lobe(Protocol):
    """BRDF for rho_s = 1, without the cosine [1/sr], 0 unless light and view are above the surface."""

    def __call__(self, angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
        """m : roughness, broadcast against the angles [-]."""


@dataclass(frozen=True)
class Model:
    """A lobe and what is to be said of it.

    note : what the model is; for one that is not reciprocal, why
    reciprocal : whether light and view may change places
    sources : keys of the bibliography
    """

    lobe: Lobe
    note: str
    reciprocal: bool
    sources: tuple[str, ...]


MODELS: dict[str, Model] = {
    "kelemen": Model(
        kelemen,
        "Beckmann's slopes over the unnormalised half vector, shaded by table",
        True,
        ("Kelemen2001", "Beckmann1963"),
    ),
    "torrance-sparrow": Model(
        torrance_sparrow,
        "Beckmann's slopes masked by V-cavities",
        True,
        ("TorranceSparrow1967", "CookTorrance1982", "Beckmann1963"),
    ),
    "torrance-sparrow-smith": Model(
        torrance_sparrow_smith,
        "Beckmann's slopes masked after Smith",
        True,
        ("TorranceSparrow1967", "Smith1967", "Walter2007"),
    ),
    "blinn-phong": Model(
        blinn_phong, "a power of n.h with its energy put right", True, ("Blinn1977", "Walter2007")
    ),
    "blinn-phong-plain": Model(
        blinn_phong_plain,
        "a power of n.h as first used; not reciprocal, for its highlight has no cosine of the light",
        False,
        ("Blinn1977",),
    ),
    "phong": Model(
        phong,
        "a power of the mirror direction with its energy put right",
        True,
        ("Phong1975", "LafortuneWillems1994"),
    ),
    "phong-plain": Model(
        phong_plain,
        "a power of the mirror direction as first published; not reciprocal, for its highlight has no cosine "
        "of the light and its reflectance is that of the angle of incidence",
        False,
        ("Phong1975",),
    ),
    "two-lobe": Model(two_lobe, "a narrow and a wide Kelemen lobe", True, ("Kelemen2001", "EpicGames2025")),
    "kelemen-direct": Model(
        kelemen, "the first, shaded without its table", True, ("Kelemen2001", "Beckmann1963")
    ),
}
"""An entry's place is its number in the shaders."""
