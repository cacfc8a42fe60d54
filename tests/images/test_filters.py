"""Mips keep the mean, derivatives are exact where they can be."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from dermis.images.filters import derivatives, mip_chain


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
def test_tilted_plane_has_one_slope_up_to_the_edge(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]]
    dx, dy = derivatives(0.25 * x - 0.5 * y)
    np.testing.assert_allclose(dx, 0.25, atol=1e-5)
    np.testing.assert_allclose(dy, -0.5 if shape[0] > 1 else 0, atol=1e-5)


def test_wave_that_tiles_has_its_derivative() -> None:
    y, x = np.mgrid[:128, :96]
    k, q = 2 * np.pi * 3 / 96, 2 * np.pi * 5 / 128
    dx, dy = derivatives(np.sin(k * x + q * y), "wrap")
    # What central differences with 3, 10, 3 across make of a wave, exactly.
    slope = np.cos(k * x + q * y)
    np.testing.assert_allclose(dx, slope * np.sin(k) * (10 + 6 * np.cos(q)) / 16, atol=2e-6)
    np.testing.assert_allclose(dy, slope * np.sin(q) * (10 + 6 * np.cos(k)) / 16, atol=2e-6)
    np.testing.assert_allclose(dx, slope * k, atol=0.02 * k)


@pytest.mark.parametrize("border", ["clamp", "wrap"])
def test_strips_do_not_show(border: Literal["clamp", "wrap"]) -> None:
    height = np.random.default_rng(2).random((150, 40))
    dx, dy = derivatives(height, border)
    turned_dx, turned_dy = derivatives(height.T, border)
    np.testing.assert_allclose(dx, turned_dy.T, atol=1e-6)
    np.testing.assert_allclose(dy, turned_dx.T, atol=1e-6)


def test_smoothing_takes_a_third_off_the_noise() -> None:
    noise = np.random.default_rng(4).standard_normal((400, 400))
    dx, _ = derivatives(noise, "wrap")
    plain = (np.roll(noise, -1, 1) - np.roll(noise, 1, 1)) / 2
    assert dx.std() / plain.std() == pytest.approx(np.sqrt(118) / 16, rel=0.02)
