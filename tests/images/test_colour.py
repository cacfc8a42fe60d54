"""The sRGB curve against IEC 61966-2-1."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.images.colour import (
    decode_srgb,
    decode_srgb_levels,
    encode_srgb,
    encode_srgb8,
    luminance,
)


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [(0.0, 0.0), (0.0031308, 0.04045), (0.18, 0.461356), (0.5, 0.735357), (0.214041, 0.5), (1.0, 1.0)],
)
def test_srgb_curve_matches_known_values(linear: float, encoded: float) -> None:
    assert encode_srgb(linear) == pytest.approx(encoded, abs=1e-6)
    assert decode_srgb(encoded) == pytest.approx(linear, abs=1e-6)


def test_decoding_inverts_encoding() -> None:
    linear = np.linspace(-0.2, 2, 10001)
    np.testing.assert_allclose(decode_srgb(encode_srgb(linear)), linear, atol=1e-7)


def test_float32_stays_float32() -> None:
    linear = np.linspace(0, 1, 1001, dtype=np.float32)
    assert encode_srgb(linear).dtype == decode_srgb(linear).dtype == np.float32
    np.testing.assert_allclose(encode_srgb(linear), encode_srgb(linear.astype(np.float64)), atol=2e-7)


def test_lookup_tables_match_the_curve() -> None:
    levels8, levels16 = np.arange(256, dtype=np.uint8), np.arange(65536, dtype=np.uint16)
    np.testing.assert_allclose(decode_srgb_levels(levels8), decode_srgb(levels8 / 255), rtol=1e-7)
    np.testing.assert_allclose(decode_srgb_levels(levels16), decode_srgb(levels16 / 65535), rtol=1e-7)
    np.testing.assert_array_equal(
        decode_srgb_levels(levels8.astype(np.uint16) * 257), decode_srgb_levels(levels8)
    )


def test_every_level_survives_decoding_and_encoding() -> None:
    levels = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(encode_srgb8(decode_srgb_levels(levels)), levels)


def test_encode_srgb8_clamps_out_of_range_values() -> None:
    values = np.array([-1.0, np.nan, -np.inf, 2.0, np.inf])
    assert encode_srgb8(values).tolist() == [0, 0, 0, 255, 255]


def test_luminance_uses_rec_709_weights() -> None:
    assert luminance([[1, 0, 0], [0, 1, 0], [0, 0, 1]]).tolist() == [0.2126, 0.7152, 0.0722]
    assert luminance([0.5, 0.5, 0.5, 0.1]) == pytest.approx(0.5)
