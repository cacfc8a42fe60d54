"""The toolkit's WGSL functions compared with NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from tolerances import TWIN

from dermis.gpu import CommandList, ComputeProgram, Device, download, make_texture
from dermis.gpu.textures import texture_from_array
from dermis.images.colour import encode_srgb

Pair = tuple[NDArray[np.float64], NDArray[np.float64]]


def run(device: Device, image: NDArray[np.float64], places: NDArray[np.float64]) -> Pair:
    program = ComputeProgram(device, Path(__file__).parent / "library_probe.wgsl")
    size = places.shape[1], places.shape[0]
    read, encoded = (make_texture(device, size, "rgba32float") for _ in range(2))
    bound = {
        "image": texture_from_array(device, image, "rgba32float"),
        "places": texture_from_array(device, places, "rg32float"),
        "read": read,
        "encoded": encoded,
    }
    frame = CommandList(device)
    frame.compute("probe", program, bound, size)
    frame.submit()
    return download(device, read).astype(float), download(device, encoded).astype(float)


def test_bilinear_sampling_matches_numpy(device: Device) -> None:
    rng = np.random.default_rng(3)
    image, places = rng.random((11, 17, 4)), rng.uniform(-0.2, 1.2, (40, 30, 2))
    read, _ = run(device, image, places)
    where = [places[..., 1] * 11 - 0.5, places[..., 0] * 17 - 0.5]
    twin = np.stack(
        [map_coordinates(image[..., c], where, order=1, mode="nearest") for c in range(4)], axis=-1
    )
    assert np.abs(read - twin).max() < TWIN


@pytest.mark.parametrize("scale", [0.004, 1.0, 3.0])
def test_srgb_encoding_matches_numpy(device: Device, scale: float) -> None:
    """Check dark values (the linear part), display values, and values above white, which become white."""
    values = np.linspace(-0.1, 1.0, 4 * 256).reshape(16, 16, 4) * scale
    centres = (np.mgrid[:16, :16][::-1].transpose(1, 2, 0) + 0.5) / 16
    _, encoded = run(device, values, centres)
    assert np.abs(encoded[..., :3] - encode_srgb(np.clip(values[..., :3], 0, 1))).max() < TWIN
