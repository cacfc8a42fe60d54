"""`dermis bench`: how fast the frame is on this machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_report, progress
from dermis.cli.head_options import HEAD_OPTION_NAMES, FileOptions, check_head
from dermis.cli.options import NO_OPTIONS, Adapter, Json, Output, refuse_options

if TYPE_CHECKING:
    from dermis.apps.validation.benchmarks.run import Benchmark


def bench(
    *,
    preset: Literal["film", "interactive", "cpu"] | None = None,
    head: str = "auto",
    file: FileOptions = NO_OPTIONS,
    output: Output = None,
    adapter: Adapter = "auto",
    as_json: Json = False,
) -> int:
    """Measure the frame, stage by stage, at several sizes, beside what the memory's speed would allow.

    Camera and lights move and everything is computed anew. The passes of 2007 are measured in the same run,
    in compute and as fragments. A frame that the adapter cannot hold is left out, and told with its reason.

    A GPU's time of a stage is that of a pass of its own; the time of a whole frame, on the device, is that of
    frames whose stages share one pass, as they do when nobody asks, and less than the sum of its stages.

    Examples:

        dermis bench

        dermis bench --preset film --head lee_perry_smith -o report.html

        dermis bench --head head.obj --unit-mm 100 --colour skin.png

        dermis bench --preset cpu --adapter cpu --json

    Parameters
    ----------
    preset:
        interactive (around 1920x1080, atlas 2048), film (around 3840x2160, atlas 4096), or cpu (around
        1024x1024; some minutes on two cores) [by the adapter].
    head:
        auto (the scan lee_perry_smith when it is here, else human), or what `dermis render` takes.
    output:
        HTML report with plots.
    """
    from dermis.apps.validation.benchmarks.cases import PRESETS
    from dermis.apps.validation.benchmarks.report import as_json as to_json
    from dermis.apps.validation.benchmarks.report import write_report
    from dermis.apps.validation.benchmarks.run import run
    from dermis.base.atomic_write import check_output
    from dermis.base.extras import needed
    from dermis.formats.samples import cached
    from dermis.gpu.adapters import select_adapters

    if output is not None:
        check_output(output, (".html",), "Choose such a name")
        needed("matplotlib", "the report's plots")
    name = head
    if head == "auto":
        refuse_options(file, HEAD_OPTION_NAMES, "without a file", "Add --head")
        name = "lee_perry_smith" if cached("lee_perry_smith") else "human"
    check_head(head, file)
    software = select_adapters(adapter)[0][0].kind == "CPU"
    cases = PRESETS[preset or ("cpu" if software else "interactive")].cases()
    with progress("measuring") as tell:
        made = run(cases, name, adapter, tell, file)
    print_report(as_json, to_json(made), lambda: _lines(made))
    if output is not None:  # last: where it cannot be written any more, the figures are not lost
        write_report(output, made)
    return 0


def _lines(made: Benchmark) -> list[str]:
    from dermis.apps.validation.benchmarks.report import (
        COLUMNS,
        cells,
        left_out_lines,
        published_text,
        stage_table,
        summary,
    )

    rows, stages = _aligned([COLUMNS, *map(cells, made.rows)]), _aligned(stage_table(made))
    usual = ["", "the usual frame:", *stages] if stages else []
    published = ["", text] if (text := published_text(made)) else []
    return [summary(made), "", *rows, *left_out_lines(made), *usual, *published]


def _aligned(table: Sequence[tuple[str, ...]]) -> list[str]:
    """Lines of a table whose columns end at the same place."""
    wide = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(row, wide, strict=True)) for row in table]
