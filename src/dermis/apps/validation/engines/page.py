"""Tables of docs/engines.md, from measurements and from the formulas of the export targets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import evaluate_export
from dermis.apps.export.subject import load_subject
from dermis.apps.validation.pages import (
    DOCS,
    RESULTS,
    JsonObject,
    read_results,
    require_in_checkout,
    write_page,
)
from dermis.base.console import print_lines

PAGE = DOCS / "engines.md"
COMPARED_SKINS = "skin1", "skin2", "dj3", "medium"
_EXCLUDED_TARGETS = ("maps",)  # a baked light map has no skin parameters
_COLUMN_TITLES = (
    "target",
    "version",
    "variant",
    "skin",
    "cdf",
    "edge",
    "energy",
    "edge, published values typed in",
)
_BLENDER_EDGE_HEADER = (
    "| method | skin | 4.5 against predicted | 5.2 against predicted | noise | 5.2 against the profile"
    " | typed in | light returned |\n|---|---|---|---|---|---|---|---|"
)
_BLENDER_HEAD_HEADER = """\
| Blender | method | outline [px] | lit skin relative to dermis | relative RMSE | without highlights |
|---|---|---|---|---|---|"""


def write_engines_page() -> None:
    """Rewrite the tables of docs/engines.md, except the two tables with measurements in Blender.

    These two are printed, to be copied into the page by hand.
    """
    write_page(PAGE, fill_tables(require_in_checkout(PAGE).read_text("utf-8")))
    print_lines(blender_tables())


def fill_tables(page_text: str) -> str:
    """Return the text of the page with new tables between its markers, such as <!-- mitsuba -->."""
    for name, table in {
        "predicted": predicted_errors_table,
        "mitsuba": mitsuba_table,
        "babylon": babylon_table,
        "heads": heads_table,
    }.items():
        before, rest = page_text.split(f"<!-- {name} -->")
        page_text = f"{before}<!-- {name} -->\n{table()}<!-- /{name} -->{rest.split(f'<!-- /{name} -->')[1]}"
    return page_text


def predicted_errors_table() -> str:
    """Return a Markdown table with predicted errors of each export target and its variants.

    The errors are computed for exports to the newest version of each target.
    """
    lines = []
    subjects = [load_subject(name) for name in COMPARED_SKINS]
    for name in sorted(set(TARGETS) - set(_EXCLUDED_TARGETS), key=str.lower):
        for variant in TARGETS[name].variants or (None,):
            target = TARGETS[name].with_variant(variant)
            for subject in subjects:
                report = evaluate_export(subject, target, target.versions[-1])
                errors = report.error.cdf, report.error.edge, report.error.energy, report.naive_error.edge
                cells = [rgb_cell(error.round(3).tolist()) for error in errors]
                lines.append([target.title, report.version, report.variant or "-", subject.name, *cells])
    return markdown_table(_COLUMN_TITLES, lines)


def markdown_table(column_titles: Sequence[str], table_rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table with column titles and rows of cells."""
    return "".join(
        f"| {' | '.join(row)} |\n" for row in (column_titles, ["---"] * len(column_titles), *table_rows)
    )


def rgb_cell(rgb: Sequence[float]) -> str:
    """Return red, green and blue values as a table cell, such as "0.010 / 0.020 / 0.030"."""
    return " / ".join(f"{value + 0.0:.3f}" for value in rgb)


def mitsuba_table() -> str:
    """Return a Markdown table of the edge responses of a half-lit plane, measured in Mitsuba."""
    errors = "difference from the prediction", "standard error", "difference from the exported profile"
    heads = "skin", "boundary", *errors
    edges = read_results(RESULTS / "engines_mitsuba.json")["edges"]
    names = "predicted", "noise", "exported"
    rows = ([row["skin"], row["boundary"], *(rgb_cell(row[name]) for name in names)] for row in edges)
    return markdown_table(heads, rows)


def babylon_table() -> str:
    """Return a Markdown table of the edge responses of a half-lit plane, measured in Babylon.js."""
    errors = "difference from the prediction", "from exact lobes", "from the skin's profile"
    heads = "profile", "d [mm]", "measured width of the nearest lobe [mm]", *errors
    differences = (f"measured_less_{name}" for name in ("predicted", "lobes", "profile"))
    names = ("expected_d_mm", "fitted_d_mm", *differences)
    skins = read_results(RESULTS / "engines_babylon.json")["skins"]
    rows = ([skin, *(rgb_cell(row[name]) for name in names)] for skin, row in skins.items())
    return markdown_table(heads, rows)


def heads_table() -> str:
    """Return a Markdown table that compares each picture of a head by another program with that by dermis."""
    titles = "program", "outline [px]", "lit skin relative to dermis", "relative RMSE", "pixels"
    return markdown_table(titles, map(_head_row, read_results(RESULTS / "engines_heads.json")["heads"]))


def _head_row(comparison: JsonObject) -> list[str]:
    outline = "that of dermis" if comparison["pixels_apart"] == 0 else f"{comparison['outline_px']:.1f}"
    figures = (
        rgb_cell(comparison["lit_colour"]),
        f"{comparison['relative_rmse']:.3f}",
        str(comparison["pixels"]),
    )
    return [comparison["program"], outline, *figures]


def blender_tables() -> str:
    """Return two Markdown tables with measurements in Blender, to be copied into docs/engines.md by hand.

    The first has the errors of edge responses of skin. The second compares pictures of a head with those by
    dermis.
    """
    results = read_results(RESULTS / "engines_blender.json")
    edges, heads = _blender_edges_table(results["edges"]), _blender_heads_table(results["heads"])
    return "\n".join([_BLENDER_EDGE_HEADER, *edges, "", _BLENDER_HEAD_HEADER, *heads]) + "\n"


def _blender_edges_table(edge_results: list[JsonObject]) -> list[str]:
    by_key = {(row["version"][:3], row["method"], row["skin"]): row for row in edge_results}
    lines = []
    for (version, method, skin), new in by_key.items():
        if version != "5.2":
            continue
        old = by_key["4.5", method, skin]
        names = "against_predicted", "noise", "against_true", "typed_in", "energy"
        cells = [rgb_cell(old["against_predicted"]), *(rgb_cell(new[name]) for name in names)]
        lines.append(f"| {method} | {skin} | {' | '.join(cells)} |")
    return lines


def _blender_heads_table(head_results: list[JsonObject]) -> list[str]:
    return [
        f"| {row['version']} | {row['method']} | {row['outline_px']:.1f} | {rgb_cell(row['lit_colour'])} |"
        f" {row['relative_rmse']:.3f} | {row['without_highlights']:.3f} |"
        for row in head_results
    ]
