"""The background behind the head, and the coverage of the head as alpha."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, scene_of, settings_of
from strand_setups import hairy
from tolerances import TWIN

from dermis.base.errors import DermisError
from dermis.environment.panorama import texel_directions
from dermis.frame.rendered_frame import RenderedFrame
from dermis.frame.renderer import Renderer
from dermis.images.colour import encode_srgb8
from dermis.images.io import write_exr
from dermis.mesh.primitives import uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.model import Scene

BALL = head_of(uv_sphere(30.0, 48, 24), colour=np.full((8, 8, 3), 0.5))
CAMERA = front_camera(BALL, frame_mm=120.0)
SCENE = scene_of(BALL, frontal(), camera=CAMERA)


def drawn(renderer: Renderer, scene: Scene = SCENE, **settings: Any) -> RenderedFrame:
    return renderer.draw(scene, settings_of(**({"samples": 4} | settings)))


def test_the_gradient_is_a_cool_grey_and_falls_off_to_the_corners(renderer: Renderer) -> None:
    plain = drawn(renderer).linear_rgba()
    cover = plain[..., 3:]
    for exposure in (1.0, 0.25, "auto"):  # which change the head, not what is behind it
        seen = drawn(renderer, exposure=exposure, background="gradient").linear()
        free = seen[cover[..., 0] == 0]
        red, green, blue = (free / free.mean(axis=1, keepdims=True)).T
        assert (red < green).all() and (green < blue).all() and blue.max() < 1.12 * red.min()
        assert 0.05 < free.min() < 0.1 and 0.15 < free.max() < 0.3
        assert seen[0, 0, 0] < seen[0, 24, 0] < seen[10, 24, 0]
    lit = drawn(renderer, background="gradient").linear()
    whole = cover[..., 0] == 1
    assert np.abs(lit - plain[..., :3])[whole].max() < TWIN


@pytest.mark.parametrize("blur", [0.0, 0.3])
def test_the_environment_is_sharp_or_blurred(renderer: Renderer, tmp_path: Any, blur: float) -> None:
    """An environment that is bright on its right half shows a step, or a soft edge."""
    world = np.where(texel_directions(256, 512)[..., :1] > 0, 1.0, 0.25) * np.ones(3)
    write_exr(tmp_path / "half.exr", world.astype(np.float32))
    around = Environment(name=str(tmp_path / "half.exr"), exposure=2.0)
    scene = Scene(BALL, (), front_camera(BALL, frame_mm=600.0), environment=around)
    seen = drawn(renderer, scene, background="environment", background_blur=blur, occlusion="none").linear()
    row = seen[2, :, 0]
    if blur == 0.0:
        assert row[:20] == pytest.approx(0.5, rel=1e-3) and row[28:] == pytest.approx(2.0, rel=1e-3)
    else:
        assert row[18] > 0.6 and row[29] < 1.9 and (np.diff(row) > -1e-3).all()


def test_background_environment_without_environment_is_refused(renderer: Renderer) -> None:
    with pytest.raises(DermisError, match="background environment: expected an environment"):
        drawn(renderer, background="environment")


def test_backgrounds_shed_no_light(renderer: Renderer) -> None:
    dark = scene_of(BALL, camera=CAMERA)
    seen = drawn(renderer, dark, background=(9.0, 9.0, 9.0))
    whole = drawn(renderer, dark).linear_rgba()[..., 3] == 1
    assert drawn(renderer, dark, background=(9.0, 9.0, 9.0)).linear()[whole].max() == 0.0
    assert seen.settings.background == (9.0, 9.0, 9.0)


def over(colours: NDArray[Any], alpha: NDArray[Any], behind: float) -> NDArray[Any]:
    return colours + (1 - alpha) * behind


@pytest.mark.parametrize("tone", ["none", "filmic"])
def test_alpha_composites_the_head_over_any_background(renderer: Renderer, tone: str) -> None:
    """Premultiplied floats over a colour equal the picture with that colour; bytes have straight alpha."""
    made = drawn(renderer, tone=tone)
    floats, levels = made.linear_rgba(), made.rgba8()
    grey = drawn(renderer, background=(0.3, 0.3, 0.3)).linear()
    assert np.abs(over(floats[..., :3], floats[..., 3:], 0.3) - grey).max() < TWIN
    alpha = floats[..., 3]
    edge = (alpha > 0) & (alpha < 1)
    assert edge.sum() > 20 and np.array_equal(levels[..., 3], np.rint(255 * alpha))
    assert (levels[alpha == 0] == 0).all()
    if tone == "none":
        straight = floats[edge][:, :3] / alpha[edge][:, None]
        assert np.abs(encode_srgb8(straight).astype(int) - levels[edge][:, :3]).max() <= 1
    whole = alpha == 1
    assert np.abs(levels[whole][:, :3].astype(int) - drawn(renderer, tone=tone).srgb8()[whole]).max() <= 1


def test_hairs_count_as_coverage(renderer: Renderer) -> None:
    head = hairy([[-90, 0, 1]], [[90, 0, 1]], 3.0, 1.0)
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=160.0))
    alpha = [drawn(renderer, scene, samples=1, strands=on).rgba8()[:, 1, 3] for on in (True, False)]
    assert alpha[0].max() > 200 and alpha[1].max() == 0


def test_alpha_is_available_for_sequences(renderer: Renderer) -> None:
    settings = settings_of(samples=4).model_dump()
    one = drawn(renderer)
    expected = one.rgba8(), one.linear_rgba()
    (levels,) = renderer.render_many([SCENE], alpha=True, **settings)
    (floats,) = renderer.render_many([SCENE], alpha=True, linear=True, **settings)
    assert np.array_equal(levels, expected[0]) and np.array_equal(floats, expected[1])
