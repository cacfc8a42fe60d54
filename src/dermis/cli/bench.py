"""`dermis bench`: how fast the frame is on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.cli.console import print_json, print_lines, progress
from dermis.cli.options import Json

if TYPE_CHECKING:
    from dermis.benchmark.run import Benchmark


def bench(
    *,
    preset: Literal["film", "interactive", "cpu"] | None = None,
    head: str = "auto",
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    adapter: str = "auto",
    as_json: Json = False,
) -> int:
    """Measure the frame, stage by stage, at several sizes, beside what the memory's speed would allow.

    Camera and lights move and everything is computed anew. The passes of 2007 are measured in the same run.

    Examples:

        dermis bench

        dermis bench --preset film --head lee_perry_smith -o report.html

        dermis bench --preset cpu --adapter cpu --json

    Parameters
    ----------
    preset:
        interactive (around 1920x1080, atlas 2048), film (around 3840x2160, atlas 4096), or cpu (around
        512x512; some minutes on two cores) [by the adapter].
    head:
        auto (the scan lee_perry_smith when it is here, else bust), or what `dermis render` takes.
    output:
        HTML report with plots.
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    as_json:
        Print one JSON object.
    """
    from dermis.benchmark.cases import PRESETS
    from dermis.benchmark.report import as_json as to_json
    from dermis.benchmark.report import write_report
    from dermis.benchmark.run import run
    from dermis.gpu.adapters import fitting_adapters
    from dermis.outputs import check_output

    if output is not None:
        check_output(output, (".html",), "Choose such a name")
    software = fitting_adapters(adapter)[0][0].kind == "CPU"
    cases = PRESETS[preset or ("cpu" if software else "interactive")].cases()
    with progress("measuring") as tell:
        made = run(cases, _head(head), adapter, tell)
    if output is not None:
        write_report(output, made)
    if as_json:
        print_json(to_json(made))
    else:
        print_lines(*_lines(made))
    return 0


def _head(name: str) -> str:
    from dermis.assets.samples import cached

    if name != "auto":
        return name
    return "lee_perry_smith" if cached("lee_perry_smith") else "bust"


def _lines(made: Benchmark) -> list[str]:
    from dermis.benchmark.report import COLUMNS, cells, stage_cells, summary

    rows = [COLUMNS, *map(cells, made.rows)]
    wide = [max(len(row[k]) for row in rows) for k in range(len(COLUMNS))]
    table = ["  ".join(cell.rjust(width) for cell, width in zip(row, wide, strict=True)) for row in rows]
    shown = [("stage", "device [ms]", "floor [ms]", "ratio"), *stage_cells(made.usual)]
    stages = [f"{a:14}{b:>12}{c:>12}{d:>8}" for a, b, c, d in shown]
    ratio = made.published_ratio
    note = [] if ratio is None else ["", f"the passes of 2007 take {ratio:.2f} times the usual frame"]
    return [summary(made), "", *table, "", "the usual frame:", *stages, *note]
