"""A comparison as a self-contained HTML file."""

from __future__ import annotations

import base64
import html
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import MID_GREY, signed_difference
from dermis.apps.validation.comparisons.compare import Comparison, ComparisonRow, comparison_sources
from dermis.base.atomic_write import atomic_file
from dermis.images.codecs import encode_png

Floats = NDArray[np.float64]
_COLUMNS = ("technique", "relative RMSE", "FLIP", "energy ratio", "ms a frame")


def write_report(path: Path, made: Comparison) -> None:
    """Write pictures, differences and figures; the file is complete or not there.

    Raises DermisError when it cannot be written.
    """
    text = Template((resources.files(__package__) / "report.html").read_text(encoding="utf-8"))
    truth = _figure("the truth", made.shown(made.truth.image))
    figures = [_figures(made, row) for row in made.rows]
    page = text.substitute(
        title=html.escape(made.title),
        against=html.escape(made.against),
        seconds=f"{made.truth.seconds:.0f}",
        notes=html.escape("; ".join(made.truth.notes)),
        adapter=html.escape(made.adapter),
        table=_table(made.rows),
        keys=" ".join(comparison_sources(made.against, made.images)),
        figures="\n".join([truth, *figures]),
    )
    with atomic_file(path) as trial:
        trial.write_text(page, encoding="utf-8")


def cells(row: ComparisonRow) -> tuple[str, ...]:
    """Return a row's figures as text, with standard errors where there are any."""
    flip = "-" if row.flip is None else f"{row.flip:.3f}"
    return (
        row.technique,
        _with_error(row.relrmse, row.relrmse_se),
        flip,
        _with_error(row.energy_ratio, row.energy_ratio_se),
        f"{row.ms:.3g}",
    )


def _with_error(value: float, error: float) -> str:
    return f"{value:.4f}" + (f" ± {error:.4f}" if error > 0 else "")


def _table(rows: tuple[ComparisonRow, ...]) -> str:
    head = "".join(f"<th>{name}</th>" for name in _COLUMNS)
    body = ["".join(f"<td>{html.escape(cell)}</td>" for cell in cells(row)) for row in rows]
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"


def _figures(made: Comparison, row: ComparisonRow) -> str:
    image, truth = made.images[row.technique], made.truth
    difference = signed_difference(
        np.maximum(made.exposure * image, 0.0), np.maximum(made.exposure * truth.image, 0.0)
    )
    difference = np.where(truth.mask[..., None], difference, MID_GREY)
    pictures = {row.technique: made.shown(image), f"{row.technique}: difference": difference}
    return "\n".join(_figure(caption, picture) for caption, picture in pictures.items())


def _figure(caption: str, picture: Floats) -> str:
    png = base64.b64encode(encode_png(np.rint(255 * picture).astype(np.uint8))).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{png}" alt="{html.escape(caption)}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )
