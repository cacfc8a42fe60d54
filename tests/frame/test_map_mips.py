"""Slopes and mip levels that the device computes, against exact values and NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import HALVES

from dermis.frame.features.surface import mips as map_mips
from dermis.gpu import Device, download
from dermis.images.filters import mip_chain

Floats = NDArray[np.float64]
SHAPES = [(16, 16), (70, 45), (17, 31), (3, 200), (1, 9), (5, 1)]


def slopes_of(device: Device, height: Floats) -> Floats:
    texture = map_mips.make_relief(device, height.astype(np.float32))
    made = download(device, texture).astype(float)
    np.testing.assert_allclose(made[..., 2:], made[..., :2] ** 2, rtol=2 * HALVES, atol=1e-6)
    return np.asarray(made[..., :2])


def noise(shape: tuple[int, ...]) -> NDArray[np.float32]:
    return np.random.default_rng(5).random(shape).astype(np.float32)


def all_mips(device: Device, texture: Any) -> list[Floats]:
    return [download(device, texture, mip=mip).astype(float) for mip in range(texture.mip_level_count)]


@pytest.mark.parametrize("shape", SHAPES)
def test_tilted_plane_has_constant_slope_up_to_the_edge(device: Device, shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]]
    want = [0.25 if shape[1] > 1 else 0, -0.5 if shape[0] > 1 else 0]
    np.testing.assert_allclose(slopes_of(device, 0.25 * x - 0.5 * y) - want, 0, atol=2e-5)


def test_slopes_of_a_wave_are_its_derivative(device: Device) -> None:
    y, x = np.mgrid[:128, :96]
    k, q = 2 * np.pi * 3 / 96, 2 * np.pi * 5 / 128
    made = slopes_of(device, np.sin(k * x + q * y))[1:-1, 1:-1]
    # what central differences with 3, 10, 3 across make of a wave, exactly
    slope = np.cos(k * x + q * y)[1:-1, 1:-1]
    np.testing.assert_allclose(made[..., 0], slope * np.sin(k) * (10 + 6 * np.cos(q)) / 16, atol=2e-4)
    np.testing.assert_allclose(made[..., 1], slope * np.sin(q) * (10 + 6 * np.cos(k)) / 16, atol=2e-4)
    np.testing.assert_allclose(made[..., 0], slope * k, atol=0.02 * k)


def test_slopes_are_symmetric_in_rows_and_columns(device: Device) -> None:
    """Each invocation handles many rows of one column."""
    height = noise((150, 40)).astype(float)
    turned = slopes_of(device, height.T)[..., ::-1].swapaxes(0, 1)
    np.testing.assert_allclose(slopes_of(device, height), turned, atol=HALVES)


def test_row_bands_leave_no_seams(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Large maps are uploaded a few rows at a time."""
    height = noise((150, 42)).astype(float)
    at_once = slopes_of(device, height)
    monkeypatch.setattr(map_mips, "_MAX_BAND_BYTES", 64 * 4 * 44)
    np.testing.assert_array_equal(slopes_of(device, height), at_once)


@pytest.mark.parametrize("shape", [(16, 16), (70, 44), (71, 44), (2, 6)])
def test_mips_of_relief_are_means(device: Device, shape: tuple[int, int]) -> None:
    made = all_mips(device, map_mips.make_relief(device, noise(shape)))
    for level, mean in zip(made, mip_chain(made[0]), strict=True):
        np.testing.assert_allclose(level, mean, atol=HALVES)


@pytest.mark.parametrize("shape", SHAPES)
def test_mips_of_colours_are_their_means(device: Device, shape: tuple[int, int]) -> None:
    image = noise((*shape, 3))
    made, want = all_mips(device, map_mips.upload_colours(device, image)), mip_chain(image)
    assert len(made) == len(want)
    for level, mean in zip(made, want, strict=True):
        np.testing.assert_allclose(level[..., :3], mean, atol=HALVES)
        np.testing.assert_array_equal(level[..., 3], 1.0)


def test_mips_of_slopes_are_means_of_them_and_their_squares(device: Device) -> None:
    slopes = noise((33, 48, 2)) - 0.5
    made = all_mips(device, map_mips.upload_slopes(device, slopes))
    for level, mean in zip(made, mip_chain(np.dstack([slopes, slopes**2])), strict=True):
        np.testing.assert_allclose(level, mean, atol=HALVES)
