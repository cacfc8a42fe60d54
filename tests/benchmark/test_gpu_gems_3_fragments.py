"""The passes of 2007 drawn as fragments give what they give as compute."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, head_of, run_frame, scene_of
from tolerances import HALVES

from dermis.benchmark import gpu_gems_3_fragments
from dermis.benchmark.gpu_gems_3_fragments import published_as_fragments
from dermis.frame.renderer import Renderer
from dermis.gpu import Frame, download
from dermis.mesh.geometry import build_mesh
from dermis.mesh.primitives import SKIN, uv_sphere
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene

Floats = NDArray[np.float64]


class Drawn(NamedTuple):
    """One frame.

    levels : light that entered, then blurred
    results : their sum, what came through thin parts, and the image
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
    """Flat and lit from two sides, so that light comes through; its colour map is noise."""
    ball = uv_sphere(30.0, 24, 12)
    mesh = build_mesh(ball.positions * (1, 1, 0.1), ball.uv, ball.triangles, ball.material, SKIN)
    head = head_of(mesh, colour=np.random.default_rng(0).random((16, 16, 3)))
    lights = (
        DirectionalLight(direction=(1, -0.4, -1), irradiance=(2.0, 1.5, 1.0)),
        DirectionalLight(direction=(0, 0, 1), irradiance=(3.0, 3.0, 3.0)),
    )
    return scene_of(head, *lights, camera=front_camera(head, frame_mm=70.0))


def drawn(renderer: Renderer, scene: Scene, seams: str) -> Drawn:
    with pytest.MonkeyPatch.context() as patch:
        filled: list[str] = []
        fill = Frame.fill

        def counted(frame: Frame, stage: str, *rest: Any) -> None:
            filled.append(stage)
            fill(frame, stage, *rest)

        patch.setattr(Frame, "fill", counted)
        inputs = run_frame(renderer, scene, technique="gpu-gems-3", atlas=128, seams=seams)
    device, levels, layout = renderer.device, inputs.levels, inputs.layouts[0]
    assert layout.thin is not None
    stack = [download(device, levels.stack, layer=k) for k in range(1 + len(inputs.blurred_mm2))]
    results = layout.scattered, layout.thin.light, inputs.picture.radiance
    return Drawn(
        [level.astype(float) for level in stack],
        [download(device, one).astype(float) for one in results],
        len(filled),
    )


@pytest.fixture(scope="module", params=["clear-colour", "alpha"])
def both(renderer: Renderer, leaf: Scene, request: pytest.FixtureRequest) -> tuple[Drawn, Drawn]:
    compute = drawn(renderer, leaf, request.param)
    with published_as_fragments(renderer.device, renderer.stages):
        fragments = drawn(renderer, leaf, request.param)
    return compute, fragments


def test_light_blurs_and_sum_are_render_passes(both: tuple[Drawn, Drawn]) -> None:
    compute, fragments = both
    assert compute.filled == 0
    assert fragments.filled == 1 + 2 * 5 + 1


def test_every_level_is_the_same(both: tuple[Drawn, Drawn]) -> None:
    """But for roundings to halves, of which level k has seen 2 k and one more."""
    compute, fragments = both
    assert len(compute.levels) == len(fragments.levels) == 6
    assert not np.allclose(compute.levels[1], compute.levels[5], rtol=0.1)
    for k, (one, other) in enumerate(zip(compute.levels, fragments.levels, strict=True)):
        assert one[..., :3].max() > 0.3
        assert np.abs(one - other).max() < (1 + 2 * k) * HALVES * one.max()


def test_so_are_their_sum_what_comes_through_and_the_image(both: tuple[Drawn, Drawn]) -> None:
    for one, other in zip(both[0].results, both[1].results, strict=True):
        assert one[..., :3].max() > 0.01
        assert np.abs(one - other).max() < 11 * HALVES * one.max()


def test_afterwards_all_is_compute_again(renderer: Renderer, leaf: Scene) -> None:
    before = renderer.stages.irradiance, renderer.stages.published, renderer.stages.combine
    with pytest.raises(KeyError), published_as_fragments(renderer.device, renderer.stages):
        assert renderer.stages.combine is not before[2]
        raise KeyError
    assert (renderer.stages.irradiance, renderer.stages.published, renderer.stages.combine) == before
    assert drawn(renderer, leaf, "alpha").filled == 0


def test_what_cannot_be_compiled_changes_nothing(
    renderer: Renderer, leaf: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frames that follow are drawn as before, as those of a benchmark that leaves a case out."""

    def fail(*_: Any) -> None:
        raise MemoryError

    monkeypatch.setattr(gpu_gems_3_fragments, "FragmentSum", fail)
    with pytest.raises(MemoryError), published_as_fragments(renderer.device, renderer.stages):
        pass
    assert drawn(renderer, leaf, "alpha").filled == 0
