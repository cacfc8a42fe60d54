"""Packing of buffers and maps of the web page, and its inverse."""

from __future__ import annotations

import numpy as np

from dermis.apps.export.targets.web.maps import encode_map_layer
from dermis.apps.export.targets.web.packing import ByteRunCollector, byte_planes, encode_seven_bits, quantise


def test_differences_and_planes_can_be_undone() -> None:
    words = (np.arange(600, dtype=np.uint32) ** 2).reshape(-1, 3)
    planes = np.frombuffer(byte_planes(words.view(np.uint8).reshape(-1), 4, 3, 2), np.uint8)
    found = np.ascontiguousarray(planes.reshape(12, -1).T).view(np.uint32)
    for _ in range(2):
        found = found.cumsum(0, dtype=np.uint32)
    np.testing.assert_array_equal(found, words)
    byte_runs = ByteRunCollector()
    assert byte_runs.add(words.tobytes()) == byte_runs.add(words.tobytes()) == 0


def test_packed_text_is_ascii() -> None:
    data = np.random.default_rng(0).integers(0, 256, 4096, np.uint8).tobytes()
    text = encode_seven_bits(data)
    assert not {"\0", "\r", "<"} & set(text)
    bits = "".join(f"{ord(one) & 127:07b}" for one in text)
    assert bytes(int(bits[k : k + 8], 2) for k in range(0, 8 * len(data), 8)) == data


def test_quantisation_error_is_at_most_half_a_step() -> None:
    values = np.random.default_rng(1).normal(size=(50, 2)).astype(np.float32)
    assert (np.abs(quantise(values, (2.0**-8, 2.0**-14)) - values) <= [2.0**-9, 2.0**-15]).all()


def test_maps_stored_as_pictures_stay_close() -> None:
    x = np.linspace(0.0, 1.0, 64)
    texels = np.stack([np.outer(x, x), np.outer(x, 1 - x), -np.outer(x, x)], axis=-1).astype(np.float16)
    for colours in (False, True):
        found = encode_map_layer(np.abs(texels) if colours else texels, colours).texels.astype(np.float64)
        assert np.sqrt(((np.abs(found) - np.abs(texels.astype(np.float64))) ** 2).mean()) < (
            0.1 if colours else 0.02
        )
