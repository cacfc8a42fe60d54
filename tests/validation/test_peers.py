"""Comparison with other renderers, replaced by ones of known noise and bias, and without them."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import dermis
from dermis.apps.truths.cycles import CyclesPass
from dermis.apps.truths.path_traced import PathTraced
from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3
from dermis.apps.validation.pages import template_path
from dermis.apps.validation.peers import rendering, report
from dermis.base.errors import DermisError, refuse
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere

BALL = Head("ball", uv_sphere(100.0, 24, 12), Maps())
SIDE, OURS, BIAS, NOISE = 64, 0.2, 0.1, 0.4
"""Relative errors: ours, that of Cycles without noise, and its noise with one path per pixel."""


def picture(factor: float) -> np.ndarray:
    image = np.ones((SIDE, SIDE, 3), np.float32) * np.linspace(0.5, 1.5, SIDE, dtype=np.float32)[:, None]
    return factor * image


def cycles_passes(scene: Any, medium: Any, samples: Any, settings: Any, *, method: str, seed: int) -> Any:
    written = []
    for k, count in enumerate(samples):
        noise = np.random.default_rng(seed + k + 1000 * (method == "burley")).normal(size=(SIDE, SIDE, 3))
        image = picture(1.0 + BIAS) * (1.0 + NOISE / (1.0 + BIAS) / np.sqrt(count) * noise)
        written.append(CyclesPass(image, np.ones((SIDE, SIDE)), count, 0.5 * count, count, "5.0.1"))
    return written


def no_blender(*given: Any, **named: Any) -> Any:
    refuse("Cycles", "a Python that has Blender's module bpy", "none is named", "Name one")


def path_trace(
    scene: Any, medium: Any, samples: int, settings: Any, *, use_cache: bool, progress: Any
) -> PathTraced:
    assert not use_cache  # a cached reference would have taken no time
    for done in range(samples // 4):
        progress(done + 1, samples // 4)
    noise = np.random.default_rng(1).normal(size=(SIDE, SIDE, 3)) * 0.05
    variance = np.full((SIDE, SIDE, 3), 0.05**2)
    return PathTraced(picture(1.0) + noise, variance, np.ones((SIDE, SIDE)), samples, 9.0, ())


class FakeRenderer:
    def __init__(self, adapter: str = "cpu") -> None:
        self.device = SimpleNamespace(adapter=SimpleNamespace(name=adapter))
        self.techniques: list[str] = []

    def draw(self, scene: Any, settings: Any, run_all_passes: bool) -> Any:
        assert run_all_passes and settings.size == (SIDE, SIDE)
        self.techniques.append(settings.technique)
        return SimpleNamespace(linear=lambda: picture(1.0 + OURS))


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return the module of the comparison with all renderers replaced."""
    monkeypatch.setattr(rendering, "cycles_passes", cycles_passes)
    monkeypatch.setattr(rendering, "path_trace", path_trace)
    monkeypatch.setattr(report, "load_mitsuba", lambda: None)
    monkeypatch.setattr(report, "blender_python", lambda: Path("python"))
    monkeypatch.setattr(report, "version", lambda name: "1.0")
    monkeypatch.setattr(report, "QUICK_SETTINGS", rendering.ComparisonSettings(SIDE, (4, 64), 16, 3))
    monkeypatch.setattr(dermis, "load_head", lambda name, subdivide: BALL)
    monkeypatch.setattr(dermis, "Renderer", FakeRenderer)
    return report


def test_noise_bias_and_time_are_separated(peers: Any, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "peers.json"
    peers.write_peer_report(lights="front", quick=True, output=out)
    (results,) = json.loads(out.read_text())["scenes"]
    rows = {(row["renderer"], row["setting"]): row for row in results["rows"]}
    ours = rows["dermis", "texture space, atlas 1024"]
    assert (ours["relrmse"], ours["energy_ratio"]) == pytest.approx((OURS, 1.0 + OURS), rel=0.02)
    walk = rows["Cycles, random walk", "4 paths per pixel"]
    # Noise is relative to the mean image, error to the reference; both have about the same energy.
    assert walk["noise"] == pytest.approx(NOISE / 2.0 / (1.0 + BIAS), rel=0.03)
    assert walk["relrmse"] == pytest.approx(np.hypot(BIAS, NOISE / 2.0), rel=0.03)
    assert walk["seconds"] == 2.0
    limit = rows["Cycles, random walk", "noise subtracted"]
    assert limit["relrmse"] == pytest.approx(BIAS, rel=0.03) and limit["seconds"] is None
    assert rows["Mitsuba, volpathmis", "16 paths per pixel"]["seconds"] == 9.0
    assert "goal 50" in capsys.readouterr().out


def test_time_to_equal_error_follows_from_noise_and_bias(peers: Any, tmp_path: Path) -> None:
    out = tmp_path / "peers.json"
    peers.write_peer_report(lights="front", quick=True, output=out)
    (results,) = json.loads(out.read_text())["scenes"]
    near = results["as_near"]["texture space, atlas 1024"]["same_error"]
    assert near["samples"] == pytest.approx(NOISE**2 / (OURS**2 - BIAS**2), rel=0.05)
    assert near["seconds"] == pytest.approx(0.5 * near["samples"])
    assert results["burley_against_random_walk"][0] < 3.0 * results["burley_against_random_walk"][1]
    assert results["ours_energy_put_right"]["screen space"] == pytest.approx(0.0, abs=0.01)


def test_results_except_times_are_reproducible(peers: Any, tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("first.json", "second.json")]
    for file in files:
        peers.write_peer_report(lights="front,back", quick=True, output=file)
    first, second = (json.loads(file.read_text())["scenes"] for file in files)
    for one, other in zip(first, second, strict=True):
        del one["as_near"], other["as_near"], one["published"], other["published"]
        for row in (*one["rows"], *other["rows"]):
            del row["seconds"], row["core_seconds"]
    assert first == second and [one["light"] for one in first] == ["front", "back"]


def test_without_blender_its_rows_are_skipped_with_a_note(
    peers: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setattr(report, "blender_python", no_blender)
    monkeypatch.setattr(rendering, "cycles_passes", no_blender)
    peers.write_peer_report(lights="front", quick=True)
    printed = capsys.readouterr()
    assert "Cycles is skipped. Cycles: expected a Python that has Blender's module bpy" in printed.err
    assert "Cycles, random walk" not in printed.out and "Mitsuba, volpathmis" in printed.out
    assert "Skipped: random-walk. Cycles: expected a Python" in printed.out


def test_without_mitsuba_there_is_no_reference(
    peers: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing() -> None:
        raise DermisError("path tracing: expected the package mitsuba.")

    monkeypatch.setattr(report, "load_mitsuba", missing)
    with pytest.raises(DermisError, match="path tracing: expected the package mitsuba"):
        peers.write_peer_report(quick=True, output=tmp_path / "peers.json")
    assert not list(tmp_path.iterdir())
    with pytest.raises(DermisError, match=r"peers\.txt"):
        peers.write_peer_report(quick=True, output=tmp_path / "peers.txt")


def test_progress_bar_ends_with_the_work(peers: Any) -> None:
    done: list[int] = []
    renderer = FakeRenderer()
    rendering.render_with_all_renderers(
        BALL,
        "front",
        peers.QUICK_SETTINGS,
        renderer,
        done.append,  # type: ignore[arg-type]
    )
    assert sum(done) == peers.QUICK_SETTINGS.progress_steps
    assert renderer.techniques.count(GPU_GEMS_3) == renderer.techniques.count(FRAGMENT_TECHNIQUE)
    assert renderer.techniques.count(GPU_GEMS_3) == renderer.techniques.count("screen-space")


def test_passes_of_2007_are_listed_beside_ours(peers: Any, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "peers.json"
    peers.write_peer_report(lights="front", quick=True, output=out)
    (results,), printed = json.loads(out.read_text())["scenes"], capsys.readouterr().out
    seconds = {row["setting"]: row["seconds"] for row in results["rows"]}
    for name in ("passes of 2007 as compute", "passes of 2007 as fragments"):
        ratio = results["published"][name]["ratio"]
        assert ratio == pytest.approx(seconds[name] / seconds["texture space, atlas 1024"])
        assert name not in results["as_near"]
        assert f"The {name} take {ratio:.2f} times as long" in printed


def test_unknown_lights_are_named(peers: Any) -> None:
    with pytest.raises(DermisError, match="--lights: expected names of front, back, laser with commas"):
        peers.write_peer_report(lights="front,moon", quick=True)


def test_a_bias_above_our_error_is_reported(peers: Any, tmp_path: Path, capsys: Any) -> None:
    class Nearer(FakeRenderer):
        def draw(self, scene: Any, settings: Any, run_all_passes: bool) -> Any:
            return SimpleNamespace(linear=lambda: picture(1.0 + 0.5 * BIAS))

    dermis.Renderer = Nearer  # type: ignore[misc]  # put back by the fixture's patch
    peers.write_peer_report(lights="front", quick=True)
    assert "never has as small an error, because its bias is larger" in capsys.readouterr().out


def test_page_is_written_with_all_placeholders_filled(
    peers: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    template = template_path(peers.PAGE).read_text(encoding="utf-8")
    (tmp_path / "templates").mkdir()
    (tmp_path / "templates" / "peers.md").write_text(template, encoding="utf-8")
    monkeypatch.setattr(report, "PAGE", tmp_path / "peers.md")
    monkeypatch.setattr(report, "RESULTS_FILE", tmp_path / "results" / "peers.json")
    monkeypatch.setattr(report, "ComparisonSettings", lambda: peers.QUICK_SETTINGS)
    peers.write_peer_report()
    page = (tmp_path / "peers.md").read_text(encoding="utf-8")
    assert page.count("| dermis | texture space, atlas 1024 |") == 2 and "{" not in page
    assert json.loads((tmp_path / "results" / "peers.json").read_text())["denoising"] is False
