"""`dermis head`: a file, and what it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dermis.scene.heads import load_head

Run = Callable[..., Any]


def test_writes_a_head_that_renders(run: Run, render: Run, folder: Path) -> None:
    words = ("--seed", "3", "--nose", "1.1", "--melanin", "0.05", "--freckles", "0.5", "--size", "256")
    ended = run("head", *words, "-o", "own.glb", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)
    assert (report["head"], report["size"], report["layout"]) == ("own.glb", 256, "few")
    head = load_head(folder / "own.glb")
    assert head.maps.colour is not None and head.maps.colour.shape == (256, 256, 3)
    assert render("own.glb", "-o", "own.png").code == 0


@pytest.mark.parametrize(
    ("words", "culprit"),
    [
        (("--nose", "9"), "nose"),
        (("--melanin", "1.5"), "--melanin"),
        (("--melanin", "nan"), "--melanin"),
        (("--size", "1000"), "--size"),
        (("--seed", "-1"), "seed"),
        (("--seed", "1.5"), "1.5"),
        (("-o", "own.obj"), "own.obj"),
        (("-o", "nowhere/own.glb"), "nowhere"),
    ],
)
def test_refusals(run: Run, folder: Path, words: tuple[str, ...], culprit: str) -> None:
    before = sorted(folder.iterdir())
    ended = run("head", *words)
    assert (ended.code, ended.stdout) == (2, "")
    assert ended.stderr.startswith("dermis: ") and culprit in ended.stderr and "Traceback" not in ended.stderr
    assert sorted(folder.iterdir()) == before
