"""Bibliography of the package: BibTeX entries with author-year keys, such as "Jensen2001".

The original text of entries is kept; libraries that parse BibTeX would reformat the text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files

from dermis.base.errors import refuse

_ENTRY_HEAD_PATTERN = re.compile(r"@(?P<kind>\w+)\s*\{\s*(?P<key>[^\s,{}]+)\s*,")


def citation_keys() -> frozenset[str]:
    """Return the keys of the bibliography, which docstrings cite in brackets."""
    return frozenset(_package_bibliography())


def bibtex(keys: Iterable[str]) -> str:
    """Return the BibTeX entries with the given keys, without duplicates, in the order of the keys.

    keys : author-year keys, such as "Jensen2001"

    Raises DermisError for a key that is not in `base/references.bib`.
    """
    known = _package_bibliography()
    unique = tuple(dict.fromkeys(keys))
    for key in unique:
        if key not in known:
            refuse(
                f"citation key {key!r}",
                "a key of base/references.bib",
                "it is not there",
                f"Choose from: {', '.join(sorted(known))}",
            )
    return "".join(f"{known[key]}\n\n" for key in unique).rstrip("\n")


def parse_bibtex(bibtex_text: str, source_name: str = "base/references.bib") -> dict[str, str]:
    """Return a dictionary from the key of each entry in a BibTeX file to the unchanged text of the entry.

    source_name : name of the file, for error messages

    Raises DermisError for invalid BibTeX.
    """
    found: dict[str, str] = {}
    for entry in _bibtex_entries(bibtex_text, source_name):
        head = _ENTRY_HEAD_PATTERN.match(entry)
        if head is None:
            refuse(
                source_name, "each entry to begin with @kind{key,", f"one begins {entry[:40]!r}", "Correct it"
            )
        if head["key"] in found:
            refuse(
                source_name, "each key once", f"{head['key']} is there twice", "Rename or remove one of them"
            )
        found[head["key"]] = entry
    return found


@cache
def _package_bibliography() -> dict[str, str]:
    return parse_bibtex(files("dermis").joinpath("base/references.bib").read_text(encoding="utf-8"))


def _bibtex_entries(bibtex_text: str, source_name: str) -> Iterator[str]:
    """Yield the text of each BibTeX entry, from the `@` to the closing brace.

    Text between entries is a comment, and is skipped.
    """
    depth, start = 0, -1
    for i, character in enumerate(bibtex_text):
        if character == "@" and depth == 0:
            start = i
        elif character == "{":
            depth += 1
        elif character == "}":
            depth -= 1
            if depth == 0 and start >= 0:
                yield bibtex_text[start : i + 1]
                start = -1
    if depth != 0 or start >= 0:
        refuse(source_name, "balanced braces", f"{depth:+d} are left open at its end", "Close the last entry")
