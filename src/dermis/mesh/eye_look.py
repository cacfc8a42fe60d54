"""What makes eyes look different from others."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.base.quantities import check_fields

LIMITS = {
    "eumelanin": (0.0, 1.0),
    "pupil_mm": (1.0, 4.0),
    "redness": (0.0, 1.0),
    "seed": (0, 2**32 - 1),
}
"""Bounds of the fields of `EyeLook`."""


@dataclass(frozen=True)
class EyeLook:
    """What makes eyes look different.

    eumelanin : of the iris, from none, which leaves it blue, to the darkest brown, 0 to 1 [-]
    pupil_mm : radius of the pupil, 1 to 4 [mm]
    redness : of the white of the eye, 0 to 1 [-]
    seed : which fibres and vessels, any integer from 0
    """

    eumelanin: float = 0.6
    pupil_mm: float = 1.9
    redness: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        check_fields(self, LIMITS, "eyes: ")
