"""The tables of docs/engines.md, from what was measured and from the targets' formulas."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import evaluate_export
from dermis.apps.export.subject import load_subject
from dermis.apps.validation.pages import DOCS, RESULTS, JsonObject, require_in_checkout, read_results, write_page
from dermis.base.console import print_lines

PAGE = DOCS / "engines.md"
SKINS = "skin1", "skin2", "dj3", "medium"
_EXCLUDED_TARGETS = ("maps",)  # a baked light map has no skin
_PREDICTED_COLUMNS = "target", "version", "variant", "skin", "cdf", "edge", "energy", "edge as one would type it"
_BLENDER_EDGE_HEADER = (
    "| method | skin | 4.5 against predicted | 5.2 against predicted | noise | 5.2 against the profile"
    " | typed in | light returned |\n|---|---|---|---|---|---|---|---|"
)
_BLENDER_HEAD_HEADER = """\
| Blender | method | outline [px] | lit skin, theirs over ours | relative RMSE | without highlights |
|---|---|---|---|---|---|"""


def page() -> None:
    """Write the tables of docs/engines.md between their marks, and print those of Blender."""
    write_page(PAGE, fill_tables(require_in_checkout(PAGE).read_text("utf-8")))
    print_lines(blender_tables())


def fill_tables(text: str) -> str:
    """Return the page with its tables replaced."""
    for name, table in {
        "predicted": predicted_table,
        "mitsuba": mitsuba_table,
        "babylon": babylon_table,
        "heads": heads_table,
    }.items():
        before, rest = text.split(f"<!-- {name} -->")
        text = f"{before}<!-- {name} -->\n{table()}<!-- /{name} -->{rest.split(f'<!-- /{name} -->')[1]}"
    return text


def predicted_table() -> str:
    """Return the errors of all targets, newest versions and variants, by their formulas."""
    lines = []
    subjects = [load_subject(name) for name in SKINS]
    for name in sorted(set(TARGETS) - set(_EXCLUDED_TARGETS), key=str.lower):
        for variant in TARGETS[name].variants or (None,):
            target = TARGETS[name].with_variant(variant)
            for subject in subjects:
                made = evaluate_export(subject, target, target.versions[-1])
                errors = made.error.cdf, made.error.edge, made.error.energy, made.naive_error.edge
                cells = [rgb_cell(one.round(3).tolist()) for one in errors]
                lines.append([target.title, made.version, made.variant or "-", subject.name, *cells])
    return markdown_table(_PREDICTED_COLUMNS, lines)


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return the lines of a table."""
    return "".join(f"| {' | '.join(row)} |\n" for row in (heads, ["---"] * len(heads), *rows))


def rgb_cell(values: Sequence[float]) -> str:
    """Return red, green and blue as a cell."""
    return " / ".join(f"{value + 0.0:.3f}" for value in values)


def mitsuba_table() -> str:
    """Return the table of edges in Mitsuba."""
    heads = "skin", "surface", "from what was predicted", "standard error", "from the exported curve"
    edges = read_results(RESULTS / "engines_mitsuba.json")["edges"]
    return markdown_table(heads, ([one["skin"], one["boundary"], *map(rgb_cell, _differences(one))] for one in edges))


def _differences(one: JsonObject) -> tuple[Sequence[float], ...]:
    return one["predicted"], one["noise"], one["exported"]


def babylon_table() -> str:
    """Return the table of edges in Babylon.js."""
    heads = (
        "profile",
        "d [mm]",
        "nearest lobe, measured [mm]",
        "measured less its samples' prediction",
        "less true lobes",
        "less the skin's profile",
    )
    names = (
        "expected_d_mm",
        "fitted_d_mm",
        "measured_less_predicted",
        "measured_less_lobes",
        "measured_less_profile",
    )
    skins = read_results(RESULTS / "engines_babylon.json")["skins"]
    return markdown_table(heads, ([skin, *(rgb_cell(one[name]) for name in names)] for skin, one in skins.items()))


def heads_table() -> str:
    """Return the table of one head in all programs, against ours."""
    titles = "program", "outline [px]", "lit skin over ours", "relative RMSE", "pixels"
    return markdown_table(titles, map(_head_row, read_results(RESULTS / "engines_heads.json")["heads"]))


def _head_row(one: JsonObject) -> list[str]:
    outline = "ours" if one["pixels_apart"] == 0 else f"{one['outline_px']:.1f}"
    return [
        one["program"],
        outline,
        rgb_cell(one["lit_colour"]),
        f"{one['relative_rmse']:.3f}",
        str(one["pixels"]),
    ]


def blender_tables() -> str:
    """Return the tables of edges and heads in Blender, which the page has between other texts."""
    found = read_results(RESULTS / "engines_blender.json")
    return (
        "\n".join([_BLENDER_EDGE_HEADER, *_blender_edges(found["edges"]), "", _BLENDER_HEAD_HEADER, *_blender_heads(found["heads"])]) + "\n"
    )


def _blender_edges(edges: list[JsonObject]) -> list[str]:
    by = {(one["version"][:3], one["method"], one["skin"]): one for one in edges}
    lines = []
    for (version, method, skin), new in by.items():
        if version != "5.2":
            continue
        old = by["4.5", method, skin]
        cells = [rgb_cell(old["against_predicted"]), rgb_cell(new["against_predicted"]), rgb_cell(new["noise"])]
        cells += [rgb_cell(new[name]) for name in ("against_true", "typed_in", "energy")]
        lines.append(f"| {method} | {skin} | {' | '.join(cells)} |")
    return lines


def _blender_heads(heads: list[JsonObject]) -> list[str]:
    return [
        f"| {one['version']} | {one['method']} | {one['outline_px']:.1f} | {rgb_cell(one['lit_colour'])} |"
        f" {one['relative_rmse']:.3f} | {one['without_highlights']:.3f} |"
        for one in heads
    ]
