"""Bloom compared with a pyramid in NumPy; no light is lost, and no pass runs without bloom."""

from __future__ import annotations

from itertools import pairwise

import light_twins
import numpy as np
import pytest
from numpy.typing import NDArray
from setups import frontal, head_of, scene_of, settings_of
from tolerances import TWIN

from dermis.frame.features.post import bloom
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, Device, download, make_texture, upload
from dermis.mesh.primitives import plane

Floats = NDArray[np.float64]


def bloomed(device: Device, picture: Floats, share: float) -> Floats:
    size = picture.shape[1], picture.shape[0]
    source, glow = make_texture(device, size, "rgba32float"), bloom.make_bloom(device, size)
    upload(device, source, picture)
    frame = CommandList(device)
    made = bloom.draw(frame, glow, source, share)
    frame.submit()
    return download(device, made).astype(float)


@pytest.mark.parametrize(("size", "count"), [((96, 80), 2), ((130, 67), 2), ((20, 12), 1), ((256, 128), 3)])
def test_bloom_matches_numpy(device: Device, size: tuple[int, int], count: int) -> None:
    picture = np.random.default_rng(1).exponential(size=(size[1], size[0], 4)).astype(np.float32)
    made, exact = (
        bloomed(device, picture, 0.3),
        light_twins.bloomed(picture.astype(float), 0.3, count),
    )
    assert np.abs(made[..., :3] - exact[..., :3]).max() < TWIN * exact.max()
    assert np.array_equal(made[..., 3], picture[..., 3])


def test_a_point_of_light_spreads_and_keeps_its_power(device: Device) -> None:
    picture = np.zeros((256, 256, 4))
    picture[120, 132] = 100.0
    made = bloomed(device, picture, 0.25)[..., 0]
    assert made.sum() == pytest.approx(100.0, rel=1e-4)
    assert made[120, 132] > 75.0
    ring = [made[120, 132 + r] for r in (2, 6, 12, 24)]
    assert all(a > b > 0 for a, b in pairwise(ring))
    assert made[120, 255] == 0


def test_even_light_stays_even(device: Device) -> None:
    picture = np.full((96, 160, 4), 0.7)
    assert np.abs(bloomed(device, picture, 1.0)[..., :3] - 0.7).max() < TWIN


def test_bloom_runs_only_when_enabled(renderer: Renderer) -> None:
    scene = scene_of(head_of(plane(30.0)), frontal())
    ran = []
    for share in (0.0, 0.3):
        drawn = renderer.draw(scene, settings_of(bloom=share, size=(128, 128)), run_all_passes=True)
        ran.append("bloom" in renderer.graph.executed_stages)
    assert ran == [False, True]
    image = drawn.linear()
    assert 0 < image[64, 34, 0] < 0.2 * image[64, 64, 0]  # beside the plane
    assert renderer.draw(scene, settings_of(size=(128, 128))).linear()[64, 34].max() == 0
