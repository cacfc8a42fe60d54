"""HTML report of a comparison, in a single self-contained file."""

from __future__ import annotations

import base64
import html
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import ZERO_DIFFERENCE_GREY, signed_difference
from dermis.apps.validation.comparisons.compare import Comparison, ComparisonRow, comparison_sources
from dermis.base.atomic_write import atomic_file
from dermis.images.codecs import encode_png

Floats = NDArray[np.float64]
_COLUMN_TITLES = ("technique", "relative RMSE", "FLIP", "energy ratio", "ms per frame")


def write_report(path: Path, comparison: Comparison) -> None:
    """Write pictures, differences and errors of a comparison to an HTML file, atomically.

    Raises DermisError when the file cannot be written.
    """
    text = Template((resources.files(__package__) / "report.html").read_text(encoding="utf-8"))
    reference = _figure_html("reference", comparison.tone_mapped(comparison.reference.image))
    figures = [_technique_figures(comparison, row) for row in comparison.rows]
    page = text.substitute(
        title=html.escape(comparison.title),
        against=html.escape(comparison.against),
        seconds=f"{comparison.reference.seconds:.0f}",
        notes=html.escape("; ".join(comparison.reference.notes)),
        adapter=html.escape(comparison.adapter),
        table=_errors_table(comparison.rows),
        keys=" ".join(comparison_sources(comparison.against, comparison.images)),
        figures="\n".join([reference, *figures]),
    )
    with atomic_file(path) as file:
        file.write_text(page, encoding="utf-8")


def error_cells(comparison_row: ComparisonRow) -> tuple[str, ...]:
    """Return the errors of a technique as table cells, with standard errors if the reference has noise."""
    flip = "-" if comparison_row.flip is None else f"{comparison_row.flip:.3f}"
    return (
        comparison_row.technique,
        _estimate_text(comparison_row.relrmse, comparison_row.relrmse_se),
        flip,
        _estimate_text(comparison_row.energy_ratio, comparison_row.energy_ratio_se),
        f"{comparison_row.ms:.3g}",
    )


def _estimate_text(estimate: float, standard_error: float) -> str:
    return f"{estimate:.4f}" + (f" ± {standard_error:.4f}" if standard_error > 0 else "")


def _errors_table(comparison_rows: tuple[ComparisonRow, ...]) -> str:
    head = "".join(f"<th>{name}</th>" for name in _COLUMN_TITLES)
    body = ["".join(f"<td>{html.escape(cell)}</td>" for cell in error_cells(row)) for row in comparison_rows]
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"


def _technique_figures(comparison: Comparison, comparison_row: ComparisonRow) -> str:
    image, reference = comparison.images[comparison_row.technique], comparison.reference
    ours, exact = (np.maximum(comparison.exposure * one, 0.0) for one in (image, reference.image))
    difference = signed_difference(ours, exact)
    difference = np.where(reference.mask[..., None], difference, ZERO_DIFFERENCE_GREY)
    pictures = {
        comparison_row.technique: comparison.tone_mapped(image),
        f"{comparison_row.technique}: difference": difference,
    }
    return "\n".join(_figure_html(caption, picture) for caption, picture in pictures.items())


def _figure_html(caption: str, picture: Floats) -> str:
    png = base64.b64encode(encode_png(np.rint(255 * picture).astype(np.uint8))).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{png}" alt="{html.escape(caption)}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )
