"""Blurs as published in 2007, with their known flaws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from setups import resting

from dermis.atlas.build import build_atlas
from dermis.frame.features.diffusion.pyramid import Blur
from dermis.frame.techniques.gpu_gems_3 import TECHNIQUE
from dermis.gpu import CommandList, Device, download, upload
from dermis.mesh.primitives import plane

SIZE = 256
TEXELS_PER_MM = 4.0
VARIANCES = np.array([0.0484, 0.187, 0.567, 1.99])
BLUR = Blur(VARIANCES, np.zeros((4, 3)), (0,) * 5)


@pytest.fixture(scope="module")
def levels(device: Device) -> list[np.ndarray]:
    """Return a lit texel blurred over a plane."""
    atlas = build_atlas(plane(SIZE / TEXELS_PER_MM), SIZE)
    space = TECHNIQUE.make_levels(device, SIZE, (BLUR.halvings,))
    light = np.zeros((SIZE, SIZE, 4))
    light[..., 3] = 1.0
    light[SIZE // 2, SIZE // 2, :3] = 1000.0
    upload(device, space.stacks[0], light)
    frame = CommandList(device)
    TECHNIQUE.blur_levels(frame, space, resting(device, atlas), BLUR)
    frame.submit()
    return [
        download(device, space.stacks[0], layer=k + 1)[..., 0].astype(float) / 1000.0
        for k in range(len(VARIANCES))
    ]


def test_published_blur_gains_a_thousandth_and_half_floats_lose_more(levels: list[np.ndarray]) -> None:
    """The seven weights sum to 1.001 in each pass; some adapters truncate half floats."""
    for k, level in enumerate(levels, start=1):
        assert 0.985 < level.sum() < 1.002 ** (2 * k)


def test_published_blur_is_too_wide(levels: list[np.ndarray]) -> None:
    """The weights have a variance of 1.08, and interpolation adds more for steps below one texel."""
    y, x = np.indices((SIZE, SIZE)) - SIZE // 2
    for level, variance in zip(levels, VARIANCES, strict=True):
        wide = (level * (x**2 + y**2)).sum() / (2 * level.sum() * TEXELS_PER_MM**2)
        assert 1.05 < wide / variance < 1.6


def test_seven_taps_leave_gaps(levels: list[np.ndarray]) -> None:
    """A wide Gaussian of a narrow source shows its taps."""
    row = levels[-1][SIZE // 2]
    exact = np.exp(-((np.arange(SIZE) - SIZE // 2) ** 2) / (2 * VARIANCES[-1] * TEXELS_PER_MM**2))
    assert np.abs(row / row.max() - exact)[SIZE // 2 - 12 : SIZE // 2 + 13].max() > 0.01


def test_clear_colour_does_not_darken_edges(device: Device) -> None:
    """Weights of 1.001 must not give coverage above 1, which would subtract the clear colour."""
    space = TECHNIQUE.make_levels(device, SIZE, (BLUR.halvings,))
    upload(device, space.stacks[0], np.dstack([np.zeros((SIZE, SIZE, 3)), np.ones((SIZE, SIZE))]))
    frame = CommandList(device)
    atlas = resting(device, build_atlas(plane(SIZE / TEXELS_PER_MM), SIZE))
    TECHNIQUE.blur_levels(frame, space, atlas, replace(BLUR, edge="cleared", clear=(0.5, 0.35, 0.3)))
    frame.submit()
    dark = download(device, space.stacks[0], layer=len(VARIANCES))
    assert np.abs(dark[8:-8, 8:-8, :3]).max() == 0.0 and dark[8:-8, 8:-8, 3].max() == 1.0
