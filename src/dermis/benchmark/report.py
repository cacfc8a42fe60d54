"""A benchmark as JSON, as lines of text, and as one HTML file that needs nothing else."""

from __future__ import annotations

import html
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

from dermis.benchmark.measure import Row
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
        "published_ratio": made.published_ratio,
        "rows": [_row(row) for row in made.rows],
    }


def _row(row: Row) -> dict[str, Any]:
    case = row.case
    return {
        "image": list(case.image),
        "atlas": case.atlas,
        "adapter": row.adapter,
        "gaussians": case.gaussians,
        "lights": case.lights,
        "triangles": row.triangles,
        "samples": case.samples,
        "technique": case.technique,
        "varies": case.varies,
        "frame_ms": row.frame_ms,
        "gpu_ms": row.gpu_ms,
        "floor_ms": row.floor_ms,
        "floor_ratio": row.floor_ratio,
        "python_ms": row.python_ms,
        "image_ms": row.image_ms,
        "memory_mb": row.memory_mb,
    }


_CASE = ("image", "atlas", "Gaussians", "lights", "triangles", "technique")
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
        str(row.triangles),
        case.technique,
        *(f"{number:.3g}" for number in (*times, *rest)),
        f"{row.memory_mb:.0f}",
    )


def stage_cells(row: Row) -> list[tuple[str, str, str, str]]:
    """Each stage: its name, device time, floor, and the ratio of the two."""
    found = []
    for stage, ms in row.gpu_ms.items():
        floor = row.floor_ms.get(stage)
        ratio = f"{ms / floor:.1f}" if floor else "-"
        found.append((stage, f"{ms:.3g}", f"{floor:.3g}" if floor else "-", ratio))
    return found


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

    ratio = made.published_ratio
    text = Template((resources.files("dermis.benchmark") / "report.html").read_text(encoding="utf-8"))
    page = text.substitute(
        summary=html.escape(summary(made)),
        published="" if ratio is None else f"The passes of 2007 take {ratio:.2f} times the usual frame.",
        rows=_table(COLUMNS, [cells(row) for row in made.rows]),
        stages=_table(("stage", "device [ms]", "floor [ms]", "ratio"), stage_cells(made.usual)),
        bars=plots.stages(made.usual),
        scaling=plots.scaling(made),
    )
    with replacing(path) as trial:
        trial.write_text(page, encoding="utf-8")


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    titles = "".join(f"<th>{name}</th>" for name in head)
    body = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
    return f"<table><tr>{titles}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"
