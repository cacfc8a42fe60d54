"""Report of a benchmark as JSON, as lines of text, and as an HTML file with plots."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib import resources
from io import StringIO
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3, BenchmarkCase
from dermis.apps.validation.benchmarks.measure import BenchmarkRow
from dermis.apps.validation.benchmarks.run import Benchmark
from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file
from dermis.base.extras import import_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


def benchmark_json(benchmark: Benchmark) -> JsonObject:
    """Return the benchmark as a JSON object, with times in milliseconds."""
    return {
        "head": benchmark.head,
        "adapter": benchmark.adapter,
        "driver": benchmark.driver,
        "versions": benchmark.versions,
        "date": benchmark.date,
        "seconds": benchmark.seconds,
        "copy_gb_s": benchmark.copy_bytes_s / 1e9,
        "published_ratio": benchmark.relative_time(GPU_GEMS_3),
        "published_fragments_ratio": benchmark.relative_time(FRAGMENT_TECHNIQUE),
        "rows": [_row_json(row) for row in benchmark.rows],
        "left_out": [{**_case_json(one.case), "reason": one.reason} for one in benchmark.skipped],
    }


def _case_json(case: BenchmarkCase) -> JsonObject:
    return asdict(case) | {"image": list(case.image)}


def _row_json(benchmark_row: BenchmarkRow) -> JsonObject:
    parts = {
        **_case_json(benchmark_row.case),
        **asdict(benchmark_row),
        "floor_ratio": benchmark_row.floor_ratio,
    }
    del parts["case"]
    return parts


_PUBLISHED_COLUMNS = {GPU_GEMS_3: "2007, compute [ms]", FRAGMENT_TECHNIQUE: "2007, fragments [ms]"}
_CASE_COLUMNS = ("image", "atlas", "Gaussians", "lights", "environment", "targets", "triangles", "technique")
_TIME_COLUMNS = ("frame [ms]", "device [ms]", "floor [ms]", "ratio", "Python [ms]", "image out [ms]")
COLUMNS = (*_CASE_COLUMNS, *_TIME_COLUMNS, "memory [MB]")


def row_cells(benchmark_row: BenchmarkRow) -> tuple[str, ...]:
    """Return a row's parameters and measurements as table cells, in the order of COLUMNS."""
    case, device = (
        benchmark_row.case,
        (benchmark_row.gpu_ms["total"], benchmark_row.floor_ms["total"], benchmark_row.floor_ratio),
    )
    return (
        f"{case.image[0]}x{case.image[1]}",
        str(case.atlas),
        str(case.gaussians),
        str(case.lights),
        case.environment or "-",
        str(case.targets or "-"),
        str(benchmark_row.triangles),
        case.technique,
        *map(
            format_three_digits,
            (benchmark_row.frame_ms, *device, benchmark_row.python_ms, benchmark_row.image_ms),
        ),
        f"{benchmark_row.memory_mb:.0f}",
    )


def stage_table(benchmark: Benchmark) -> list[tuple[str, ...]]:
    """Return a table of the stages of the base case, with column titles as its first row.

    The base case is the frame from which all other cases differ in one parameter. Each row has the name of a
    stage, the device time of this stage, the lower bound of this time, and the ratio of the two. Further
    columns have the device time of this stage when the frame is drawn with the passes of GPU Gems 3.
    """
    if benchmark.base_row is None:
        return []
    base_row = benchmark.base_row
    other_rows = {title: benchmark.row_with_technique(name) for name, title in _PUBLISHED_COLUMNS.items()}
    other_times = {title: row.gpu_ms for title, row in other_rows.items() if row}
    table = [("stage", "device [ms]", "floor [ms]", "ratio", *other_times)]
    for stage, ms in base_row.gpu_ms.items():
        floor = base_row.floor_ms.get(stage)
        floor_cells = (format_three_digits(floor), f"{ms / floor:.1f}") if floor else ("-", "-")
        others = (times.get(stage) for times in other_times.values())
        other_cells = ("-" if time is None else format_three_digits(time) for time in others)
        table.append((stage, format_three_digits(ms), *floor_cells, *other_cells))
    return table


def gpu_gems_3_text(benchmark: Benchmark) -> str:
    """Return a sentence on how much longer a frame takes with the passes of GPU Gems 3.

    The frame is that of the base case, from which all other cases differ in one parameter. The text is empty
    if these passes were not measured.
    """
    names = {GPU_GEMS_3: "as compute", FRAGMENT_TECHNIQUE: "as fragments"}
    ratios = {form: benchmark.relative_time(name) for name, form in names.items()}
    parts = [f"{ratio:.2f} times as long {form}" for form, ratio in ratios.items() if ratio is not None]
    return f"With the passes of 2007 it takes {' and '.join(parts)}." if parts else ""


def skipped_lines(benchmark: Benchmark) -> list[str]:
    """Return lines about cases that could not be measured, with reasons."""
    return [f"skipped: {_case_text(one.case)}: {one.reason}" for one in benchmark.skipped]


def _case_text(case: BenchmarkCase) -> str:
    width, height = case.image
    sizes = f"{width}x{height}, atlas {case.atlas}, {case.gaussians} Gaussians, {case.lights} lights"
    environment_text = f", environment {case.environment}" if case.environment else ""
    target_text = f", {case.targets} targets" if case.targets else ""
    return f"{sizes}{environment_text}{target_text}, subdivided {case.subdivide} times, {case.technique}"


def summary_line(benchmark: Benchmark) -> str:
    """Return a line of text that names the adapter, the head, the date and the library versions."""
    versions = ", ".join(f"{name} {number}" for name, number in benchmark.versions.items())
    return (
        f"{benchmark.adapter} ({benchmark.driver}), {benchmark.head}, {benchmark.date}; {versions}; "
        f"a copy moves {benchmark.copy_bytes_s / 1e9:.4g} GB/s"
    )


def write_report(path: Path, benchmark: Benchmark) -> None:
    """Write tables and plots to an HTML file, atomically.

    Raises DermisError when the file cannot be written.
    """
    text = Template((resources.files(__package__) / "report.html").read_text(encoding="utf-8"))
    page = text.substitute(
        summary=html.escape(summary_line(benchmark)),
        published=gpu_gems_3_text(benchmark),
        rows=_table_html([COLUMNS, *(row_cells(row) for row in benchmark.rows)]),
        skipped="".join(f"<p>{html.escape(line)}</p>" for line in skipped_lines(benchmark)),
        stages=_table_html(stage_table(benchmark)),
        bars=stage_bars(benchmark.base_row) if benchmark.base_row else "",
        scaling=scaling_plots(benchmark),
    )
    with atomic_file(path) as output:
        output.write_text(page, encoding="utf-8")


def _table_html(table_rows: Sequence[tuple[str, ...]]) -> str:
    """Return an HTML table whose first row has the column titles."""
    rows = []
    for index, line in enumerate(table_rows):
        tag = "td" if index else "th"
        rows.append("".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in line))
    return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


_TEXT_COLOUR, _TOTAL_COLOUR, _FLOOR_COLOUR = "#c8c8d0", "#e8a87c", "#6fb3b8"
_SCALING_AXES: dict[str, tuple[str, Callable[[BenchmarkRow], float]]] = {
    "image": ("image [megapixel]", lambda row: row.case.image[0] * row.case.image[1] / 1e6),
    "atlas": ("side of the atlas [texel]", lambda row: row.case.atlas),
    "gaussians": ("Gaussians", lambda row: row.case.gaussians),
    "lights": ("lights with shadows", lambda row: row.case.lights),
    "subdivide": ("triangles [thousand]", lambda row: row.triangles / 1e3),
}


def format_three_digits(number: float) -> str:
    """Return a number as text with three significant digits, without an exponent."""
    return f"{number:.0f}" if number >= 1000 else f"{number:.3g}"


def scaling_plots(benchmark: Benchmark) -> str:
    """Return SVG plots of device time and its lower bound, one for each parameter that the cases vary."""
    axes_names = [name for name in _SCALING_AXES if any(row.case.varies == name for row in benchmark.rows)]
    if not axes_names:
        return ""
    figure, panels = _figure(
        width_inches=3.4 * len(axes_names), height_inches=2.9, column_count=len(axes_names)
    )
    for axes, name in zip(panels, axes_names, strict=True):
        label, value = _SCALING_AXES[name]
        rows = sorted((row for row in benchmark.rows if row.case.varies in ("", name)), key=value)
        x = [value(row) for row in rows]
        axes.plot(x, [row.gpu_ms["total"] for row in rows], "o-", color=_TOTAL_COLOUR, label="device", ms=4)
        axes.plot(x, [row.floor_ms["total"] for row in rows], "s--", color=_FLOOR_COLOUR, label="floor", ms=3)
        axes.set(xlabel=label, xscale="log", yscale="log")
        _set_ticks(axes.xaxis, x)
        _set_ticks(axes.yaxis, None)
    panels[0].set_ylabel("ms per frame")
    panels[0].legend(frameon=False, labelcolor=_TEXT_COLOUR, fontsize=8)
    return _figure_svg(figure)


def stage_bars(benchmark_row: BenchmarkRow) -> str:
    """Return an SVG bar chart of device time and its lower bound by stage."""
    names = [stage for stage in benchmark_row.gpu_ms if stage != "total"]
    figure, (axes,) = _figure(width_inches=7.0, height_inches=0.34 * len(names) + 0.9, column_count=1)
    positions = range(len(names))
    axes.barh(
        positions, [benchmark_row.gpu_ms[name] for name in names], 0.7, color=_TOTAL_COLOUR, label="device"
    )
    axes.barh(
        positions,
        [benchmark_row.floor_ms.get(name, 0.0) for name in names],
        0.3,
        color=_FLOOR_COLOUR,
        label="floor",
    )
    axes.set_yticks(positions, names)
    axes.invert_yaxis()
    axes.set_xlabel("ms")
    axes.legend(frameon=False, labelcolor=_TEXT_COLOUR, fontsize=8)
    return _figure_svg(figure)


def _figure(width_inches: float, height_inches: float, column_count: int) -> tuple[Figure, list[Axes]]:
    figure = import_extra("matplotlib.figure", "plots").Figure(
        figsize=(width_inches, height_inches), layout="constrained"
    )
    figure.patch.set_alpha(0.0)
    panels = list(figure.subplots(1, column_count, squeeze=False)[0])
    for axes in panels:
        axes.patch.set_alpha(0.0)
        axes.tick_params(colors=_TEXT_COLOUR, labelsize=8, which="both")
        axes.xaxis.label.set_color(_TEXT_COLOUR)
        axes.yaxis.label.set_color(_TEXT_COLOUR)
        axes.grid(alpha=0.2, linewidth=0.5)
        for spine in axes.spines.values():
            spine.set_visible(False)
    return figure, panels


def _set_ticks(axis: Axis, tick_positions: list[float] | None) -> None:
    """Label an axis with plain numbers, at the given positions or at 1, 2 and 5 times powers of ten."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(
        FixedLocator(tick_positions) if tick_positions else LogLocator(subs=(1.0, 2.0, 5.0))
    )
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: format_three_digits(value)))


def _figure_svg(figure: Figure) -> str:
    from matplotlib import rc_context

    svg = StringIO()
    with rc_context({"svg.hashsalt": "dermis", "svg.fonttype": "none"}):
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return svg.getvalue().partition("<svg")[2].join(("<svg", ""))
