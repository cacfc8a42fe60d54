"""`benchmarks/viewer.py` on a small head: what it runs, and what it makes of its figures."""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from offscreen_hands import ADAPTER
from small_head import write_head

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
    """At the sizes of the quick trial: a pointer in the middle must be beside what brings the panel back."""
    from gpu_sections import quick_plan
    from viewer_hands import Plan

    head = write_head(tmp_path_factory.mktemp("benchmark") / "head.obj")
    words = quick_plan(ADAPTER, str(head)).viewer
    given = dict(zip(words[::2], words[1::2], strict=True))
    size, atlas, frames = parse_size(given["--size"]), int(given["--atlas"]), int(given["--frames"])
    return Plan(str(head), ADAPTER, size, atlas=atlas, samples=1, frames=frames)


@pytest.fixture(scope="module")
def hands(plan: Any) -> Any:
    from viewer_hands import offscreen

    return offscreen(plan)


def test_each_motion_moves_the_picture_and_nothing_else_is_computed(hands: Any, plan: Any) -> None:
    from viewer_hands import MOTIONS, speeds

    found = speeds(hands, plan)
    assert list(found) == list(MOTIONS)
    ran = {name: set(one["stages"]) for name, one in found.items()}
    assert ran["camera"] == {"visibility", "shade", "post"} and ran["exposure"] == {"post"}
    assert "shadows" in ran["light"] and "irradiance" in ran["roughness"] - ran["melanin"]
    assert "diffuse" in ran["melanin"]
    assert all(one["frames_per_s"] > 0.0 and one["processor_ms"] > 0.0 for one in found.values())


def test_delays_are_those_of_pictures_that_follow(hands: Any, plan: Any) -> None:
    from viewer_hands import delays

    found = delays(hands, plan)
    assert [one["count"] for one in found.values()] == [plan.frames] * 2
    assert all(0.0 < one["median_ms"] <= one["late_ms"] for one in found.values())


def test_all_kinds_of_change_are_drawn_and_the_memory_is_watched(
    hands: Any, plan: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    import viewer_memory

    some = {name: viewer_memory.KINDS[name] for name in ("turn", "light", "mix", "view")}
    monkeypatch.setattr(viewer_memory, "KINDS", some)
    found = viewer_memory.endured(hands, plan, minutes=0.0, changes=3)
    assert found["changes"] == 3 == sum(found["kinds"].values())
    assert set(some) < set(found["kinds"])
    assert found["samples"][0]["changes"] == 0 and found["samples"][-1]["changes"] == 3
    assert min(one["device_mb"] for one in found["samples"]) > 0.0


def test_each_kind_of_change_makes_another_state(hands: Any) -> None:
    from viewer_memory import KINDS

    from dermis.viewer.state import same

    for kind in KINDS.values():
        assert any(not same(kind(hands.first, random.Random(seed)), hands.first) for seed in range(6))


def test_growth_is_that_of_the_second_half() -> None:
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
