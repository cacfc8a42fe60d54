"""`benchmarks/viewer.py` on a small head: its measurements, and the tables made from them."""

from __future__ import annotations

import json
import random
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offscreen_input import ADAPTER
from small_head import write_head

from dermis.base.errors import DermisError
from dermis.cli.options import parse_size

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module", autouse=True)
def found_modules() -> Any:
    pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")
    sys.path.append(str(FOLDER))  # last, for some of its names are also the standard library's
    yield
    sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return a plan of small sizes, at which the centre is beside the button that opens the panel."""
    from gpu_server import quick_plan
    from viewer_input import Plan

    head = write_head(tmp_path_factory.mktemp("benchmark") / "head.obj")
    words = quick_plan(ADAPTER, str(head)).viewer
    given = dict(zip(words[::2], words[1::2], strict=True))
    size, atlas, frames = parse_size(given["--size"]), int(given["--atlas"]), int(given["--frames"])
    return Plan(str(head), ADAPTER, size, atlas=atlas, samples=1, frames=frames)


@pytest.fixture(scope="module")
def driver(plan: Any) -> Any:
    from viewer_input import offscreen

    return offscreen(plan)


def test_each_motion_moves_the_picture_and_nothing_else_is_computed(driver: Any, plan: Any) -> None:
    from viewer_input import MOTIONS, Clock, speeds

    found = dict(speeds(driver, plan, Clock()))
    assert list(found) == list(MOTIONS)
    ran = {name: set(one["stages"]) for name, one in found.items()}
    assert ran["camera"] == {"visibility", "shade", "post"} and ran["exposure"] == {"post"}
    assert "shadows" in ran["light"] and "surface" in ran["roughness"] - ran["melanin"]
    assert "diffuse" in ran["melanin"] and "shape" in ran["expression"]
    assert all(one["frames_per_s"] > 0.0 and one["processor_ms"] > 0.0 for one in found.values())
    assert {one["frames"] for one in found.values()} == {plan.frames}
    assert all(one["frame_ms"] <= one["late_frame_ms"] <= one["longest_frame_ms"] for one in found.values())


def test_delays_are_measured_to_the_following_picture(driver: Any, plan: Any) -> None:
    from viewer_input import Clock
    from viewer_memory import delays

    found = dict(delays(driver, plan, Clock()))
    assert [one["count"] for one in found.values()] == [plan.frames] * 2
    assert all(0.0 < one["median_ms"] <= one["late_ms"] for one in found.values())


def test_without_time_a_few_frames_of_each_section_are_measured(driver: Any, plan: Any) -> None:
    from viewer_input import Clock, speeds
    from viewer_memory import delays

    many = replace(plan, frames=1000)
    assert {one["frames"] for _, one in speeds(driver, many, Clock(0.0))} == {3}
    assert [one["count"] for _, one in delays(driver, many, Clock(0.0))] == [3, 3]


def test_a_failing_viewer_has_no_frame_rate(driver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driver.viewer, "failure", DermisError("no device"))
    with pytest.raises(DermisError, match="no device"):
        driver.frame()
    monkeypatch.undo()

    def broken() -> None:
        raise ValueError("a fault of the viewer")

    monkeypatch.setattr(driver, "_fault", None)
    monkeypatch.setattr(driver.viewer, "draw", broken)
    with pytest.raises(ValueError, match="a fault of the viewer"):
        driver.frame()


def test_waiting_ends_for_pictures_that_never_settle(driver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("viewer_input._REST_S", 0.0)
    monkeypatch.setattr(type(driver.viewer), "is_still", False)
    with pytest.raises(RuntimeError, match="does not come to rest"):
        driver.rest()


def test_a_failing_section_keeps_earlier_figures_and_the_reason(tmp_path: Path) -> None:
    from viewer import Results, tables
    from viewer_input import Clock

    def broken(clock: Any) -> Any:
        assert clock.remaining_s <= 10.0
        one = {"frames_per_s": 50.0, "frame_ms": 20.0, "late_frame_ms": 25.0, "longest_frame_ms": 90.0}
        yield "camera", one | {"processor_ms": 10.0, "stages": ["post"]}
        raise RuntimeError("the page does not come to rest")

    plan = {"head": "human", "size": (240, 160), "atlas": 64, "samples": 1}
    found = Results(
        {"plan": plan, "adapter": "none", "date": "2026-01-01"}, tmp_path / "told.json", Clock(10.0)
    )
    found.record("speed", broken)
    written = json.loads((tmp_path / "told.json").read_text(encoding="utf-8"))
    assert written["speed"]["camera"]["frame_ms"] == 20.0
    assert "RuntimeError: the page does not come to rest" in written["speed"]["ended"]
    all_figures = tables(written)
    assert (
        "| camera | 50.0 | 20.0 | 25.0, 90.0 | 10.0 | post |" in all_figures
        and "speed ended early" in all_figures
    )


def test_a_failing_server_is_reported_with_the_reason(plan: Any) -> None:
    from viewer_input import Clock
    from viewer_page import page_figures

    with pytest.raises(RuntimeError, match="no such head"):
        dict(page_figures(replace(plan, head="no such head"), None, Clock(60.0)))


def test_all_kinds_of_change_are_drawn_and_the_memory_is_watched(
    driver: Any, plan: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    import viewer_memory

    some = {name: viewer_memory.KINDS[name] for name in ("orbit", "light", "mix", "view")}
    monkeypatch.setattr(viewer_memory, "KINDS", some)
    found = viewer_memory.memory_samples(driver, plan, minutes=0.0, changes=3)
    assert found["changes"] == 3 == sum(found["kinds"].values())
    assert set(some) < set(found["kinds"])
    assert found["samples"][0]["changes"] == 0 and found["samples"][-1]["changes"] == 3
    assert min(one["device_mb"] for one in found["samples"]) > 0.0


def test_each_kind_of_change_makes_another_state(driver: Any) -> None:
    from viewer_memory import KINDS

    from dermis.apps.viewer.state import states_equal

    for kind in KINDS.values():
        changed = [kind(driver.first, random.Random(seed)) for seed in range(6)]
        assert any(not states_equal(state, driver.first) for state in changed)


def test_growth_is_measured_in_the_second_half() -> None:
    from viewer_memory import growth

    changes = np.arange(21) * 50.0
    first = np.maximum(0.0, 500.0 - changes)
    taken = [
        {"changes": float(n), "resident_mb": float(900.0 - m + 0.02 * n), "device_mb": 70.0}
        for n, m in zip(changes, first, strict=True)
    ]
    found = growth(taken)
    assert found["resident_mb_per_1000"] == pytest.approx(20.0)
    assert found["device_mb_per_1000"] == pytest.approx(0.0, abs=1e-9)
