"""A benchmark as JSON, as lines of text, and as an HTML file with plots."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib import resources
from io import StringIO
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3, Case
from dermis.apps.validation.benchmarks.measure import BenchmarkRow
from dermis.apps.validation.benchmarks.run import Benchmark
from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file
from dermis.base.extras import import_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


def as_json(made: Benchmark) -> JsonObject:
    """Return the benchmark as one JSON-ready object; times in ms."""
    return {
        "head": made.head,
        "adapter": made.adapter,
        "driver": made.driver,
        "versions": made.versions,
        "date": made.date,
        "seconds": made.seconds,
        "copy_gb_s": made.copied / 1e9,
        "published_ratio": made.ratio(GPU_GEMS_3),
        "published_fragments_ratio": made.ratio(FRAGMENT_TECHNIQUE),
        "rows": [_row_json(row) for row in made.rows],
        "left_out": [{**_case_json(one.case), "reason": one.reason} for one in made.left_out],
    }


def _case_json(case: Case) -> JsonObject:
    return asdict(case) | {"image": list(case.image)}


def _row_json(row: BenchmarkRow) -> JsonObject:
    told = {**_case_json(row.case), **asdict(row), "floor_ratio": row.floor_ratio}
    del told["case"]
    return told


_PUBLISHED_COLUMNS = {GPU_GEMS_3: "2007, compute [ms]", FRAGMENT_TECHNIQUE: "2007, fragments [ms]"}
_CASE_COLUMNS = ("image", "atlas", "Gaussians", "lights", "around", "targets", "triangles", "technique")
_TIME_COLUMNS = ("frame [ms]", "device [ms]", "floor [ms]", "ratio", "Python [ms]", "image out [ms]")
COLUMNS = (*_CASE_COLUMNS, *_TIME_COLUMNS, "memory [MB]")


def cells(row: BenchmarkRow) -> tuple[str, ...]:
    """Return a row's figures as text, in the order of COLUMNS."""
    case, device = row.case, (row.gpu_ms["total"], row.floor_ms["total"], row.floor_ratio)
    return (
        f"{case.image[0]}x{case.image[1]}",
        str(case.atlas),
        str(case.gaussians),
        str(case.lights),
        case.environment or "-",
        str(case.targets or "-"),
        str(row.triangles),
        case.technique,
        *map(three_digits, (row.frame_ms, *device, row.python_ms, row.image_ms)),
        f"{row.memory_mb:.0f}",
    )


def stage_table(made: Benchmark) -> list[tuple[str, ...]]:
    """Return rows of the usual frame by stage, titles first: device time, floor, ratio, passes of 2007."""
    if made.usual is None:
        return []
    usual = made.usual
    others = {title: row.gpu_ms for name, title in _PUBLISHED_COLUMNS.items() if (row := made.row_of(name))}
    table = [("stage", "device [ms]", "floor [ms]", "ratio", *others)]
    for stage, ms in usual.gpu_ms.items():
        floor = usual.floor_ms.get(stage)
        known = (three_digits(floor), f"{ms / floor:.1f}") if floor else ("-", "-")
        theirs = (three_digits(times[stage]) if stage in times else "-" for times in others.values())
        table.append((stage, three_digits(ms), *known, *theirs))
    return table


def published_text(made: Benchmark) -> str:
    """Return a sentence with the relative time of the passes of 2007, if that was measured."""
    names = {GPU_GEMS_3: "as compute", FRAGMENT_TECHNIQUE: "as fragments"}
    found = {said: made.ratio(name) for name, said in names.items()}
    told = [f"{ratio:.2f} times as long {said}" for said, ratio in found.items() if ratio is not None]
    return f"With the passes of 2007 it takes {' and '.join(told)}." if told else ""


def skipped_lines(made: Benchmark) -> list[str]:
    """Return lines about cases that could not be measured, with reasons."""
    return [f"left out: {_case_text(one.case)}: {one.reason}" for one in made.left_out]


def _case_text(case: Case) -> str:
    width, height = case.image
    sizes = f"{width}x{height}, atlas {case.atlas}, {case.gaussians} Gaussians, {case.lights} lights"
    around = f", environment {case.environment}" if case.environment else ""
    moving = f", {case.targets} targets" if case.targets else ""
    return f"{sizes}{around}{moving}, subdivided {case.subdivide} times, {case.technique}"


def summary(made: Benchmark) -> str:
    """Return the machine, the head, the date and the versions, in one line."""
    versions = ", ".join(f"{name} {number}" for name, number in made.versions.items())
    return (
        f"{made.adapter} ({made.driver}), {made.head}, {made.date}; {versions}; "
        f"a copy moves {made.copied / 1e9:.4g} GB/s"
    )


def write_report(path: Path, made: Benchmark) -> None:
    """Write tables and plots; the file is complete or not there.

    Raises DermisError when it cannot be written.
    """
    text = Template((resources.files(__package__) / "report.html").read_text(encoding="utf-8"))
    page = text.substitute(
        summary=html.escape(summary(made)),
        published=published_text(made),
        rows=_table([COLUMNS, *(cells(row) for row in made.rows)]),
        left_out="".join(f"<p>{html.escape(line)}</p>" for line in skipped_lines(made)),
        stages=_table(stage_table(made)),
        bars=stage_bars(made.usual) if made.usual else "",
        scaling=scaling(made),
    )
    with atomic_file(path) as trial:
        trial.write_text(page, encoding="utf-8")


def _table(lines: Sequence[tuple[str, ...]]) -> str:
    """Return an HTML table whose first line has the titles."""
    rows = []
    for number, line in enumerate(lines):
        tag = "td" if number else "th"
        rows.append("".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in line))
    return "<table>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


_TEXT, _TOTAL, _FLOOR = "#c8c8d0", "#e8a87c", "#6fb3b8"
_AXES: dict[str, tuple[str, Callable[[BenchmarkRow], float]]] = {
    "image": ("image [megapixel]", lambda row: row.case.image[0] * row.case.image[1] / 1e6),
    "atlas": ("side of the atlas [texel]", lambda row: row.case.atlas),
    "gaussians": ("Gaussians", lambda row: row.case.gaussians),
    "lights": ("lights with shadows", lambda row: row.case.lights),
    "subdivide": ("triangles [thousand]", lambda row: row.triangles / 1e3),
}


def three_digits(number: float) -> str:
    """Return three significant digits without an exponent."""
    return f"{number:.0f}" if number >= 1000 else f"{number:.3g}"


def scaling(made: Benchmark) -> str:
    """Return the device time and floor over each size that was varied, as SVG text."""
    varied = [name for name in _AXES if any(row.case.varies == name for row in made.rows)]
    if not varied:
        return ""
    figure, panels = _figure(width=3.4 * len(varied), height=2.9, columns=len(varied))
    for axes, name in zip(panels, varied, strict=True):
        label, value = _AXES[name]
        rows = sorted((row for row in made.rows if row.case.varies in ("", name)), key=value)
        across = [value(row) for row in rows]
        axes.plot(across, [row.gpu_ms["total"] for row in rows], "o-", color=_TOTAL, label="device", ms=4)
        axes.plot(across, [row.floor_ms["total"] for row in rows], "s--", color=_FLOOR, label="floor", ms=3)
        axes.set(xlabel=label, xscale="log", yscale="log")
        _set_ticks(axes.xaxis, across)
        _set_ticks(axes.yaxis, None)
    panels[0].set_ylabel("ms a frame")
    panels[0].legend(frameon=False, labelcolor=_TEXT, fontsize=8)
    return _svg(figure)


def stage_bars(row: BenchmarkRow) -> str:
    """Return the device time of each stage and its floor as bars, as SVG text."""
    names = [stage for stage in row.gpu_ms if stage != "total"]
    figure, (axes,) = _figure(width=7.0, height=0.34 * len(names) + 0.9, columns=1)
    places = range(len(names))
    axes.barh(places, [row.gpu_ms[name] for name in names], 0.7, color=_TOTAL, label="device")
    axes.barh(places, [row.floor_ms.get(name, 0.0) for name in names], 0.3, color=_FLOOR, label="floor")
    axes.set_yticks(places, names)
    axes.invert_yaxis()
    axes.set_xlabel("ms")
    axes.legend(frameon=False, labelcolor=_TEXT, fontsize=8)
    return _svg(figure)


def _figure(width: float, height: float, columns: int) -> tuple[Figure, list[Axes]]:
    figure = import_extra("matplotlib.figure", "plots").Figure(figsize=(width, height), layout="constrained")
    figure.patch.set_alpha(0.0)
    panels = list(figure.subplots(1, columns, squeeze=False)[0])
    for axes in panels:
        axes.patch.set_alpha(0.0)
        axes.tick_params(colors=_TEXT, labelsize=8, which="both")
        axes.xaxis.label.set_color(_TEXT)
        axes.yaxis.label.set_color(_TEXT)
        axes.grid(alpha=0.2, linewidth=0.5)
        for spine in axes.spines.values():
            spine.set_visible(False)
    return figure, panels


def _set_ticks(axis: Axis, places: list[float] | None) -> None:
    """Label an axis with plain numbers at the measured places, or at round ones."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(FixedLocator(places) if places else LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: three_digits(value)))


def _svg(figure: Figure) -> str:
    from matplotlib import rc_context

    drawn = StringIO()
    with rc_context({"svg.hashsalt": "dermis", "svg.fonttype": "none"}):
        figure.savefig(drawn, format="svg", metadata={"Date": None})
    return drawn.getvalue().partition("<svg")[2].join(("<svg", ""))
