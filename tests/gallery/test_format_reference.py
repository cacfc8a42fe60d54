"""References in one line: authors, title and year, without TeX markup."""

from __future__ import annotations

import re

import pytest

from dermis.apps.gallery.page import format_reference
from dermis.base import citations as cite


@pytest.mark.parametrize("key", sorted(cite.citation_keys()))
def test_every_work_can_be_read(key: str) -> None:
    text = format_reference(key)
    assert re.search(r"^.+\. .+\. \d{4}$", text), text
    assert not set(text) & set("{}\\$`"), text


def test_fields_go_over_lines_and_letters_have_their_accents() -> None:
    authors = "Andersson, Pontus; Nilsson, Jim; Akenine-Möller, Tomas; "
    assert format_reference("Andersson2020").startswith(authors)
    assert "László" in format_reference("Kelemen2001")
