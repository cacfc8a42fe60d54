"""Resampling of pictures and of label outputs at given pixels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index

Array = NDArray[Any]


class Neighbours(NamedTuple):
    """Four nearest pixels of each sampled position, for a picture of the size of the samples.

    rows, columns : (h, w, 4) indices of the pixels
    weights : (h, w, 4) weights of bilinear interpolation, which sum to 1 [-]
    nearest : (h, w, 1) which of the four pixels is the nearest
    """

    rows: Index
    columns: Index
    weights: Floats
    nearest: Index


def find_neighbours(positions: Doubles) -> Neighbours:
    """Return the four nearest pixels of positions (h, w, 2), which are clamped to the picture (h, w)."""
    height, width = positions.shape[:2]
    x, y = np.clip(positions[..., 0], 0.0, width - 1.0), np.clip(positions[..., 1], 0.0, height - 1.0)
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    s, t = x - left, y - top
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=-1)
    return Neighbours(
        np.stack([top, top, bottom, bottom], axis=-1),
        np.stack([left, right, left, right], axis=-1),
        weights.astype(np.float32),
        weights.argmax(axis=-1)[..., None],
    )


def sample_bilinear(picture: Array, neighbours: Neighbours, classes: Array | None = None) -> Array:
    """Return a picture (h, w) or (h, w, c), sampled bilinearly among pixels of one class.

    classes : (h, w) class of each pixel; pixels of other classes than the nearest one have no weight. None
        for all pixels
    """
    weights = neighbours.weights
    if classes is not None:
        found = classes[neighbours.rows, neighbours.columns]
        weights = weights * (found == np.take_along_axis(found, neighbours.nearest, axis=-1))
        weights = weights / weights.sum(axis=-1, keepdims=True)
    values = picture[neighbours.rows, neighbours.columns]
    extra = (None,) * (picture.ndim - 2)
    return np.asarray((values * weights[(..., *extra)]).sum(axis=2), picture.dtype)


def sample_nearest(picture: Array, neighbours: Neighbours) -> Array:
    """Return a picture (h, w) or (h, w, c), sampled at the nearest pixels."""
    rows, columns = (
        np.take_along_axis(indices, neighbours.nearest, axis=-1)[..., 0] for indices in neighbours[:2]
    )
    return np.asarray(picture[rows, columns])
