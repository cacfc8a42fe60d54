"""`dermis compare HEAD`: techniques against a truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.cli.console import print_json, print_lines, working_on
from dermis.cli.options import check, parse_size

if TYPE_CHECKING:
    from dermis.comparison.compare import Comparison


TECHNIQUES = "none,one-blur,gpu-gems-3,texture-space,screen-space,pre-integrated"


def choose(given: Mapping[str, Any]) -> dict[str, Any]:
    """What `dermis.comparison.compare` is asked for.

    given : options of `compare` by parameter, those left out not among them
    """
    from dermis.comparison.scenes import usual_region
    from dermis.scene import Settings

    sizes: dict[str, Any] = {
        "size": parse_size(given.get("size", "256x256")),
        "atlas": given.get("atlas", 1024),
    }
    names = [name.strip() for name in given.get("techniques", TECHNIQUES).split(",")]
    for name in names:
        check(Settings, sizes | {"technique": name}, {"technique": "techniques"})
    light = given.get("light", "front")
    return {
        "against": given.get("against", "surface-integral"),
        "techniques": names,
        "light": light,
        "region": given.get("region", usual_region(light)),
        "medium": given.get("medium", "skin1"),
        "direction": given.get("direction", "lambertian"),
        "settings": Settings(**sizes),
        "samples": given.get("samples", 64),
        "adapter": given["adapter"],
    }


def compare_techniques(head: str, chosen: dict[str, Any], output: Path | None, as_json: bool) -> None:
    """Render a head with each technique, judge it by a truth, print and write what came of it."""
    from dermis.comparison.compare import check_choices, compare
    from dermis.comparison.report import write_report
    from dermis.outputs import check_output
    from dermis.scene.heads import load_head

    check_choices(*(chosen[option] for option in ("against", "light", "region", "medium")))
    if output is not None:
        check_output(output, (".html",), "Choose such a name")
    with working_on("comparing"):
        made = compare(load_head(head), **chosen)
    if output is not None:
        write_report(output, made)
    if as_json:
        print_json(_report(made))
    else:
        print_lines(*_lines(made))


def _report(made: Comparison) -> dict[str, Any]:
    return {
        "title": made.title,
        "adapter": made.adapter,
        "truth": {"seconds": made.truth.seconds, "notes": list(made.truth.notes)},
        "rows": [asdict(row) for row in made.rows],
    }


def _lines(made: Comparison) -> Sequence[str]:
    from dermis.comparison.report import cells

    lines = [
        f"{made.title}; times on {made.adapter}",
        f"against {made.against}, {made.truth.seconds:.0f} s: {'; '.join(made.truth.notes)}",
        "",
        f"{'technique':18}{'relative RMSE':>20}{'FLIP':>8}{'energy ratio':>20}{'ms':>9}",
    ]
    for row in made.rows:
        name, error, flip, energy, ms = cells(row)
        lines.append(f"{name:18}{error:>20}{flip:>8}{energy:>20}{ms:>9}")
    return lines
