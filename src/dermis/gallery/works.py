"""Works of the bibliography in one line each, for a page."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator

from dermis import cite

_FIELD = re.compile(r"(\w+)\s*=\s*\{")
_ACCENT = re.compile(r"\\(['\"`^~])\s*(\w)")
_ABOVE = {"'": "\u0301", '"': "\u0308", "`": "\u0300", "^": "\u0302", "~": "\u0303"}
_SIGNS = {
    r"$\mu$": "µ",
    r"\&": "&",
    r"\AA": "Å",
    "; others": " and others",
    "---": "—",
    "--": "–",
    "``": "“",
    "''": "”",
}


def reference(key: str) -> str:
    """A work as people read it: authors, title, year.

    Raises DermisError for a key that is not in the bibliography.
    """
    fields = dict(_fields(cite.bibtex([key])))
    if "author" in fields:
        fields["author"] = "; ".join(re.split(r"\s+and\s+", fields["author"]))
    known = [_plain(fields[name]).rstrip(".") for name in ("author", "title", "year") if name in fields]
    return ". ".join(known)


def _fields(entry: str) -> Iterator[tuple[str, str]]:
    """Names and values, which may go over lines and have braces within."""
    at = 0
    while found := _FIELD.search(entry, at):
        at, depth = found.end(), 1
        while depth:
            depth += {"{": 1, "}": -1}.get(entry[at], 0)
            at += 1
        yield found[1].lower(), entry[found.end() : at - 1]


def _plain(value: str) -> str:
    """A value without what only TeX reads."""
    text = value.replace("{", "").replace("}", "")
    for sign, meant in _SIGNS.items():
        text = text.replace(sign, meant)
    text = _ACCENT.sub(lambda accent: unicodedata.normalize("NFC", accent[2] + _ABOVE[accent[1]]), text)
    return " ".join(text.split())
