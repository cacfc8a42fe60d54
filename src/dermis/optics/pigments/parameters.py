"""What a skin of pigments is made of: the default skin, and skins by name.

Nothing else states a default of these numbers; without NumPy, so that help texts can show them quickly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from dermis.base.errors import refuse
from dermis.base.quantities import number

Structure = Literal["dj2006", "donner2008", "biospec"]
DEFAULT_STRUCTURE: Final[Structure] = "dj2006"
_SHARES = "melanin", "eumelanin", "blood", "oxygen", "epidermal_blood", "oiliness"
_EPIDERMIS_MM = 1e-3, 2.0
"""From less than a cell to a callous heel."""


@dataclass(frozen=True)
class SkinParameters:
    """Pigments and thickness of a skin; its defaults are those of the whole package.

    melanin : share of the epidermis' volume that is melanosomes, 0 to 1 [-]
    eumelanin : share of the melanosomes that hold eumelanin, the rest holds pheomelanin, 0 to 1 [-]
    blood : share of the dermis' volume that is blood, 0 to 1 [-]
    oxygen : share of the haemoglobin that carries oxygen, 0 to 1 [-]
    epidermis_mm : thickness of the epidermis, an artist's value within what is measured, 0.05 to 0.1 [mm]
    epidermal_blood : share of the epidermis' volume that is blood, in "donner2008" only, 0 to 1 [-]
    oiliness : gain of the surface's reflection (rho_s), 0 to 1; nothing below the surface depends on it [-]

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
        for name in _SHARES:
            number(_option(name), getattr(self, name), 0.0, 1.0, "a share")
        number(_option("epidermis_mm"), self.epidermis_mm, *_EPIDERMIS_MM, "mm")
        if self.melanin + self.epidermal_blood > 1.0:
            both = f"{_option('melanin')} and {_option('epidermal_blood')}"
            came = f"{self.melanin:g} and {self.epidermal_blood:g} came"
            refuse(both, "at most 1 together", came, "Lower one")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _published(melanin: float, eumelanin: float, blood: float) -> SkinParameters:
    """A skin of [DonnerJensen2006a] with the oxygen and the thickness of public code's scene."""
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
"""The default, and the three skins of [DonnerJensen2006a]; of light that meets the last, 2 % return."""
