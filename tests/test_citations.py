"""The bibliography parses, and every work that a docstring cites is in it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import dermis
from dermis.base import citations as cite
from dermis.base.errors import DermisError

SOURCE = Path(dermis.__file__).parent
_BRACKETS = re.compile(r"\[([^\[\]]+)\]")
_KEY = re.compile(r"\b[A-Za-z]{2,}\d{4}[a-z]?\b")


def cited_keys(text: str) -> list[str]:
    """Return keys in square brackets: `[Key1999]`, `[Key1999 eq. 3]` and `[Key1999, Other2001]`."""
    return [key for inside in _BRACKETS.findall(text) for key in _KEY.findall(inside)]


def docstrings(path: Path) -> Iterator[str]:
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, documented):
            yield ast.get_docstring(node) or ""


def field(entry: str, name: str) -> str | None:
    found = re.search(rf"^\s*{name}\s*=\s*(.+?),?$", entry, re.MULTILINE)
    return found[1] if found else None


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=lambda p: str(p.relative_to(SOURCE)))
def test_cited_works_are_in_the_bibliography(path: Path) -> None:
    unknown = {key for text in docstrings(path) for key in cited_keys(text)} - cite.citation_keys()
    assert not unknown, f"{path.name} cites {sorted(unknown)}: add them to references.bib or correct the key"


def test_works_cited_by_shaders_are_in_the_bibliography() -> None:
    unknown = {key for path in SOURCE.rglob("*.wgsl") for key in cited_keys(path.read_text(encoding="utf-8"))}
    assert not unknown - cite.citation_keys()


def test_keys_are_found_in_every_form() -> None:
    text = (
        "[Loop1987], [dEon2007] eq. 3, [Donner2008 eq. 2-8] and [Jensen2001, Green2004a]; not [mm2], x[1999]"
    )
    assert cited_keys(text) == ["Loop1987", "dEon2007", "Donner2008", "Jensen2001", "Green2004a"]


@pytest.mark.parametrize("key", sorted(cite.citation_keys()))
def test_entries_are_complete(key: str) -> None:
    entry = cite.bibtex([key])
    assert entry.startswith("@") and f"{{{key}," in entry
    assert all(field(entry, name) for name in ("author", "title", "year")), entry
    year = re.search(r"\d{4}", key)
    assert year is not None and field(entry, "year") == f"{{{year[0]}}}"
    assert re.fullmatch(r"\{10\.\d{4,}/\S+\}", field(entry, "doi") or "{10.0000/none}")


def test_bibtex_keeps_the_order_and_repeats_nothing() -> None:
    entries = cite.parse_bibtex(cite.bibtex(["Loop1987", "Burns2013", "Loop1987"]))
    assert list(entries) == ["Loop1987", "Burns2013"]
    assert "Smooth Subdivision" in entries["Loop1987"]
    assert cite.bibtex([]) == ""


def test_unknown_key_is_refused_by_name() -> None:
    with pytest.raises(DermisError, match=r"'Nobody1999'.*references\.bib.*Loop1987"):
        cite.bibtex(["Loop1987", "Nobody1999"])


def test_parser_reads_nested_braces_and_skips_comments() -> None:
    entries = cite.parse_bibtex(
        "% note\n@misc{A2001,\n title={{B} and {C {D}} at x@y}}\n words @book{E2002, year=2002}"
    )
    assert entries == {
        "A2001": "@misc{A2001,\n title={{B} and {C {D}} at x@y}}",
        "E2002": "@book{E2002, year=2002}",
    }


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("@misc{A2001, title={open}", "balanced braces"),
        ("@misc{A2001, year=1}\n@misc{A2001, year=2}", "twice"),
        ("@misc{title={x}}", "begin with"),
    ],
)
def test_broken_bibliography_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(DermisError, match=complaint):
        cite.parse_bibtex(text)
