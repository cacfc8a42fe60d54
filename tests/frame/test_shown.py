"""Results that are reused equal those that are computed again."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest
from setups import front_camera, frontal, head_of, scene_of, settings_of

from dermis.frame.programs import HALF_TEXEL_FORMAT
from dermis.frame.renderer import Renderer
from dermis.frame.techniques import technique
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
def keeping() -> Iterator[Renderer]:
    """Return a renderer with two variants per resource, and half-float levels on any adapter."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(technique, "level_format", lambda _: HALF_TEXEL_FORMAT)
        yield Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"), cache_size=2)


def scene(frame_mm: float = 70.0) -> Scene:
    return scene_of(HEAD, frontal(), camera=front_camera(HEAD, frame_mm=frame_mm))


def drawn(renderer: Renderer, settings: dict[str, Any], **draw: Any) -> bytes:
    return renderer.draw(scene(), settings_of(**settings), **draw).linear().tobytes()


@pytest.mark.parametrize("name", SEQUENCES)
def test_reused_light_does_not_change_pictures(keeping: Renderer, name: str) -> None:
    fresh = []
    for settings in SEQUENCES[name]:
        keeping.clear_cache()
        fresh.append(drawn(keeping, settings))
    keeping.clear_cache()
    kept = [drawn(keeping, settings) for settings in SEQUENCES[name]]
    assert [a == b for a, b in zip(kept, fresh, strict=True)] == [True] * len(fresh)
    assert drawn(keeping, SEQUENCES[name][-1], run_all_passes=True) == fresh[-1]


def test_only_affected_stages_run_again(keeping: Renderer) -> None:
    """Check the stages that run after a change of exposure, camera or light only."""
    keeping.clear_cache()
    plain, near = scene(), scene(60.0)
    brighter = scene_of(HEAD, frontal(4.0), camera=near.camera)
    frames = ((plain, 1.0), (plain, 1.0), (plain, 2.0), (near, 2.0), (brighter, 2.0))
    ran = []
    for one, exposure in frames:
        keeping.draw(one, settings_of(exposure=exposure))
        ran.append(set(keeping.graph.executed_stages))
    lit = {"irradiance", "diffuse", "translucency", "combine"}
    whole = lit | {"pairs", "shape", "stretch", "surface", "visibility", "shade", "post"}
    assert ran == [whole, set(), {"post"}, {"visibility", "shade", "post"}, lit | {"shade", "post"}]
    keeping.draw(brighter, settings_of(exposure=2.0), run_all_passes=True)
    assert set(keeping.graph.executed_stages) == whole
