"""Light that a camera's move leaves on the atlas is the light that would be drawn anew."""

from __future__ import annotations

import os
from typing import Any

import pytest
from setups import front_camera, frontal, head_of, scene_of, settings_of

from dermis.frame.passes.diffuse import Diffuse
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere
from dermis.scene.model import Scene

HEAD = head_of(uv_sphere(30.0, 24, 12))
SEQUENCES: dict[str, list[dict[str, Any]]] = {
    "back from two layouts": [{"seams": "stitch"}, {"seams": "multi-uv"}, {"seams": "stitch"}],
    "back from other blurs": [{}, {"technique": "gpu-gems-3"}, {}, {"technique": "one-blur"}, {}],
    "exposure": [{"exposure": 1e-6}, {"exposure": 1.0}],
    "colour beside the charts": [{"seams": "clear-colour", "seam_colour": (c, 0.1, 0.1)} for c in (0.1, 0.9)],
    "size": [{"atlas": 64}, {"atlas": 100}, {"atlas": 64}],
}


@pytest.fixture(scope="module")
def keeping() -> Renderer:
    """Keeps two of each thing, and levels in halves, whatever the adapter."""
    renderer = Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"), depth=2)
    renderer.stages.diffuse = Diffuse(renderer.device, "rgba16float")
    return renderer


def scene(frame_mm: float = 70.0) -> Scene:
    return scene_of(HEAD, frontal(), camera=front_camera(HEAD, frame_mm=frame_mm))


def drawn(renderer: Renderer, settings: dict[str, Any], *, keep_stages: bool) -> bytes:
    return renderer.draw(scene(), settings_of(**settings), keep_stages=keep_stages).linear().tobytes()


@pytest.mark.parametrize("name", SEQUENCES)
def test_kept_light_never_shows(keeping: Renderer, name: str) -> None:
    anew = []
    for settings in SEQUENCES[name]:
        keeping.forget()
        anew.append(drawn(keeping, settings, keep_stages=False))
    keeping.forget()
    kept = [drawn(keeping, settings, keep_stages=True) for settings in SEQUENCES[name]]
    assert [a == b for a, b in zip(kept, anew, strict=True)] == [True] * len(anew)


def test_a_camera_that_moves_leaves_the_light(keeping: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    keeping.forget()
    lit = []
    draw = keeping.stages.irradiance.draw

    def counted(*args: Any) -> None:
        lit.append(1)
        draw(*args)

    monkeypatch.setattr(keeping.stages.irradiance, "draw", counted)
    for frame_mm in (70.0, 60.0, 50.0):
        keeping.draw(scene(frame_mm), settings_of(), keep_stages=True)
    assert len(lit) == 1
    keeping.draw(scene(), settings_of())
    assert len(lit) == 2
