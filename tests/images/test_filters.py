"""Mip levels preserve the mean, and smoothing has binomial weights."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.images.filters import mip_chain, smooth_quantisation


@pytest.mark.parametrize("shape", [(16, 16, 3), (17, 31, 3), (5, 64, 1), (1, 7, 2), (33, 33), (1, 1, 4)])
def test_every_mip_has_the_mean_of_the_picture(shape: tuple[int, ...]) -> None:
    image = np.random.default_rng(5).random(shape).astype(np.float32)
    levels = mip_chain(image)
    assert levels[0] is image
    for below, level in enumerate(levels):
        assert level.shape[:2] == (max(1, shape[0] >> below), max(1, shape[1] >> below))
        assert level.shape[2:] == shape[2:]
        np.testing.assert_allclose(level.mean((0, 1)), image.mean((0, 1)), rtol=2e-6)
    assert levels[-1].shape[:2] == (1, 1)


def test_even_mip_is_the_mean_of_four() -> None:
    image = np.arange(16, dtype=np.float32).reshape(4, 4)
    np.testing.assert_array_equal(mip_chain(image)[1], [[2.5, 4.5], [10.5, 12.5]])


def test_odd_mip_weighs_by_area() -> None:
    # 5 texels to 2: each new one covers two and a half of the old.
    row = np.array([[1, 2, 3, 5, 8]], np.float32)
    np.testing.assert_allclose(mip_chain(row)[1], [[(1 + 2 + 1.5) / 2.5, (1.5 + 5 + 8) / 2.5]], rtol=1e-6)


@pytest.mark.parametrize("shape", [(70, 45), (3, 200), (1, 9)])
def test_steps_are_smoothed_by_binomial_weights(shape: tuple[int, int]) -> None:
    height = np.random.default_rng(2).random(shape)
    weights = np.array([1, 6, 15, 20, 15, 6, 1]) / 64
    want = np.pad(height, 3, "edge")
    for axis in (0, 1):
        want = np.apply_along_axis(np.convolve, axis, want, weights, "valid")
    np.testing.assert_allclose(smooth_quantisation(height), want, atol=1e-6)
