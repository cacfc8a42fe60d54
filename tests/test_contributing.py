"""Tables and paths of CONTRIBUTING.md agree with the packages and files."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(("head", "container"), [("package", "dermis"), ("package in `apps`", "dermis.apps")])
def test_layers_match_the_import_linter(head: str, container: str) -> None:
    rows = TEXT.partition(f"| {head} | contents |\n|---|---|\n")[2].partition("\n\n")[0].splitlines()
    layered = [set(re.findall(r"`(\w+)`", row.split("|")[1])) for row in rows]
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = document["tool"]["importlinter"]["contracts"]
    (layers,) = (one["layers"] for one in contracts if one.get("containers") == [container])
    assert layered == [{name.strip() for name in layer.split("|")} for layer in layers]


@pytest.mark.parametrize(("head", "folder"), [("part of `frame`", "frame"), ("feature", "frame/features")])
def test_tables_list_the_contents_of_the_folders(head: str, folder: str) -> None:
    table = TEXT.partition(f"| {head} | contents ")[2].partition("\n\n")[0]
    rows = [row.split("|")[1] for row in table.splitlines()[2:]]
    listed = sorted(name for row in rows for name in re.findall(r"`([\w.]+)`", row))
    entries = (ROOT / "src" / "dermis" / folder).iterdir()
    assert listed == sorted(entry.name for entry in entries if not entry.name.startswith("__"))


def test_files_of_the_recipes_exist() -> None:
    named = {path for path in re.findall(r"`([\w./]+/[\w.]+\.\w+)`", TEXT) if not re.search("[A-Z]{4}", path)}
    assert len(named) > 30
    places = ROOT, ROOT / "src" / "dermis"
    missing = sorted(path for path in named if not any((place / path).exists() for place in places))
    assert missing == []
