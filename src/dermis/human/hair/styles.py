"""Hair styles: parameters by which guide hairs are combed and cut, read from styles.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Literal

_NO_TIE = 0.0, 0.0, 0.0
Comb = Literal["up", "fall", "back", "rows", "gather", "twist", "beard"]
BeardArea = Literal["all", "lip", "chin"]


@dataclass(frozen=True)
class Style:
    """Hair style, described by parameters on the average person.

    comb : name of the direction field along which guide hairs are combed
    max_length_mm : length of the guides
    length_mm : usual length of the hair, which `HairLook` may replace
    tilt : tangent of the angle between standing hair and the normal of the skin
    lift : tangent of the angle between combed hair and the skin at the root
    parting_mm : x coordinate of the parting in the hair
    volume_mm : height of the outermost hair above the skin
    stiffness : weight of the previous direction of a guide, against gravity, in each step of growth
    gravity : strength of gravity
    cut_y_mm : height at which hair is cut level; None for hair that is not cut level
    fringe_y_mm : height at which hair over the forehead is cut; None for a style without a fringe
    round : distance from the skull to the ellipsoid at which standing hair is cut, as an approximate fraction
        of `max_length_mm`, 0 to 1; 0 for no such cut
    layers : largest random shortening of strands, as a fraction of their length
    fade : usual shortening of the hair at the sides and the nape, 0 to 1, which `HairLook` may replace
    clump : pull of strands towards the middle of their clump, 0 to 1
    clump_mm : size of the clumps
    rope_mm : radius of the ropes into which hair is twisted or braided; 0 for loose hair
    braid : whether ropes are braids of three bundles instead of twists
    tie_mm : (3,) position of the hair tie of a ponytail or bun, relative to the midpoint between the eyes
    coil_mm : radius of the bun; 0 for a ponytail
    crown : smallest recession of the hair at crown and temples, 0 to 1; a larger recession in `SkinLook`
        takes precedence
    women, men : relative probabilities of the style among women and among men
    tight : whether tightly coiled hair is worn in this style
    loose : whether hair that is not tightly coiled is worn in this style
    area : part of the face that a beard covers: "all" of it, above the upper "lip", or that and the "chin"
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
    area: BeardArea = "all"


@cache
def styles() -> dict[str, Style]:
    """Return a dictionary from name to hair style."""
    text = resources.files(__package__).joinpath("styles.toml").read_text("utf-8")
    rows = tomllib.loads(text)
    return {name: Style(**{**row, "tie_mm": tuple(row.get("tie_mm", _NO_TIE))}) for name, row in rows.items()}


@cache
def beard_styles() -> dict[str, Style]:
    """Return a dictionary from name to beard style; `Style.area` is the part of the face that it covers."""
    combed = Style(
        "beard",
        max_length_mm=150.0,
        length_mm=10.0,
        lift=0.5,
        volume_mm=3.0,
        gravity=0.4,
        layers=0.35,
        fade=0.65,
        clump=0.15,
        clump_mm=3.0,
    )
    return {
        "stubble": replace(combed, length_mm=1.0),
        "short": replace(combed, length_mm=7.0),
        "full": replace(combed, length_mm=28.0),
        "moustache": replace(combed, length_mm=9.0, area="lip"),
        "goatee": replace(combed, length_mm=14.0, area="chin"),
    }
