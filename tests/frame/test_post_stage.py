"""Exposure and encoding on the device, compared with NumPy."""

from __future__ import annotations

from typing import Any

import light_twins
import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.frame.features.post import picture as post
from dermis.gpu import CommandList, Device, download, upload
from dermis.images.colour import encode_srgb, encode_srgb8
from dermis.scene.settings import Settings

Floats = NDArray[np.float32]


def finished(
    device: Device, radiance: Floats, exposure: float, **settings: Any
) -> tuple[Floats, NDArray[np.uint8]]:
    picture = post.make_picture(device, (radiance.shape[1], radiance.shape[0]))
    upload(device, picture.radiance, radiance)
    frame = CommandList(device)
    post.draw(frame, picture.radiance, picture, Settings(exposure=exposure, **settings))
    frame.submit()
    return download(device, picture.exposed), download(device, picture.bytes)


def values(seed: int) -> Floats:
    """Return radiance over the whole range of the curve, mostly dark, with some values above white."""
    rng = np.random.default_rng(seed)
    light = rng.uniform(0, 1.05, (60, 101, 4)) ** rng.choice([1, 3, 6], (60, 101, 1))
    light[..., 3] = rng.uniform(0, 1, (60, 101))
    return light.astype(np.float32)


@pytest.mark.parametrize("exposure", [1.0, 0.37, 8.0])
def test_encoded_bytes_match_numpy(device: Device, exposure: float) -> None:
    radiance = values(1)
    exposed, encoded = finished(device, radiance, exposure)
    assert np.array_equal(exposed[..., :3], radiance[..., :3] * np.float32(exposure))
    assert np.array_equal(exposed[..., 3], radiance[..., 3])
    linear = exposed[..., :3].astype(float)
    # at a tie to 1e-4 of a grey level the device's pow may go either way
    tie = np.abs(255 * encode_srgb(np.clip(linear, 0, 1)) % 1 - 0.5) < 1e-4
    assert tie.mean() < 0.001
    assert np.array_equal(encoded[..., :3][~tie], encode_srgb8(linear)[~tie])
    assert np.array_equal(encoded[..., 3], np.rint(255 * radiance[..., 3]))


def test_every_grey_level_survives(device: Device) -> None:
    """Bytes that are decoded to linear light and encoded again do not change."""
    from dermis.images.colour import decode_srgb_levels

    levels = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(4, axis=2)
    radiance = decode_srgb_levels(levels)
    radiance[..., 3] = 1.0
    _, encoded = finished(device, radiance, 1.0)
    assert np.array_equal(encoded[..., :3], levels[..., :3])


def test_values_at_the_ends_of_the_range_are_exact(device: Device) -> None:
    radiance = np.array([[[-1.0, 0.0, 1e-8, 1], [1.0, 1.5, 1e30, 1], [3e38, 1e-30, 0.5, 0]]], np.float32)
    _, encoded = finished(device, radiance, 1.0)
    assert encoded[0].tolist() == [[0, 0, 0, 255], [255, 255, 255, 255], [255, 0, 188, 0]]


@pytest.mark.parametrize("tone", ["filmic", "neutral"])
def test_tone_curves_match_their_publications(device: Device, tone: str) -> None:
    radiance = 6.0 * values(2) ** 2
    exposed, encoded = finished(device, radiance, 1.5, tone=tone)
    # the curve is for bytes alone; what is too small for a normal float may become 0
    assert np.abs(exposed[..., :3] - radiance[..., :3] * np.float32(1.5)).max() < 1e-37
    curve = {"filmic": light_twins.filmic, "neutral": light_twins.neutral}[tone]
    exact = 255 * encode_srgb(np.clip(curve(exposed[..., :3].astype(float)), 0, 1))
    assert np.abs(encoded[..., :3] - exact).max() < 0.5 + 0.01


def test_tone_curves_map_their_end_points(device: Device) -> None:
    ends = np.array([[[0, 0, 0, 1], [11.2 / 2, 11.2 / 2, 11.2 / 2, 1], [1e30, 1e30, 1e30, 1]]], np.float32)
    _, film = finished(device, ends, 1.0, tone="filmic")
    assert film[0, :, 0].tolist() == [0, 255, 255]
    _, plain = finished(device, np.float32([[[0.5, 0.3, 0.2, 1], [0.5, 0.3, 0.2, 1]]]), 1.0, tone="neutral")
    # the specification keeps colours under 0.8 but for the shift by the reflection of 4 per cent
    assert np.array_equal(plain[0, 0, :3], encode_srgb8(np.array([0.46, 0.26, 0.16])))


def test_wrong_gamma_skips_the_encoding(device: Device) -> None:
    radiance = values(3)
    _, encoded = finished(device, radiance, 1.0, gamma="wrong")
    assert np.abs(encoded[..., :3] - 255.0 * np.clip(radiance[..., :3], 0, 1)).max() <= 0.5 + 1e-4
