"""Tables of docs/engines.md from what was measured in Mitsuba, in Babylon.js and of whole heads."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"


def rows_of(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table's lines."""
    return "".join(f"| {' | '.join(row)} |\n" for row in (heads, ["---"] * len(heads), *rows))


def three(values: Sequence[float]) -> str:
    """Red, green and blue."""
    return " / ".join(f"{value + 0.0:.3f}" for value in values)


def mitsuba() -> str:
    """Edges in Mitsuba."""
    heads = "skin", "surface", "from what was predicted", "standard error", "from the exported curve"
    told = _read("mitsuba")["edges"]
    return rows_of(heads, ([one["skin"], one["boundary"], *map(three, _differences(one))] for one in told))


def _differences(one: dict[str, Any]) -> tuple[Sequence[float], ...]:
    return one["predicted"], one["noise"], one["exported"]


def babylon() -> str:
    """Edges in Babylon.js."""
    heads = (
        "profile",
        "d [mm]",
        "nearest lobe, measured [mm]",
        "measured less its samples' prediction",
        "less true lobes",
        "less the skin's profile",
    )
    names = (
        "expected_d_mm",
        "fitted_d_mm",
        "measured_less_predicted",
        "measured_less_lobes",
        "measured_less_profile",
    )
    skins = _read("babylon")["skins"]
    return rows_of(heads, ([skin, *(three(one[name]) for name in names)] for skin, one in skins.items()))


def heads() -> str:
    """One head in all of them, against ours."""
    titles = "program", "outline [px]", "lit skin over ours", "relative RMSE", "pixels"
    return rows_of(titles, map(_head, _read("heads")["heads"]))


def _head(one: dict[str, Any]) -> list[str]:
    outline = "ours" if one["pixels_apart"] == 0 else f"{one['outline_px']:.1f}"
    return [
        one["program"],
        outline,
        three(one["lit_colour"]),
        f"{one['relative_rmse']:.3f}",
        str(one["pixels"]),
    ]


def _read(name: str) -> Any:
    return json.loads((RESULTS / f"engines_{name}.json").read_text("utf-8"))
