"""`dermis compare HEAD --against cycles` with a substitute for Blender's Python."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import FORM

from dermis.apps.truths import cycles
from dermis.apps.truths.cycles import PYTHON_VARIABLE

Run = Callable[..., Any]
PROGRAM = """
import json, sys
from pathlib import Path
import numpy as np
from dermis.images.io import write_image

folder = Path(sys.argv[1])
scene = json.loads((folder / "scene.json").read_text())
width, height = scene["size"]
for k, one in enumerate(scene["passes"]):
    noise = np.random.default_rng(one["seed"]).uniform(0.4, 0.6, (height, width, 3))
    pixels = np.concatenate((noise, np.ones((height, width, 1))), axis=2)
    write_image(folder / f"pass_{k}.exr", pixels.astype(np.float32))
done = {"version": "5.0.1", "times": [[0.5, 1.0]] * len(scene["passes"])}
(folder / "done.json").write_text(json.dumps(done))
"""


@pytest.fixture
def compare(run: Run, folder: Path, opened: None, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return a function that runs the command with a shell script instead of Blender's Python."""
    script = folder / "python"
    monkeypatch.setenv(PYTHON_VARIABLE, str(script))

    def call(text: str | None, *words: str) -> Any:
        if text is not None:
            script.write_text(f"#!/bin/sh\n{text}\n")
            script.chmod(0o755)
        small = ("--size", "32x32", "--atlas", "64", "--techniques", "none", "--samples", "8")
        return run("compare", "head.obj", "--against", "cycles", *small, *words)

    return call


def test_rows_compare_with_the_picture_of_cycles(compare: Run, folder: Path) -> None:
    (folder / "blender.py").write_text(PROGRAM)
    ended = compare(f'exec "{sys.executable}" "{folder}/blender.py" "$3"', "--json", "-o", "report.html")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)
    assert report["truth"] == {"seconds": 2.0, "notes": ["8 paths per pixel, random walk"]}
    (row,) = report["rows"]
    assert (row["technique"], row["against"]) == ("none", "cycles")
    assert row["relrmse"] > 0 and row["energy_ratio"] > 0
    assert "8 paths per pixel" in (folder / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("script", "says"),
    [
        (None, "there is no file"),
        ("echo \"ModuleNotFoundError: No module named 'bpy'\" >&2; exit 1", "No module named 'bpy'"),
        ("kill -11 $$", "signal 11 ended it"),
        ('echo "no JSON" > "$3"/done.json', "its files are unusable"),
    ],
)
def test_failures_are_reported_and_leave_no_files(
    compare: Run, folder: Path, script: str | None, says: str
) -> None:
    ended = compare(script, "--json", "-o", "report.html")
    assert (ended.code, ended.stdout) == (2, "")
    assert FORM.fullmatch(ended.stderr) and says in ended.stderr
    assert not (folder / "report.html").exists()


def test_an_endless_run_is_stopped(compare: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cycles, "_MAX_STARTUP_S", 0.1)
    monkeypatch.setattr(cycles, "_MAX_SECONDS_PER_PATH", 0.0)
    ended = compare("exec sleep 60", "--json")
    assert (ended.code, ended.stdout) == (2, "")
    assert "it was ended after 0 s. Take fewer samples" in ended.stderr
