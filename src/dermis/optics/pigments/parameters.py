"""Parameters of skins that are defined by their pigments: the default skin, and the skins of the presets.

All defaults of `SkinParameters` are here. NumPy is not imported, so that help texts appear quickly.
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
_FRACTION_FIELDS = "melanin", "eumelanin", "blood", "oxygen", "epidermal_blood", "baseline", "oiliness"
_EPIDERMIS_RANGE_MM = 1e-3, 2.0
"""Accepted thickness of the epidermis: from less than a cell to a callous heel [mm]."""


@dataclass(frozen=True)
class SkinParameters:
    """Pigments and epidermal thickness of a skin, from which the layers of the skin are computed.

    melanin : fraction of the epidermal volume that is melanosomes, 0 to 1 [-]
    eumelanin : fraction of the melanosomes that contain eumelanin; all others contain pheomelanin, 0 to 1 [-]
    blood : fraction of the dermal volume that is blood, 0 to 1 [-]
    oxygen : fraction of oxygenated haemoglobin, 0 to 1 [-]
    epidermis_mm : thickness of the epidermis; measured values are 0.05 to 0.1 [mm]
    epidermal_blood : fraction of the epidermal volume that is blood, 0 to 1; only "donner2008" uses it [-]
    baseline : absorption of tissue without blood and melanin, relative to [Jacques1998], 0 to 1 [-]
    oiliness : specular strength rho_s of the surface, 0 to 1; it does not affect light below the surface [-]

    The defaults of baseline, epidermis_mm and oxygen are those that fit the spectra of measured people best,
    see docs/measured.md.

    Source: [DonnerJensen2006, DonnerJensen2006a]; [Donner2008] for blood in the epidermis; [Lu2025] for the
    defaults.
    """

    melanin: float = 0.018
    eumelanin: float = 0.7
    blood: float = 0.01
    oxygen: float = 0.85
    epidermis_mm: float = 0.055
    epidermal_blood: float = 0.0
    baseline: float = 0.5
    oiliness: float = 0.3

    def __post_init__(self) -> None:
        """Raise DermisError for a field out of range."""
        for name in _FRACTION_FIELDS:
            checked_number(_option_name(name), getattr(self, name), 0.0, 1.0, "a fraction")
        checked_number(_option_name("epidermis_mm"), self.epidermis_mm, *_EPIDERMIS_RANGE_MM, "mm")
        if self.melanin + self.epidermal_blood > 1.0:
            both = f"{_option_name('melanin')} and {_option_name('epidermal_blood')}"
            actual = f"got {self.melanin:g} and {self.epidermal_blood:g}"
            refuse(both, "at most 1 together", actual, "Lower one")


def _option_name(field_name: str) -> str:
    return f"--{field_name.replace('_', '-')}"


def _donner_jensen_skin(melanin: float, eumelanin: float, blood: float) -> SkinParameters:
    """Return a skin of [DonnerJensen2006a] with the given pigment fractions.

    Its oxygenation and epidermal thickness are taken from public source code that quotes the formulae of the
    paper; it is not known whether the authors of the paper used the same values.
    """
    return SkinParameters(melanin, eumelanin, blood, oxygen=0.75, epidermis_mm=0.25, baseline=1.0)


SPECTRAL_PRESET: Final = "spectral"
DEFAULT_SKIN: Final = SkinParameters()
SKINS: Final[Mapping[str, SkinParameters]] = MappingProxyType(
    {
        SPECTRAL_PRESET: DEFAULT_SKIN,
        "light": _donner_jensen_skin(0.005, 0.7, 0.005),
        "medium": _donner_jensen_skin(0.15, 0.0, 0.01),
        "dark": _donner_jensen_skin(0.5, 0.7, 0.05),
    }
)
"""Skins by name: the default and the three skins of [DonnerJensen2006a]."""
