"""Resampling of pictures and of label outputs at given pixels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index

Array = NDArray[Any]


class Neighbours(NamedTuple):
    """Four nearest pixels of each sampled position, for a picture of the size of the samples.

    indices : four arrays (h, w), indices of the pixels in the flattened picture
    weights : four arrays (h, w), weights of bilinear interpolation, which sum to 1 [-]
    nearest : (h, w) index of the nearest of the four pixels
    """

    indices: tuple[Index, ...]
    weights: tuple[Floats, ...]
    nearest: Index


def find_neighbours(positions: Doubles) -> Neighbours:
    """Return the four nearest pixels of positions (h, w, 2), which are clamped to the picture (h, w)."""
    height, width = positions.shape[:2]
    x, y = np.clip(positions[..., 0], 0.0, width - 1.0), np.clip(positions[..., 1], 0.0, height - 1.0)
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    s, t = (x - left).astype(np.float32), (y - top).astype(np.float32)
    nearest = np.where(t > 0.5, bottom, top) * width + np.where(s > 0.5, right, left)
    return Neighbours(
        (top * width + left, top * width + right, bottom * width + left, bottom * width + right),
        ((1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t),
        nearest,
    )


def sample_bilinear(picture: Array, neighbours: Neighbours, classes: Array | None = None) -> Array:
    """Return a picture (h, w) or (h, w, c), sampled bilinearly among pixels of one class.

    classes : (h, w) class of each pixel; pixels of other classes than the nearest one have no weight. None
        for all pixels
    """
    weights: tuple[Floats, ...] = neighbours.weights
    if classes is not None:
        own = classes.ravel()[neighbours.nearest]
        weights = tuple(
            weight * (classes.ravel()[index] == own)
            for index, weight in zip(neighbours.indices, weights, strict=True)
        )
        total = np.sum(weights, axis=0)
        weights = tuple(weight / total for weight in weights)
    flat, extra = _flattened(picture), (None,) * (picture.ndim - 2)
    parts = zip(neighbours.indices, weights, strict=True)
    sampled = sum(flat.take(index, axis=0) * weight[(..., *extra)] for index, weight in parts)
    return np.asarray(sampled, picture.dtype)


def sample_nearest(picture: Array, neighbours: Neighbours) -> Array:
    """Return a picture (h, w) or (h, w, c), sampled at the nearest pixels."""
    return np.asarray(_flattened(picture).take(neighbours.nearest, axis=0))


def _flattened(picture: Array) -> Array:
    return np.ascontiguousarray(picture).reshape(-1, *picture.shape[2:])
