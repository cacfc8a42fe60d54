"""References in one line: authors, title and year, without TeX markup."""

from __future__ import annotations

import re

import pytest

from dermis.apps.gallery.page import format_reference
from dermis.base import citations as cite


@pytest.mark.parametrize("key", sorted(cite.citation_keys()))
def test_every_bibliography_entry_is_parsed(key: str) -> None:
    text = format_reference(key)
    assert re.search(r"^.+\. .+\. \d{4}$", text), text
    assert not set(text) & set("{}\\$`"), text


def test_multiline_fields_and_accents_are_parsed() -> None:
    authors = "Andersson, Pontus; Nilsson, Jim; Akenine-Möller, Tomas; "
    assert format_reference("Andersson2020").startswith(authors)
    assert "László" in format_reference("Kelemen2001")
