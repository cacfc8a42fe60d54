"""Colour filter array with the pattern RGGB, and interpolation of its missing colours."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import correlate

from dermis.base.arrays import Floats, Index, Mask

_PATTERN = np.array([[0, 1], [1, 2]], np.int64)  # channel of each pixel: red, green, blue
_BILINEAR_GREEN = np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]], np.float32) / 4.0
_BILINEAR_RED_BLUE = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]], np.float32) / 4.0
_GREEN_AT_RED_BLUE = (
    np.array(
        [[0, 0, -1, 0, 0], [0, 0, 2, 0, 0], [-1, 2, 4, 2, -1], [0, 0, 2, 0, 0], [0, 0, -1, 0, 0]], np.float32
    )
    / 8.0
)
"""Green at a pixel of red or blue; the other kernels give red or blue at the pixels of other colours."""
_ALONG_ROW_AT_GREEN = (
    np.array(
        [[0, 0, 0.5, 0, 0], [0, -1, 0, -1, 0], [-1, 4, 5, 4, -1], [0, -1, 0, -1, 0], [0, 0, 0.5, 0, 0]],
        np.float32,
    )
    / 8.0
)
_DIAGONAL = (
    np.array(
        [[0, 0, -1.5, 0, 0], [0, 2, 0, 2, 0], [-1.5, 0, 6, 0, -1.5], [0, 2, 0, 2, 0], [0, 0, -1.5, 0, 0]],
        np.float32,
    )
    / 8.0
)


def mosaic(picture: Floats) -> Floats:
    """Return the channel (h, w) of a picture (h, w, 3) that the filter of each pixel transmits."""
    channels = channel_pattern(picture.shape[0], picture.shape[1])
    return np.asarray(np.take_along_axis(picture, channels[..., None], axis=2)[..., 0])


def channel_pattern(height: int, width: int) -> Index:
    """Return the channel (h, w) that the filter of each pixel transmits: 0 red, 1 green, 2 blue."""
    return np.tile(_PATTERN, (-(-height // 2), -(-width // 2)))[:height, :width]


def demosaic_bilinear(signals: Floats) -> Floats:
    """Return the picture (h, w, 3) whose missing colours are the means of the nearest pixels that have them.

    signals : (h, w) signals of the pixels, from `mosaic`

    Source: [Malvar2004 eq. 1].
    """
    channels = channel_pattern(*signals.shape)
    kernels = _BILINEAR_RED_BLUE, _BILINEAR_GREEN, _BILINEAR_RED_BLUE
    planes = (_filtered(np.where(channels == k, signals, 0.0), kernel) for k, kernel in enumerate(kernels))
    return np.stack(list(planes), axis=-1)


def demosaic_malvar(signals: Floats) -> Floats:
    """Return the picture (h, w, 3) interpolated bilinearly and corrected by the gradients of other colours.

    signals : (h, w) signals of the pixels, from `mosaic`

    Source: [Malvar2004].
    """
    channels = channel_pattern(*signals.shape)
    rows = np.arange(len(signals))[:, None] % 2  # 0 in rows of red, 1 in rows of blue
    green = np.where(channels == 1, signals, _filtered(signals, _GREEN_AT_RED_BLUE))
    along_row, along_column = (
        _filtered(signals, kernel) for kernel in (_ALONG_ROW_AT_GREEN, _ALONG_ROW_AT_GREEN.T)
    )
    diagonal = _filtered(signals, _DIAGONAL)

    def red_or_blue(channel: int, in_own_row: Mask) -> Floats:
        at_green = np.where(in_own_row, along_row, along_column)
        return np.where(channels == channel, signals, np.where(channels == 1, at_green, diagonal))

    return np.stack([red_or_blue(0, rows == 0), green, red_or_blue(2, rows == 1)], axis=-1)


def _filtered(signals: Floats, kernel: Floats) -> Floats:
    """Return the correlation with a kernel; the mirrored borders preserve the pattern of the colours."""
    return np.asarray(correlate(np.asarray(signals, np.float32), kernel, mode="mirror"))


DEMOSAICING = {"bilinear": demosaic_bilinear, "malvar": demosaic_malvar}
"""Functions of interpolation by the name of the method."""
