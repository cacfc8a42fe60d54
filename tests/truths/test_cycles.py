"""Scenes for Cycles, and its pictures where DERMIS_BLENDER_PYTHON names a Python with bpy."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lit_balls import BALL, LIGHTS, ball_scene

from dermis.apps.truths.cycles import (
    PYTHON_VARIABLE,
    PrincipledSkin,
    SubsurfaceMethod,
    cycles_passes,
    cycles_render,
    describe_scene,
)
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.path_traced import Lambertian, path_trace
from dermis.base.errors import DermisError
from dermis.optics.media import published_media
from dermis.scene.environment import Environment
from dermis.scene.settings import Settings

SKIN1 = published_media()["skin1"].with_eta(1.0)
GREY = Lambertian((0.8, 0.5, 0.2))
blender = pytest.mark.skipif(not os.environ.get(PYTHON_VARIABLE), reason=f"{PYTHON_VARIABLE} is not set")


def test_skin_is_described_by_colour_and_radius() -> None:
    described, arrays = describe_scene(ball_scene(LIGHTS["point"]), SKIN1, "random-walk", (8, 8))
    (skin,) = described["materials"]
    (layer,) = SKIN1.layers
    assert skin["method"] == "RANDOM_WALK"
    assert skin["colour"] == pytest.approx([diffuse_albedo(float(a)) for a in layer.alpha_prime])
    assert np.array(skin["radius"]) * 100.0 == pytest.approx(4.0 * np.pi * layer.mean_free_path_mm)
    assert len(arrays["positions"]) == len(BALL.mesh.positions)


def test_missing_blender_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(PYTHON_VARIABLE, raising=False)
    with pytest.raises(DermisError, match=rf"none is named\. Set {PYTHON_VARIABLE}"):
        cycles_render(ball_scene(LIGHTS["point"]), SKIN1)
    with pytest.raises(DermisError, match="there is no file"):
        cycles_render(ball_scene(LIGHTS["point"]), SKIN1, python=tmp_path / "python")


def test_unsupported_features_of_cycles_are_refused() -> None:
    scene = ball_scene(LIGHTS["point"])
    with pytest.raises(DermisError, match="expected one layer, for Cycles, but it has 3"):
        cycles_render(scene, published_media()["dj3"])
    with pytest.raises(DermisError, match="method: expected one of random-walk, burley"):
        cycles_render(scene, SKIN1, method="gaussian")  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="samples: expected a whole number from 1, but got 0"):
        cycles_passes(scene, SKIN1, [4, 0])
    dark = LIGHTS["point"].model_copy(update={"shadows": False})
    with pytest.raises(DermisError, match="light 1: expected a light with shadows"):
        cycles_render(ball_scene(dark), SKIN1)


@blender
@pytest.mark.parametrize("kind", LIGHTS)
def test_lights_and_pixels_match_mitsuba(kind: str) -> None:
    pytest.importorskip("mitsuba")
    scene, settings = ball_scene(LIGHTS[kind]), Settings(size=(64, 64))
    ours, theirs = path_trace(scene, GREY, 128, settings), cycles_render(scene, GREY, 64, settings)
    whole = ours.mask > 0.999
    noise = (ours.variance[whole] + theirs.variance[whole]).mean()
    squared = np.mean((ours.image[whole] - theirs.image[whole]) ** 2) - noise
    assert squared < 0.01**2 * np.mean(ours.image[whole] ** 2)
    assert theirs.image[whole].sum() / ours.image[whole].sum() == pytest.approx(1.0, abs=0.004)


@blender
@pytest.mark.samples
def test_environment_matches_mitsuba() -> None:
    pytest.importorskip("mitsuba")
    scene = ball_scene(environment=Environment(name="lebombo", rotation_degrees=70.0))
    ours, theirs = (
        render(scene, GREY, 192, Settings(size=(48, 48))) for render in (path_trace, cycles_render)
    )
    whole = ours.mask > 0.999
    noise = (ours.variance[whole] + theirs.variance[whole]).mean()
    squared = np.mean((ours.image[whole] - theirs.image[whole]) ** 2) - noise
    # Errors below the reference's noise of 4 % cannot be measured.
    assert squared < 0.02**2 * np.mean(ours.image[whole] ** 2)
    assert theirs.image[whole].sum() / ours.image[whole].sum() == pytest.approx(1.0, abs=0.006)


@blender
@pytest.mark.parametrize(("method", "tolerance"), [("random-walk", 0.03), ("burley", 0.01)])
def test_ball_returns_its_colour(method: SubsurfaceMethod, tolerance: float) -> None:
    scene = ball_scene(environment=Environment(name="uniform"))
    lit = cycles_render(scene, SKIN1, 64, Settings(size=(32, 32)), method=method)
    colour = [diffuse_albedo(float(a)) for a in SKIN1.layers[0].alpha_prime]
    mean = lit.image[lit.mask > 0.999].mean(axis=0)
    assert mean == pytest.approx(colour, rel=tolerance)
    assert lit.samples == 64 and lit.seconds > 0.0


@blender
def test_passes_have_separate_repeatable_seeds() -> None:
    scene, settings = ball_scene(LIGHTS["point"]), Settings(size=(16, 16))
    first, again = (cycles_passes(scene, SKIN1, [1, 4, 4], settings, seed=7) for _ in range(2))
    assert [one.samples for one in first] == [1, 4, 4]
    assert all((one.image == other.image).all() for one, other in zip(first, again, strict=True))
    assert (first[1].image != first[2].image).any()
    other = cycles_passes(scene, SKIN1, [4], settings, seed=8)[0]
    assert (other.image == first[1].image).all() and other.core_seconds > 0.0


@blender
def test_coat_reflects_and_dims_the_skin() -> None:
    """At index 1.4 the surface reflects 3 to 6 % of uniform light; the skin's colour scales the rest."""
    scene = ball_scene(environment=Environment(name="uniform"))
    grey = PrincipledSkin(np.full((2, 2, 3), 0.5, np.float32), (0.5, 0.5, 0.5), 0.3)
    means = []
    for skin in (grey, replace(grey, colour=np.zeros((2, 2, 3), np.float32))):
        (one,) = cycles_passes(scene, skin, [64], Settings(size=(24, 24)))
        means.append(float(one.image[one.coverage > 0.999].mean()))
    whole, surface = means
    assert 0.03 < surface < 0.06
    assert whole - surface == pytest.approx(0.5 * (1.0 - surface), rel=0.1)
