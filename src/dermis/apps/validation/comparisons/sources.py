"""The works behind a comparison: the truths, the measures and the techniques."""

from __future__ import annotations

from collections.abc import Iterable

from dermis.scene.settings import Settings
from dermis.scene.sources import scattering_sources

_TRUTHS = {
    "surface-integral": ("JensenBuhler2002", "Turk1992"),
    "heat": ("PinkallPolthier1993", "BobenkoSpringborn2007", "Fisher2007", "SharpCrane2020", "Bank1985"),
    "path-traced": ("Jakob2022", "Miller2019", "Welford1962"),
    "cycles": ("ChristensenBurley2015",),
}
_DIFFERENCE = "Andersson2020"


def comparison_sources(against: str, techniques: Iterable[str]) -> tuple[str, ...]:
    """Keys of the bibliography, without duplicates.

    against : of `truths.TRUTHS`
    """
    keys = [*_TRUTHS[against], _DIFFERENCE]
    for technique in techniques:
        keys += scattering_sources(Settings.model_validate({"technique": technique}))
    return tuple(dict.fromkeys(keys))
