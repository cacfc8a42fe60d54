"""The command `dermis bench`: frame times on this machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_report, progress_bar
from dermis.cli.head_options import HEAD_OPTION_NAMES, FileOptions, check_head_options
from dermis.cli.options import NO_OPTIONS, AdapterOption, JsonOption, OptionalOutputPath, refuse_options

if TYPE_CHECKING:
    from dermis.apps.validation.benchmarks.run import Benchmark


def bench(
    *,
    preset: Literal["film", "interactive", "cpu"] | None = None,
    head: str = "auto",
    file: FileOptions = NO_OPTIONS,
    output: OptionalOutputPath = None,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Measure the time of each stage of a frame, and compare it with the limit set by memory bandwidth.

    Camera and lights move between frames, and every frame is computed from scratch. The passes of GPU Gems 3
    (2007) are measured in the same run, both as compute shaders and as fragment shaders. Frames that exceed
    the limits of the adapter are skipped and listed with the reason.

    To measure the GPU time of each stage, every stage runs in a separate pass. To measure a whole frame, all
    stages share one pass, as in normal use; the time of a frame is therefore less than the sum of its stages.

    Examples:

        dermis bench

        dermis bench --preset film --head lee_perry_smith -o report.html

        dermis bench --head head.obj --unit-mm 100 --colour skin.png

        dermis bench --preset cpu --adapter cpu --json

    Parameters
    ----------
    preset:
        interactive (around 1920x1080, atlas 2048), film (around 3840x2160, atlas 4096), or cpu (around
        1024x1024; takes minutes on two cores). [default: depends on the adapter]
    head:
        auto (the scan lee_perry_smith if it has been downloaded, else human), or any head that `dermis
        render` accepts.
    output:
        HTML file to write: a report with plots.
    as_json:
        Print one JSON object with all timings.
    """
    from dermis.apps.validation.benchmarks.cases import BENCHMARK_PRESETS
    from dermis.apps.validation.benchmarks.report import benchmark_json as to_json
    from dermis.apps.validation.benchmarks.report import write_report
    from dermis.apps.validation.benchmarks.run import run_benchmark
    from dermis.base.atomic_write import check_output
    from dermis.base.extras import import_extra
    from dermis.formats.samples import is_available
    from dermis.gpu.adapters import select_adapters

    if output is not None:
        check_output(output, (".html",), "Choose such a name")
        import_extra("matplotlib", "the report's plots")
    name = head
    if head == "auto":
        refuse_options(file, HEAD_OPTION_NAMES, "without a file", "Add --head")
        name = "lee_perry_smith" if is_available("lee_perry_smith") else "human"
    check_head_options(head, file)
    is_software = select_adapters(adapter)[0][0].kind == "CPU"
    cases = BENCHMARK_PRESETS[preset or ("cpu" if is_software else "interactive")].cases()
    with progress_bar("measuring") as report_progress:
        benchmark = run_benchmark(cases, name, adapter, report_progress, file)
    print_report(as_json, to_json(benchmark), lambda: _report_lines(benchmark))
    if output is not None:  # last: the figures are printed even if the report cannot be written
        write_report(output, benchmark)
    return 0


def _report_lines(benchmark: Benchmark) -> list[str]:
    from dermis.apps.validation.benchmarks import report

    rows = _align_columns([report.COLUMNS, *map(report.row_cells, benchmark.rows)])
    stages = _align_columns(report.stage_table(benchmark))
    default_lines = ["", "the default frame:", *stages] if stages else []
    published_lines = ["", text] if (text := report.gpu_gems_3_text(benchmark)) else []
    table_lines = [*rows, *report.skipped_lines(benchmark)]
    return [report.summary_line(benchmark), "", *table_lines, *default_lines, *published_lines]


def _align_columns(table_rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return the rows of a table as lines of text with right-aligned columns."""
    widths = [max(map(len, column)) for column in zip(*table_rows, strict=True)]
    return [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in table_rows
    ]
