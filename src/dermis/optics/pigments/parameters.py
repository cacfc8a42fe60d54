"""Parameters of a skin made of pigments: the default skin, and named skins.

All defaults of these numbers are here; NumPy is not imported, so that help texts appear quickly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from dermis.base.errors import refuse
from dermis.base.quantities import checked_number

Structure = Literal["dj2006", "donner2008", "biospec"]
DEFAULT_STRUCTURE: Final[Structure] = "dj2006"
_FRACTIONS = "melanin", "eumelanin", "blood", "oxygen", "epidermal_blood", "oiliness"
_EPIDERMIS_MM = 1e-3, 2.0
"""Thinnest and thickest epidermis: less than a cell, and a callous heel [mm]."""


@dataclass(frozen=True)
class SkinParameters:
    """Pigments and epidermal thickness of a skin.

    melanin : fraction of the epidermal volume that is melanosomes, 0 to 1 [-]
    eumelanin : fraction of melanosomes with eumelanin; the rest have pheomelanin, 0 to 1 [-]
    blood : fraction of the dermal volume that is blood, 0 to 1 [-]
    oxygen : fraction of oxygenated haemoglobin, 0 to 1 [-]
    epidermis_mm : thickness of the epidermis; the default is an artist's choice, measured values are 0.05 to
        0.1 [mm]
    epidermal_blood : fraction of the epidermal volume that is blood, in "donner2008" only, 0 to 1 [-]
    oiliness : factor rho_s of the surface reflection, 0 to 1, without effect below the surface [-]

    Source: [DonnerJensen2006, DonnerJensen2006a]; [Donner2008] for blood in the epidermis.
    """

    melanin: float = 0.018
    eumelanin: float = 0.7
    blood: float = 0.01
    oxygen: float = 0.75
    epidermis_mm: float = 0.05
    epidermal_blood: float = 0.0
    oiliness: float = 0.3

    def __post_init__(self) -> None:
        """Check the ranges of all fields."""
        for name in _FRACTIONS:
            checked_number(_option(name), getattr(self, name), 0.0, 1.0, "a fraction")
        checked_number(_option("epidermis_mm"), self.epidermis_mm, *_EPIDERMIS_MM, "mm")
        if self.melanin + self.epidermal_blood > 1.0:
            both = f"{_option('melanin')} and {_option('epidermal_blood')}"
            actual = f"got {self.melanin:g} and {self.epidermal_blood:g}"
            refuse(both, "at most 1 together", actual, "Lower one")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _published(melanin: float, eumelanin: float, blood: float) -> SkinParameters:
    """Return a skin of [DonnerJensen2006a] with oxygenation and thickness from a public implementation."""
    return SkinParameters(melanin, eumelanin, blood, oxygen=0.75, epidermis_mm=0.25)


SPECTRAL: Final = "spectral"
DEFAULT_SKIN: Final = SkinParameters()
SKINS: Final[Mapping[str, SkinParameters]] = MappingProxyType(
    {
        SPECTRAL: DEFAULT_SKIN,
        "light": _published(0.005, 0.7, 0.005),
        "medium": _published(0.15, 0.0, 0.01),
        "dark": _published(0.5, 0.7, 0.05),
    }
)
"""Skins by name: the default and the three skins of [DonnerJensen2006a]."""
