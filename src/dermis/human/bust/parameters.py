"""What makes one bust differ from another."""

from __future__ import annotations

from dataclasses import dataclass, fields
from numbers import Integral

from dermis.errors import refuse

RANGES = {
    "width": (0.9, 1.1),
    "nose": (0.8, 1.25),
    "ears": (0.8, 1.2),
    "jaw": (0.88, 1.12),
    "fullness": (-1.0, 1.0),
    "asymmetry": (0.0, 2.0),
    "seed": (0, 2**32 - 1),
}


@dataclass(frozen=True)
class BustParameters:
    """Proportions relative to an average adult; all defaults together are the average of both sexes.

    width : breadth of the whole head, 0.9 to 1.1 [-]
    nose : size of the nose, 0.8 to 1.25 [-]
    ears : size of the ears, 0.8 to 1.2 [-]
    jaw : breadth of the lower jaw, 0.88 to 1.12 [-]
    fullness : soft tissue of cheeks and lips, from -1, lean and aged, to 1, full and young [-]
    asymmetry : by how much left and right differ, 0 to 2 times the usual [-]
    seed : which small asymmetry, any integer from 0
    """

    width: float = 1.0
    nose: float = 1.0
    ears: float = 1.0
    jaw: float = 1.0
    fullness: float = 0.0
    asymmetry: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        for field in fields(self):
            low, high = RANGES[field.name]
            value = getattr(self, field.name)
            if not low <= value <= high:
                refuse(field.name, f"a number from {low:g} to {high:g}", f"{value!r} came", "Choose within")
        if not isinstance(self.seed, Integral):
            refuse("seed", "a whole number", f"{self.seed!r} came", "Round it")
