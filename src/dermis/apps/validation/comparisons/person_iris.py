"""How an iris stands and shines in our picture against the truth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import Estimate
from dermis.apps.validation.comparisons.person import Pair

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
_PUPIL_MM = 4.0  # around the middle: what tells where the pupil is
_INNER_MM, _OUTER_MM = 2.6, 5.0  # ring of the iris, as seen from the front
_BRIGHT = 1.6  # over the median of the ring: highlights


class IrisFound(NamedTuple):
    """Of ours against the truth.

    right, down : how far the truth's pupil lies from ours [pixel]
    brightness : mean of ours over that of the truth on the ring of the iris, highlights aside [-]
    left, beside : the same on the ring's left and right halves
    """

    right: Estimate
    down: Estimate
    brightness: Estimate
    left: Estimate
    beside: Estimate


def iris_of(pair: Pair, frame_mm: float) -> IrisFound:
    """What is found in a picture with an eye in its middle, seen from the front.

    frame_mm : height of the picture
    """
    ours, truth = pair.ours.mean(axis=2), pair.truth.mean(axis=2)
    noise = pair.variance.mean(axis=2)  # channels may share paths: at most so much
    side = len(ours)
    along = (np.arange(side) + 0.5 - 0.5 * side) * frame_mm / side
    x, y = np.meshgrid(along, along)
    off = np.hypot(x, y)
    ring = (off > _INNER_MM) & (off < _OUTER_MM)
    dull = _dull(ours, ring) & _dull(truth, ring)
    right, down = _shift(ours, truth, noise, dull & (off < _PUPIL_MM))
    ring &= dull
    whole, left, beside = (_ratio(ours, truth, noise, ring & part) for part in (off > 0, x < 0, x >= 0))
    return IrisFound(right, down, whole, left, beside)


def _dull(image: Floats, ring: Mask) -> Mask:
    """(h, w) pixels off highlights; a mean over neighbours tells them in a noisy picture."""
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(image, 2.0)
    return np.asarray(smooth < _BRIGHT * np.median(smooth[ring]))


def _shift(ours: Floats, truth: Floats, noise: Floats, part: Mask) -> tuple[Estimate, Estimate]:
    """By how much the truth lies to the right of and below ours, where it is so many times as bright."""
    down, right = (np.asarray(slope) for slope in np.gradient(ours))
    columns = np.stack([ours[part], -right[part], -down[part], np.ones(int(part.sum()))], axis=-1)
    inverse = np.linalg.inv(columns.T @ columns) @ columns.T
    gain, x, y, _ = (float(one) for one in inverse @ truth[part])
    error: Floats = np.sqrt((inverse**2 * noise[part]).sum(axis=1)) / abs(gain)
    return Estimate(x / gain, float(error[1])), Estimate(y / gain, float(error[2]))


def _ratio(ours: Floats, truth: Floats, noise: Floats, part: Mask) -> Estimate:
    total = float(truth[part].sum())
    ratio = float(ours[part].sum()) / total
    return Estimate(ratio, ratio * float(np.sqrt(noise[part].sum())) / total)
