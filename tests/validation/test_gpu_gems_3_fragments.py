"""Passes of GPU Gems 3 as fragment shaders against the same as compute shaders."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, head_of, scene_of, settings_of
from tolerances import HALVES

from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, GPU_GEMS_3
from dermis.apps.validation.benchmarks.gpu_gems_3_fragments import FRAGMENT_PASSES as AS_FRAGMENTS
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, uv_sphere
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene
from dermis.scene.techniques import TECHNIQUES

Floats = NDArray[np.float64]


class Drawn(NamedTuple):
    """Intermediate results of one frame.

    levels : light that entered, then blurred levels
    results : their sum, the transmitted light, and the image
    filled : render passes that filled targets
    """

    levels: list[Floats]
    results: list[Floats]
    filled: int


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


@pytest.fixture(scope="module")
def leaf() -> Scene:
    """Return a flat head lit from two sides, so that light is transmitted; its colour map is noise."""
    ball = uv_sphere(30.0, 24, 12)
    mesh = build_mesh(ball.positions * (1, 1, 0.1), ball.uv, ball.triangles, ball.material, SKIN_MATERIALS)
    head = head_of(mesh, colour=np.random.default_rng(0).random((16, 16, 3)))
    lights = (
        DirectionalLight(direction=(1, -0.4, -1), irradiance=(2.0, 1.5, 1.0)),
        DirectionalLight(direction=(0, 0, 1), irradiance=(3.0, 3.0, 3.0)),
    )
    return scene_of(head, *lights, camera=front_camera(head, frame_mm=70.0))


def drawn(renderer: Renderer, scene: Scene, technique: str, seams: str) -> Drawn:
    settings = settings_of(technique=technique, atlas=128, seams=seams)
    with pytest.MonkeyPatch.context() as patch:
        filled: list[str] = []
        draw_fullscreen = CommandList.draw_fullscreen

        def counted(frame: CommandList, stage: str, *rest: Any) -> None:
            filled.append(stage)
            draw_fullscreen(frame, stage, *rest)

        patch.setattr(CommandList, "draw_fullscreen", counted)
        renderer.draw(scene, settings, run_all_passes=True)
    inputs = renderer.prepare(scene, settings)
    device, levels, layout = renderer.device, inputs.resources.diffusion.levels, inputs.layouts[0]
    assert layout.translucency is not None
    stack = [
        download(device, levels.stacks[0], layer=k) for k in range(1 + len(inputs.blurs[0].variance_mm2))
    ]
    results = layout.scattered, layout.translucency.pairs.transmitted, inputs.resources.post.picture.radiance
    return Drawn(
        [level.astype(float) for level in stack],
        [download(device, one).astype(float) for one in results],
        len(filled),
    )


@pytest.fixture(scope="module", params=["clear-colour", "alpha"])
def both(renderer: Renderer, leaf: Scene, request: pytest.FixtureRequest) -> tuple[Drawn, Drawn]:
    compute = drawn(renderer, leaf, GPU_GEMS_3, request.param)
    with TECHNIQUES.temporary_entry(FRAGMENT_TECHNIQUE, AS_FRAGMENTS):
        fragments = drawn(renderer, leaf, FRAGMENT_TECHNIQUE, request.param)
    return compute, fragments


def test_light_blurs_and_sum_are_render_passes(both: tuple[Drawn, Drawn]) -> None:
    compute, fragments = both
    assert compute.filled == 0
    assert fragments.filled == 1 + 2 * 5 + 1


def test_every_level_is_the_same(both: tuple[Drawn, Drawn]) -> None:
    """Level k differs only by 2 k + 1 roundings to half precision."""
    compute, fragments = both
    assert len(compute.levels) == len(fragments.levels) == 6
    assert not np.allclose(compute.levels[1], compute.levels[5], rtol=0.1)
    for k, (one, other) in enumerate(zip(compute.levels, fragments.levels, strict=True)):
        assert one[..., :3].max() > 0.3
        assert np.abs(one - other).max() < (1 + 2 * k) * HALVES * one.max()


def test_sum_transmitted_light_and_image_match(both: tuple[Drawn, Drawn]) -> None:
    for one, other in zip(both[0].results, both[1].results, strict=True):
        assert one[..., :3].max() > 0.01
        assert np.abs(one - other).max() < 11 * HALVES * one.max()


def test_compute_passes_are_restored_afterwards(renderer: Renderer, leaf: Scene) -> None:
    with pytest.raises(KeyError), TECHNIQUES.temporary_entry(FRAGMENT_TECHNIQUE, AS_FRAGMENTS):
        assert drawn(renderer, leaf, FRAGMENT_TECHNIQUE, "alpha").filled > 0
        raise KeyError
    assert FRAGMENT_TECHNIQUE not in TECHNIQUES
    assert drawn(renderer, leaf, GPU_GEMS_3, "alpha").filled == 0
