"""Prints the tables of docs/engines.md on Blender: python benchmarks/engines_blender_table.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).with_name("results") / "engines_blender.json"
EDGES = (
    "| method | skin | 4.5 against predicted | 5.2 against predicted | noise | 5.2 against the profile"
    " | typed in | light returned |\n|---|---|---|---|---|---|---|---|"
)
HEADS = """\
| Blender | method | outline [px] | lit skin, theirs over ours | relative RMSE | without highlights |
|---|---|---|---|---|---|"""


def tables() -> str:
    """Edges, and heads."""
    found = json.loads(RESULTS.read_text("utf-8"))
    return "\n".join([EDGES, *_edges(found["edges"]), "", HEADS, *_heads(found["heads"])]) + "\n"


def _edges(edges: list[dict[str, Any]]) -> list[str]:
    by = {(one["version"][:3], one["method"], one["skin"]): one for one in edges}
    lines = []
    for (version, method, skin), new in by.items():
        if version != "5.2":
            continue
        old = by["4.5", method, skin]
        cells = [_three(old["against_predicted"]), _three(new["against_predicted"]), _three(new["noise"])]
        cells += [_three(new[name]) for name in ("against_true", "typed_in", "energy")]
        lines.append(f"| {method} | {skin} | {' | '.join(cells)} |")
    return lines


def _heads(heads: list[dict[str, Any]]) -> list[str]:
    return [
        f"| {one['version']} | {one['method']} | {one['outline_px']:.1f} | {_three(one['lit_colour'])} |"
        f" {one['relative_rmse']:.3f} | {one['without_highlights']:.3f} |"
        for one in heads
    ]


def _three(values: list[float]) -> str:
    return " / ".join(f"{value:.3f}" for value in values)


if __name__ == "__main__":
    print(tables())  # noqa: T201
