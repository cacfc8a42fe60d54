"""What the shaders that paint a human's skin share with Python: names and numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from dermis.gpu.wgsl_source import Member
from dermis.human.skin.detail import TILE_MM
from dermis.human.skin.face import AMOUNTS, DEGREES, sizes
from dermis.human.skin.movements import FOLDING
from dermis.human.skin.textures import DOTS, GROUNDS, NOISES, WANDERING, noise_table

_NAMES: dict[str, Sequence[str]] = {
    "noises": [noise.name for noise in NOISES],
    "dots": [dots.name for dots in DOTS],
    "amounts": list(AMOUNTS),
    "grounds": list(GROUNDS),
}


def texture_names() -> Mapping[str, Callable[[], Sequence[Member]]]:
    """Lists of the names of noises, dots, amounts and grounds, numbered in order."""
    return {name: _members(names) for name, names in _NAMES.items()}


def painting_numbers() -> dict[str, float]:
    """Numbers that the shaders fill in."""
    names = {name: len(names) for name, names in _NAMES.items()}
    own = {"degrees": float(DEGREES), "tile_mm": TILE_MM, "folding": FOLDING}
    rows = {"noise_rows": len(noise_table()), "wander_rows": WANDERING, "amount_rows": len(AMOUNTS) // 4}
    return own | names | sizes() | rows


def _members(names: Sequence[str]) -> Callable[[], Sequence[Member]]:
    return lambda: [Member(name, Path()) for name in names]
