"""The command `dermis export`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

Run = Callable[..., Any]


def test_json_lists_written_files_and_errors(run: Run, tmp_path: Path) -> None:
    ended = run("export", "dj3", "--to", "unity", "-o", tmp_path / "made", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    told = json.loads(ended.stdout)
    assert (told["target"], told["version"], told["model"]) == ("unity", "17", "layered")
    for name in ("cdf", "edge", "energy"):
        assert len(told["error"][name]) == len(told["naive_error"][name]) == 3
    assert 0.1 < told["error"]["cdf"][0] < 0.2 and len(told["d_mm"]) == 3
    assert [Path(file).name for file in told["files"]] == ["dj3.asset", "README.md", "export.json"]
    assert all(Path(file).is_file() for file in told["files"])


def test_unknown_versions_are_refused_with_the_known_ones(run: Run, tmp_path: Path) -> None:
    ended = run("export", "skin1", "--to", "unreal", "--version", "4.27", "-o", tmp_path / "made")
    assert ended.code == 2 and "5.7, 5.8, but got '4.27'" in ended.stderr
    assert not list(tmp_path.iterdir())
