"""Techniques against references on a ball, where shadows and curvature are known."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.apps.validation.comparisons.compare import Comparison, compare
from dermis.apps.validation.comparisons.references import REFERENCES
from dermis.apps.validation.comparisons.report import write_report
from dermis.apps.validation.comparisons.scenes import LIGHTS, REGIONS, comparison_scene
from dermis.base.errors import DermisError
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, uv_sphere
from dermis.scene.heads import load_head
from dermis.scene.settings import Settings

BALL = Head("ball", uv_sphere(100.0, 96, 48), Maps())
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
SETTINGS = Settings(size=(64, 64), atlas=1024, shadow_size=256)


@pytest.fixture(scope="module")
def stripe_comparison() -> Comparison:
    """Return a scene with a narrow stripe, next to which all light is scattered light."""
    return compare(
        BALL,
        "surface-integral",
        ("none", "texture-space"),
        light="laser",
        region="ear",
        settings=SETTINGS,
        adapter=ADAPTER,
    )


def test_scattering_reduces_the_error(stripe_comparison: Comparison) -> None:
    none, ours = stripe_comparison.rows
    assert ours.relrmse < 0.2 * none.relrmse
    assert ours.energy_ratio == pytest.approx(1.0, abs=0.03)
    assert ours.relrmse_se == 0.0 and ours.ms > 0


def test_reference_and_image_are_aligned(stripe_comparison: Comparison) -> None:
    """The brightest columns of image and reference are the same, so rays, lights and positions agree."""
    ours = stripe_comparison.images["texture-space"]
    peaks = [picture.sum(axis=(0, 2)).argmax() for picture in (ours, stripe_comparison.reference.image)]
    assert abs(int(peaks[0]) - int(peaks[1])) <= 1


def test_heat_equation_agrees_on_a_gently_curved_surface(stripe_comparison: Comparison) -> None:
    heat = compare(
        BALL,
        "heat",
        ("none", "texture-space"),
        light="laser",
        region="ear",
        settings=SETTINGS,
        adapter=ADAPTER,
    )
    none, ours = heat.rows
    assert 0 < heat.reference.mask.sum() < stripe_comparison.reference.mask.sum()
    assert ours.relrmse < 0.2 * none.relrmse


def test_report_contains_all_pictures(stripe_comparison: Comparison, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", stripe_comparison)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("data:image/png;base64,") == 1 + 2 * len(stripe_comparison.rows)
    assert "surface-integral" in text and "http" not in text


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("region", REGIONS)
def test_scenes_use_no_colour_map(light: str, region: str) -> None:
    scene = comparison_scene(BALL, light, region, "gpu-gems-3")
    assert scene.head.maps.colour is None and scene.skin.specular_strength == 0.0
    assert scene.skin.albedo == "profile" and scene.skin.energy == "none"
    assert np.isfinite(scene.camera.position).all()


@pytest.mark.parametrize("name", ["human", pytest.param("lee_perry_smith", marks=pytest.mark.samples)])
def test_back_light_illuminates_the_ear_and_not_the_shoulder(name: str) -> None:
    head = load_head(name)
    target = comparison_scene(head, "back", "ear", "gpu-gems-3").lights[0].target
    assert 75.0 < target[0] < 95.0 and abs(target[1]) < 30.0 and -50.0 < target[2] < 0.0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"against": "taste"}, "--against: expected one of"),
        ({"medium": "marzipan"}, "--medium: expected one of"),
        ({"light": "moon"}, "--light: expected one of"),
        ({"region": "elbow"}, "--region: expected one of"),
    ],
)
def test_unknown_names_are_refused(words: dict[str, Any], says: str) -> None:
    against = words.pop("against", "surface-integral")
    with pytest.raises(DermisError, match=says):
        compare(BALL, against, ("none",), settings=SETTINGS, adapter=ADAPTER, **words)


def test_a_picture_without_the_head_is_refused_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its only pixel lies between two balls."""
    monkeypatch.setitem(
        REFERENCES, "surface-integral", lambda subject, samples: pytest.fail("it was computed")
    )
    ball = uv_sphere(30.0, 16, 8)
    hits = np.vstack([ball.positions + np.array([x, 0, 0]) for x in (-60, 60)])
    uv = np.vstack([ball.uv * (0.5, 1) + (x, 0) for x in (0, 0.5)])
    triangles = np.vstack([ball.triangles, ball.triangles + len(ball.positions)])
    balls = Head("balls", build_mesh(hits, uv, triangles, np.tile(ball.material, 2), SKIN_MATERIALS), Maps())
    with pytest.raises(DermisError, match="the picture: expected a pixel that shows nothing but the head"):
        single = Settings(size=(1, 1), atlas=64)
        compare(balls, "surface-integral", ("none",), settings=single, adapter=ADAPTER)
