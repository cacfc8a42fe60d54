"""Light that a picture of skin's colour still holds: slow changes of brightness that no pigment explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.model import skin_model
from dermis.apps.inverse.unmixing.on_device import Unmixer
from dermis.gpu import Device
from dermis.optics.pigments.parameters import SkinParameters

Pixels = NDArray[np.float32]
_SIDE = 256  # of the picture that is looked at
_SLOW = 1.0 / 24.0  # of the longer side: standard deviation of the blur


def shading_of(device: Device, colours: Pixels, skin: SkinParameters, noise: float) -> Pixels:
    """(h, w) factor that light makes of each texel, 1 on average over the skin [-].

    Each texel of a smaller picture gets the brightness that its melanin and blood leave over; of that what
    changes slowly is kept, weighed by how well the colour fits a skin.
    """
    small = _smaller(colours)
    made, _, residual = Unmixer(device, skin_model(skin, "shade"), noise).unmix(small)
    off = (np.log(np.maximum(residual, 1e-6)) ** 2).sum(axis=-1) / noise**2
    weight = (1.0 / (1.0 + off)) * (small.min(axis=-1) > 0.0)
    slow = _slow(made[..., 2].astype(np.float64), weight.astype(np.float64))
    mean = float((slow * weight).sum() / max(float(weight.sum()), 1e-12))
    return _larger(np.exp(slow - mean), (colours.shape[0], colours.shape[1]))


def _smaller(colours: Pixels) -> Pixels:
    """Means of blocks of texels."""
    apart = max(1, max(colours.shape[:2]) // _SIDE)
    height, width = (max(1, side // apart) for side in colours.shape[:2])
    whole = colours[: height * apart, : width * apart] if apart > 1 else colours
    rows, columns = min(apart, colours.shape[0]), min(apart, colours.shape[1])
    return np.asarray(whole.reshape(height, rows, width, columns, 3).mean(axis=(1, 3)), np.float32)


def _slow(values: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    sigma = _SLOW * max(values.shape)
    both = [gaussian_filter(one, sigma, mode="nearest") for one in (values * weight, weight)]
    return np.asarray(both[0] / np.maximum(both[1], 1e-6))


def _larger(values: NDArray[np.float64], shape: tuple[int, int]) -> Pixels:
    """Bilinear between the middles of blocks."""
    from scipy.ndimage import map_coordinates

    found = np.empty(shape, np.float32)
    across = (np.arange(shape[1]) + 0.5) * values.shape[1] / shape[1] - 0.5
    for row in range(shape[0]):
        down = np.full(shape[1], (row + 0.5) * values.shape[0] / shape[0] - 0.5)
        found[row] = map_coordinates(values, [down, across], order=1, mode="nearest")
    return found
