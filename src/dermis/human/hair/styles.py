"""Hair styles: numbers by which guide hairs are combed and cut, read from styles.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal

_NO_TIE = 0.0, 0.0, 0.0
Comb = Literal["up", "fall", "back", "rows", "gather", "twist", "beard"]


@dataclass(frozen=True)
class Style:
    """Hair style, as numbers on the average person.

    comb : field of directions along which guide hairs are combed
    max_length_mm, length_mm : length of the guides, and length of the hair unless a person's look states one
    tilt : direction of hair that stands up, from the normal of the skin, 0, to its natural fall, 1
    lift : rise of combed hair at its root, as the tangent of the angle to the skin
    parting_mm : x of the parting
    volume_mm : height of the outermost hair over the skin
    stiffness, gravity : inertia of the direction along a guide per 5 mm, and pull of gravity
    cut_y_mm : height at which hair is cut level; None for hair cut by length
    fringe_y_mm : height at which hair over the forehead is cut; None without a fringe
    round : roundness of the outline, 0 to 1; 1 cuts standing hair to an ellipsoid
    layers : random shortening of strands, as a fraction of their length
    fade : shortening at the sides and the nape, unless a person's look states it
    clump, clump_mm : pull of tips towards the middle of a clump, 0 to 1, and size of the clumps
    rope_mm, braid : radius of ropes of hair, which are twisted or braided of three bundles; 0 for loose hair
    tie_mm, coil_mm : position at which hair is gathered, and radius of a bun around it; 0 for a tail
    crown : additional recession of the hair at the crown and the temples
    women, men : chances of the style, relative to each other
    tight, loose : whether tightly coiled hair and other hair is worn in this style
    """

    comb: Comb
    max_length_mm: float
    length_mm: float
    tilt: float = 0.0
    lift: float = 0.5
    parting_mm: float = -14.0
    volume_mm: float = 0.0
    stiffness: float = 0.9
    gravity: float = 0.5
    cut_y_mm: float | None = None
    fringe_y_mm: float | None = None
    round: float = 0.0
    layers: float = 0.12
    fade: float = 0.0
    clump: float = 0.4
    clump_mm: float = 9.0
    rope_mm: float = 0.0
    braid: bool = False
    tie_mm: tuple[float, float, float] = _NO_TIE
    coil_mm: float = 0.0
    crown: float = 0.0
    women: float = 0.0
    men: float = 0.0
    tight: bool = False
    loose: bool = True


@cache
def styles() -> dict[str, Style]:
    """Return the hair styles by name."""
    text = resources.files(__package__).joinpath("styles.toml").read_text("utf-8")
    rows = tomllib.loads(text)
    return {name: Style(**{**row, "tie_mm": tuple(row.get("tie_mm", _NO_TIE))}) for name, row in rows.items()}


BEARD = Style(
    "beard", max_length_mm=150.0, length_mm=10.0, lift=1.0, volume_mm=5.0, gravity=0.35, clump_mm=4.0
)
"""Style of beards, which are combed down."""
