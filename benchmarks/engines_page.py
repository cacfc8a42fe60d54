"""Writes the tables of docs/engines.md: python benchmarks/engines_page.py"""

from __future__ import annotations

import sys
from pathlib import Path

import engines_tables

from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import judged
from dermis.apps.export.subject import subject_of
from dermis.base.atomic_write import replacing

PAGE = Path(__file__).resolve().parents[1] / "docs" / "engines.md"
SKINS = "skin1", "skin2", "dj3", "medium"
_NO_SKIN = ("maps",)  # a baked light map is what it is
_HEADS = "target", "version", "variant", "skin", "cdf", "edge", "energy", "edge as one would type it"


def main() -> int:
    """Write the page."""
    text = page(PAGE.read_text("utf-8"))
    with replacing(PAGE) as trial:
        trial.write_text(text, encoding="utf-8")
    return 0


def page(text: str) -> str:
    """The page with its tables made anew."""
    tables = {name: getattr(engines_tables, name) for name in ("mitsuba", "babylon", "heads")}
    for name, table in {"predicted": predicted, **tables}.items():
        before, rest = text.split(f"<!-- {name} -->")
        text = f"{before}<!-- {name} -->\n{table()}<!-- /{name} -->{rest.split(f'<!-- /{name} -->')[1]}"
    return text


def predicted() -> str:
    """Errors in red, green and blue of all targets, newest versions and variants, by their formulas."""
    lines = []
    subjects = [subject_of(name) for name in SKINS]
    for name in sorted(set(TARGETS) - set(_NO_SKIN), key=str.lower):
        for variant in TARGETS[name].variants or (None,):
            target = TARGETS[name].with_variant(variant)
            for subject in subjects:
                told = judged(subject, target, target.versions[-1])
                errors = told.error.cdf, told.error.edge, told.error.energy, told.naive_error.edge
                cells = [engines_tables.three(one.round(3).tolist()) for one in errors]
                lines.append([target.title, told.version, told.variant or "-", subject.name, *cells])
    return engines_tables.rows_of(_HEADS, lines)


if __name__ == "__main__":
    sys.exit(main())
