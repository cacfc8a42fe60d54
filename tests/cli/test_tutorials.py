"""The tutorials are correct: their Python code and commands run and write the named files."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]
DOCS = Path(__file__).parents[2] / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.photographed
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_runs(
    page: Path, run: Run, opened: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": page.stem}
    blocks = _BLOCK.findall(page.read_text("utf-8"))
    assert blocks
    for kind, text in blocks:
        if kind == "python":
            exec(compile(text, page.name, "exec"), names)
        elif kind == "sh":
            for line in text.splitlines():
                _check(run, line)
        else:
            assert kind == "toml", f"a block of {kind}, which nobody runs"
            Path(text.partition("\n")[0].removeprefix("# ")).write_text(text, "utf-8")


def _check(run: Run, line: str) -> None:
    """Run a command, which must write the named file without notes."""
    command, _, target = line.partition(" > ")
    name, *words = shlex.split(command)
    assert name == "dermis"
    done = run(*words)
    notes = [line for line in done.stderr.splitlines() if line.startswith("note:")]
    remarks = [note for note in notes if not note.startswith("note: --subdivide")]
    assert (done.code, remarks) == (0, []), done.stderr
    if target:
        Path(target).write_text(done.stdout, "utf-8")
    for flag, value in pairwise(words):
        assert flag != "-o" or Path(value).stat().st_size > 0


def test_each_tutorial_is_in_the_table_of_contents() -> None:
    index = (DOCS / "index.md").read_text("utf-8")
    assert len(TUTORIALS) == 4
    assert all(f"tutorials/{page.stem}" in index for page in TUTORIALS)
