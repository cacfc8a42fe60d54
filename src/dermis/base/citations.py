"""The works that the package rests on: author-year keys to BibTeX.

Entries are printed as they are written, which libraries that parse BibTeX do not keep.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files

from dermis.base.errors import refuse

_HEAD = re.compile(r"@(?P<kind>\w+)\s*\{\s*(?P<key>[^\s,{}]+)\s*,")


def keys() -> frozenset[str]:
    """The keys that a docstring may cite."""
    return frozenset(_references())


def bibtex(keys: Iterable[str]) -> str:
    """BibTeX of the named works, each once, in the order given.

    keys : author-year keys, as between the brackets of a docstring
    Raises DermisError for a key that is not in `base/references.bib`.
    """
    known = _references()
    wanted = tuple(dict.fromkeys(keys))
    for key in wanted:
        if key not in known:
            refuse(
                f"citation key {key!r}",
                "a key of base/references.bib",
                "it is not there",
                f"Choose from: {', '.join(sorted(known))}",
            )
    return "".join(f"{known[key]}\n\n" for key in wanted).rstrip("\n")


def parse_bibtex(text: str, source: str = "base/references.bib") -> dict[str, str]:
    """Key to entry, as it is written, of a BibTeX text.

    source : the file's name, for the message of the DermisError that a broken text raises
    """
    found: dict[str, str] = {}
    for entry in _split(text, source):
        head = _HEAD.match(entry)
        if head is None:
            refuse(source, "each entry to begin with @kind{key,", f"one begins {entry[:40]!r}", "Mend it")
        if head["key"] in found:
            refuse(source, "each key once", f"{head['key']} is there twice", "Rename or remove one of them")
        found[head["key"]] = entry
    return found


@cache
def _references() -> dict[str, str]:
    return parse_bibtex(files("dermis").joinpath("base/references.bib").read_text(encoding="utf-8"))


def _split(text: str, source: str) -> Iterator[str]:
    """The entries: from an `@` outside braces to the brace that closes it. Text between them is comment."""
    depth, start = 0, -1
    for i, character in enumerate(text):
        if character == "@" and depth == 0:
            start = i
        elif character == "{":
            depth += 1
        elif character == "}":
            depth -= 1
            if depth == 0 and start >= 0:
                yield text[start : i + 1]
                start = -1
    if depth != 0 or start >= 0:
        refuse(source, "balanced braces", f"{depth:+d} are left open at its end", "Close the last entry")
