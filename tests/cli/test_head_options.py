"""Options of head files in commands other than `dermis render`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from small_head import obj_text

from dermis.base.errors import DermisError

Run = Callable[..., Any]


@pytest.fixture
def in_cm(folder: Path) -> str:
    """Return a folder with the small head in units of 10 mm and a picture."""
    lines = [line.split() for line in obj_text().splitlines()]
    places = [
        [one if one == "v" else f"{float(one) / 10:.6g}" for one in line] for line in lines if line[0] == "v"
    ]
    others = [line for line in lines if line[0] != "v"]
    (folder / "cm.obj").write_text("\n".join(" ".join(line) for line in [*places, *others]) + "\n")
    Image.fromarray(np.full((8, 8, 3), 90, np.uint8)).save(folder / "skin.png")
    return "cm.obj"


def test_compare_accepts_the_unit(run: Run, in_cm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    heads: list[Any] = []

    def compared(head: Any, **chosen: Any) -> Any:
        heads.append(head)
        raise DermisError("seen")

    monkeypatch.setattr("dermis.apps.validation.comparisons.compare.compare", compared)
    assert "1 unit = 10 mm makes it 240 mm high" in run("compare", in_cm).stderr
    assert "seen" in run("compare", in_cm, "--unit-mm", "10").stderr
    head, stated = heads
    np.testing.assert_allclose(head.mesh.positions, stated.mesh.positions, rtol=1e-5)
    assert head.mesh.size_mm[1] == pytest.approx(240.0, rel=1e-3)
    assert head.levels == 0


def test_compare_without_a_head_refuses_head_options(run: Run) -> None:
    assert "--up: expected no such option here" in run("compare", "specular", "--up", "z").stderr


def test_bench_accepts_unit_and_maps(run: Run, in_cm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from dermis.apps.validation.benchmarks import run as measured

    heads: list[Any] = []

    def measure(renderer: Any, case: Any, head: Any, *others: Any) -> Any:
        heads.append(head)
        raise DermisError("seen")

    monkeypatch.setattr(measured, "measure_case", measure)
    monkeypatch.setattr(measured, "copy_rate", lambda device: 1.0)
    bench = "bench", "--preset", "cpu", "--adapter", "cpu", "--head", in_cm, "--unit-mm", "10"
    assert "seen" in run(*bench, "--colour", "skin.png", "--roughness-map", "skin.png").stderr
    assert heads[0].mesh.size_mm[1] == pytest.approx(240.0, rel=1e-3)
    assert heads[0].maps.colour.shape == (8, 8, 3) and heads[0].maps.roughness.shape == (8, 8)
    assert heads[0].levels == 0


def test_bench_without_a_head_refuses_head_options(run: Run) -> None:
    assert "--unit-mm: expected no such option without a file" in run("bench", "--unit-mm", "10").stderr
    assert "--unit-mm" in run("bench", "--head", "a.obj", "--unit-mm", "-1").stderr
