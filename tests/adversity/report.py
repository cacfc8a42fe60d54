"""Results of a campaign as a table or as JSON."""

from __future__ import annotations

from typing import Any

from adversity.campaign import Tally
from adversity.case import ACCEPTED, FAILURES, REFUSED

_SHOWN = 100  # letters of a place


def as_json(tally: Tally, seed: int, seconds: float) -> dict[str, Any]:
    """Return all results."""
    return {
        "seed": seed,
        "seconds": round(seconds, 1),
        "inputs": sum(sum(one.values()) for one in tally.counts.values()),
        "failures": tally.failures,
        "kinds": {kind: dict(one) for kind, one in tally.counts.items()},
        "places": [
            {"kind": kind, "outcome": outcome, "place": place, "kept": kept}
            for (kind, outcome, place), kept in tally.places.items()
        ],
    }


def as_text(tally: Tally, seed: int, seconds: float) -> str:
    """Return a row per kind of input, then the locations of failures with inputs that show them."""
    columns = (ACCEPTED, REFUSED, *FAILURES)
    rows = [("", "tried", *columns)]
    for kind, one in tally.counts.items():
        rows.append((kind, str(sum(one.values())), *(str(one[column]) for column in columns)))
    whole = [sum(one[column] for one in tally.counts.values()) for column in columns]
    rows.append(("all", str(sum(whole)), *map(str, whole)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(_cells(row, widths)) for row in rows]
    lines.append(f"seed {seed}, {seconds:.0f} s, {tally.failures} failures at {len(tally.places)} places")
    for (kind, outcome, place), kept in sorted(tally.places.items()):
        lines.append(f"{kind}: {outcome}: {place[:_SHOWN]}  ({', '.join(kept)})")
    return "\n".join(lines)


def _cells(row: tuple[str, ...], widths: list[int]) -> list[str]:
    return [
        f"{row[0]:<{widths[0]}}",
        *(f"{one:>{width}}" for one, width in zip(row[1:], widths[1:], strict=True)),
    ]
