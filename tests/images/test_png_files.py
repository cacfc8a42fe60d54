"""PNG files with the up filter, against other decoders."""

from __future__ import annotations

import io

import numpy as np
import pytest
from png_bytes import png

from dermis.base.extras import import_extra
from dermis.images.codecs import decode_up_filtered_png, encode_png
from dermis.images.sizes import TooLargeError

UP, PAETH = 2, 4


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.mark.parametrize("use_isal", [False, True])
@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_png_round_trip_keeps_pixels(
    rng: np.random.Generator, kind: type, channels: int, use_isal: bool
) -> None:
    levels = rng.integers(0, np.iinfo(kind).max + 1, (7, 5, channels)).astype(kind)
    found = decode_up_filtered_png(encode_png(levels, 1, use_isal))
    assert found is not None and found.dtype == kind
    np.testing.assert_array_equal(found, levels)


def test_other_decoder_reads_equal_16_bit_pixels(rng: np.random.Generator) -> None:
    levels = rng.integers(0, 65536, (6, 9, 3)).astype(np.uint16)
    data = encode_png(levels, use_isal=True)
    with import_extra("av", "a test").open(io.BytesIO(data), format="png_pipe") as container:
        other = next(container.decode(video=0)).to_ndarray(format="rgb48le")
    np.testing.assert_array_equal(other, levels)
    np.testing.assert_array_equal(decode_up_filtered_png(data), levels)


def test_other_decoder_reads_equal_8_bit_pixels(rng: np.random.Generator) -> None:
    from PIL import Image

    levels = rng.integers(0, 256, (6, 9, 4)).astype(np.uint8)
    data = encode_png(levels, use_isal=True)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(data))), levels)


def test_fast_compression_of_noise_is_not_larger() -> None:
    noise = np.random.default_rng(3).normal(30000, 300, (64, 64, 3)).astype(np.uint16)
    assert len(encode_png(noise, use_isal=True)) < len(encode_png(noise, 1))


@pytest.mark.parametrize(
    "data",
    [
        png(2, 2, 16, 2, bytes([PAETH, *bytes(12)]) * 2),
        png(2, 2, 8, 3, bytes([UP, 0, 0]) * 2, (b"PLTE", bytes(6))),
        png(2, 2, 8, 2, bytes([UP, *bytes(6)]) * 2, (b"tRNS", bytes(6))),
        b"\xff\xd8\xff",
    ],
    ids=["other filter", "palette", "colour that is clear", "JPEG"],
)
def test_other_png_types_use_the_general_decoder(data: bytes) -> None:
    assert decode_up_filtered_png(data) is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (png(2, 2, 8, 2, bytes(13)), "truncated"),
        (png(2, 2, 8, 2, bytes(15)), "there are too many"),
        (png(2, 2, 8, 2, bytes(14))[:-12], "truncated"),
        (png(2, 2, 8, 2, bytes(14)).replace(b"IDAT", b"IDAS"), "damaged"),
        (png(9000, 9000, 8, 2, b""), "9000 x 9000"),
        (png(0, 1, 8, 2, b""), "0 x 1"),
    ],
)
def test_damaged_png_files_are_refused(data: bytes, message: str) -> None:
    with pytest.raises((ValueError, TooLargeError), match=message):
        decode_up_filtered_png(data)
