"""A benchmark as JSON, as lines of text, and as one HTML file that needs nothing else."""

from __future__ import annotations

import html
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from dermis.benchmark.cases import FRAGMENTS, GPU_GEMS_3, Case
from dermis.benchmark.measure import Row
from dermis.benchmark.plots import plain
from dermis.benchmark.run import Benchmark
from dermis.outputs import replacing


def as_json(made: Benchmark) -> dict[str, Any]:
    """The benchmark as one JSON-ready object; times in ms."""
    return {
        "head": made.head,
        "adapter": made.adapter,
        "driver": made.driver,
        "versions": made.versions,
        "date": made.date,
        "seconds": made.seconds,
        "copy_gb_s": made.copied / 1e9,
        "published_ratio": made.ratio(GPU_GEMS_3),
        "published_fragments_ratio": made.ratio(FRAGMENTS),
        "rows": [_row(row) for row in made.rows],
        "left_out": [{**_case(one.case), "reason": one.reason} for one in made.left_out],
    }


def _case(case: Case) -> dict[str, Any]:
    return {
        "image": list(case.image),
        "atlas": case.atlas,
        "gaussians": case.gaussians,
        "lights": case.lights,
        "environment": case.environment,
        "subdivide": case.subdivide,
        "samples": case.samples,
        "technique": case.technique,
        "varies": case.varies,
    }


def _row(row: Row) -> dict[str, Any]:
    return {
        **_case(row.case),
        "adapter": row.adapter,
        "triangles": row.triangles,
        "frame_ms": row.frame_ms,
        "gpu_ms": row.gpu_ms,
        "floor_ms": row.floor_ms,
        "floor_ratio": row.floor_ratio,
        "python_ms": row.python_ms,
        "image_ms": row.image_ms,
        "memory_mb": row.memory_mb,
    }


_OTHERS = {GPU_GEMS_3: "2007, compute [ms]", FRAGMENTS: "2007, fragments [ms]"}
_CASE = ("image", "atlas", "Gaussians", "lights", "around", "triangles", "technique")
_TIMES = ("frame [ms]", "device [ms]", "floor [ms]", "ratio", "Python [ms]", "image out [ms]")
COLUMNS = (*_CASE, *_TIMES, "memory [MB]")


def cells(row: Row) -> tuple[str, ...]:
    """A row's figures as they are printed, in the order of COLUMNS."""
    case = row.case
    times = (row.frame_ms, row.gpu_ms["total"], row.floor_ms["total"], row.floor_ratio)
    rest = (row.python_ms, row.image_ms)
    return (
        f"{case.image[0]}x{case.image[1]}",
        str(case.atlas),
        str(case.gaussians),
        str(case.lights),
        case.environment or "-",
        str(row.triangles),
        case.technique,
        *map(plain, (*times, *rest)),
        f"{row.memory_mb:.0f}",
    )


def stage_table(made: Benchmark) -> list[tuple[str, ...]]:
    """The usual frame by stage, titles first: device time, floor, their ratio, and what 2007 took."""
    if made.usual is None:
        return []
    usual, others = made.usual, [row for name in _OTHERS if (row := made.row_of(name))]
    shown = [name for name in _OTHERS if made.row_of(name)]
    table = [("stage", "device [ms]", "floor [ms]", "ratio", *(_OTHERS[name] for name in shown))]
    for stage, ms in usual.gpu_ms.items():
        floor = usual.floor_ms.get(stage)
        known = (plain(floor), f"{ms / floor:.1f}") if floor else ("-", "-")
        table.append((stage, plain(ms), *known, *(_ms(row, stage) for row in others)))
    return table


def _ms(row: Row, stage: str) -> str:
    return plain(row.gpu_ms[stage]) if stage in row.gpu_ms else "-"


def published_text(made: Benchmark) -> str:
    """How much longer the passes of 2007 take, as far as that was measured."""
    names = {GPU_GEMS_3: "as compute", FRAGMENTS: "as fragments"}
    found = {said: made.ratio(name) for name, said in names.items()}
    told = [f"{ratio:.2f} times as long {said}" for said, ratio in found.items() if ratio is not None]
    return f"Drawn by the passes of 2007, it takes {' and '.join(told)}." if told else ""


def left_out_lines(made: Benchmark) -> list[str]:
    """What could not be measured, and why."""
    return [f"left out: {_told(one.case)}: {one.reason}" for one in made.left_out]


def _told(case: Case) -> str:
    width, height = case.image
    sizes = f"{width}x{height}, atlas {case.atlas}, {case.gaussians} Gaussians, {case.lights} lights"
    around = f", environment {case.environment}" if case.environment else ""
    return f"{sizes}{around}, subdivided {case.subdivide} times, {case.technique}"


def summary(made: Benchmark) -> str:
    """Where and with what, in one line."""
    versions = ", ".join(f"{name} {number}" for name, number in made.versions.items())
    return (
        f"{made.adapter} ({made.driver}), {made.head}, {made.date}; {versions}; "
        f"a copy moves {made.copied / 1e9:.4g} GB/s"
    )


def write_report(path: Path, made: Benchmark) -> None:
    """Write tables and plots, whole or not at all.

    Raises DermisError when that is not possible.
    """
    from dermis.benchmark import plots

    text = Template((resources.files("dermis.benchmark") / "report.html").read_text(encoding="utf-8"))
    page = text.substitute(
        summary=html.escape(summary(made)),
        published=published_text(made),
        rows=_table([COLUMNS, *(cells(row) for row in made.rows)]),
        left_out="".join(f"<p>{html.escape(line)}</p>" for line in left_out_lines(made)),
        stages=_table(stage_table(made)),
        bars=plots.stages(made.usual) if made.usual else "",
        scaling=plots.scaling(made),
    )
    with replacing(path) as trial:
        trial.write_text(page, encoding="utf-8")


def _table(lines: Sequence[tuple[str, ...]]) -> str:
    """The first line has the titles."""
    body = [_line(cells, "th" if number == 0 else "td") for number, cells in enumerate(lines)]
    return f"<table>{''.join(body)}</table>"


def _line(cells: tuple[str, ...], tag: str) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"
