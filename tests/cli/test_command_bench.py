"""`dermis bench` at tiny sizes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dermis.apps.validation.benchmarks import cases
from dermis.apps.validation.benchmarks.cases import BenchmarkCase, BenchmarkPreset
from dermis.apps.validation.benchmarks.measure import FrameCounts, measure_case
from dermis.base.errors import DermisError

Run = Callable[..., Any]
BRIEF = FrameCounts(warmup=0, between=0, timed=1, sequence=1)


@pytest.fixture
def bench(run: Run, folder: Path, opened: None, device: Any, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return a function that runs `dermis bench` with presets of two tiny frames."""
    base_case = BenchmarkCase((32, 32), atlas=64, gaussians=2, lights=1, samples=1)
    tiny = BenchmarkPreset(
        base_case,
        image=((32, 32),),
        atlas=(64,),
        gaussians=(2,),
        lights=(1,),
        subdivide=(0,),
        targets=(),
        environment=(),
    )
    for name in cases.BENCHMARK_PRESETS:
        monkeypatch.setitem(cases.BENCHMARK_PRESETS, name, tiny)
    monkeypatch.setattr("dermis.apps.validation.benchmarks.run.CPU_FRAME_COUNTS", BRIEF)
    monkeypatch.setattr("dermis.apps.validation.benchmarks.run.FrameCounts", lambda: BRIEF)
    return lambda *words: run("bench", "--head", "head.obj", "--adapter", device.adapter.name, *words)


def test_json_and_report_are_written(bench: Run, tmp_path: Path, device: Any) -> None:
    ended = bench("--preset", "cpu", "--json", "-o", "report.html")
    assert (ended.code, ended.stderr) == (0, "")
    told = json.loads(ended.stdout)
    assert told["adapter"] == device.adapter.name and told["head"] == "head.obj"
    assert [row["technique"] for row in told["rows"]] == [
        "texture-space",
        "gpu-gems-3",
        "published-fragments",
    ]
    for row in told["rows"]:
        assert row["frame_ms"] > 0 and row["gpu_ms"]["total"] > 0 and row["floor_ratio"] > 0
        assert (row["image"], row["atlas"], row["gaussians"], row["lights"]) == ([32, 32], 64, 2, 1)
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_results_are_printed_as_text(bench: Run) -> None:
    ended = bench()
    assert (ended.code, ended.stderr) == (0, "")
    for word in ("GB/s", "floor [ms]", "32x32", "irradiance", "times as long as fragments"):
        assert word in ended.stdout


def test_an_unwritable_report_is_refused_first(bench: Run) -> None:
    ended = bench("-o", "report.png")
    assert ended.code == 2 and "report.png: expected" in ended.stderr and ended.stdout == ""


def test_skipped_measurements_are_reported(bench: Run, monkeypatch: pytest.MonkeyPatch, device: Any) -> None:
    base_case = cases.BENCHMARK_PRESETS["cpu"].base_case
    too_large = BenchmarkPreset(base_case, ((32, 32),), (device.max_texture_size + 1,), (2,), (1,), (0,), ())
    monkeypatch.setitem(cases.BENCHMARK_PRESETS, "cpu", too_large)
    ended = bench("--preset", "cpu")
    assert ended.code == 0
    assert f"skipped: 32x32, atlas {device.max_texture_size + 1}" in ended.stdout
    assert str(device.max_texture_size) in ended.stdout


def test_an_interruption_leaves_no_files(bench: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    before = set(tmp_path.rglob("*"))

    def interrupted(renderer: Any, case: BenchmarkCase, *rest: Any) -> Any:
        if case.technique == "gpu-gems-3":
            raise KeyboardInterrupt
        return measure_case(renderer, case, *rest)

    monkeypatch.setattr("dermis.apps.validation.benchmarks.run.measure_case", interrupted)
    ended = bench("--preset", "cpu", "--json", "-o", "report.html")
    assert ended.code == 130 and ended.stdout == ""
    assert set(tmp_path.rglob("*")) == before


def test_figures_are_printed_if_the_report_fails(bench: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, made: Any) -> None:
        raise DermisError(f"{path}: the disk is full")

    monkeypatch.setattr("dermis.apps.validation.benchmarks.report.write_report", full)
    ended = bench("--preset", "cpu", "--json", "-o", "report.html")
    assert ended.code == 2 and "the disk is full" in ended.stderr
    assert len(json.loads(ended.stdout)["rows"]) == 3


def test_a_missing_head_is_refused(run: Run, opened: None, device: Any) -> None:
    ended = run("bench", "--head", "nobody.obj", "--adapter", device.adapter.name)
    assert ended.code == 2 and "nobody.obj" in ended.stderr
