"""Appearance of the eyes: iris colour, pupil, redness."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.base.quantities import check_fields

EYE_LOOK_RANGES = {
    "eumelanin": (0.0, 1.0),
    "pupil_mm": (1.0, 4.0),
    "redness": (0.0, 1.0),
    "seed": (0, 2**32 - 1),
}
"""Bounds of the fields of `EyeLook`."""


@dataclass(frozen=True)
class EyeLook:
    """Appearance of the eyes.

    Parameters
    ----------
    eumelanin : float, optional
        Eumelanin of the iris, from 0 (blue) to 1 (darkest brown) [-].
    pupil_mm : float, optional
        Radius of the pupil, 1 to 4 [mm].
    redness : float, optional
        Redness of the white of the eye, 0 to 1 [-].
    seed : int, optional
        Seed of the pattern of fibres and vessels, from 0.

    Raises
    ------
    DermisError
        For values outside these ranges.

    Examples
    --------
    >>> import dermis
    >>> dermis.EyeLook(eumelanin=0.1).pupil_mm
    1.9
    """

    eumelanin: float = 0.6
    pupil_mm: float = 1.9
    redness: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges of all fields."""
        check_fields(self, EYE_LOOK_RANGES, "eyes: ")
