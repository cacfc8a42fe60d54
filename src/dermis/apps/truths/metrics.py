"""Differences between an image and a reference: relative error corrected for noise, energy ratio, FLIP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.images.colour import encode_srgb

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

PIXELS_PER_DEGREE = 67.0
"""Resolution at the viewer's eye, as FLIP assumes by default: a 4K screen 0.7 m wide, seen from 0.7 m."""
ZERO_DIFFERENCE_GREY = 0.5
"""sRGB value that shows equality in `signed_difference`, near the middle of lightness (L* 53)."""


class Estimate(NamedTuple):
    """Number that compares an image with a reference, and the number's standard error due to noise.

    The standard error is 0 if no variance of the noise is given.
    """

    value: float
    standard_error: float


@dataclass(frozen=True)
class FlipDifference:
    """Perceived difference between two pictures by FLIP, from 0 to 1.

    mean : mean difference of the pixels in the mask
    error : (h, w) difference of each pixel; 0 outside the mask
    pixels_per_degree : assumed resolution at the viewer's eye
    """

    mean: float
    error: NDArray[np.float32]
    pixels_per_degree: float


def relative_rmse(
    image: ArrayLike,
    reference: ArrayLike,
    mask: Mask | None = None,
    reference_variance: ArrayLike | None = None,
    image_variance: ArrayLike | None = None,
) -> Estimate:
    """Return the relative root mean square error of an image, corrected for the noise of the reference [-].

    The error is sqrt(sum((image - reference)²) / sum(reference²)), where the variance of the noise is
    subtracted from each squared value. Its standard error assumes normally distributed noise, which is
    independent between pixels but may be correlated between channels.

    image, reference : (h, w) or (h, w, c) linear images; all channels are summed
    mask : (h, w) pixels to compare
    reference_variance : (h, w) or (h, w, c) unbiased estimate of the variance of each value of `reference`:
        the variance between its samples, divided by the number of samples
    image_variance : variance of each value of `image`; when given, the noise of the image is removed too
    """
    # Let the reference be T = t + n with noise n of mean 0 and variance s², and let D = I - T. On average, D²
    # is (I - t)² + s² and T² is t² + s², so noise does not bias the estimate E = sum(D² - s²) / sum(T² - s²).
    #
    # Each pixel contributes U = D² - s² - E (T² - s²) to the error e of E.
    # The random part of U is -2 n (I - t + E t) + (1 - E)(n² - s²).
    # For normally distributed n, the variance of U is 4 s² (I - t + E t)² + 2 (1 - E)² s⁴.
    # Its unbiased estimate is 4 s² (D + E T)² - 2 (1 - E)² s⁴.
    # For skewed noise, E is still unbiased but e is too small, by 7 to 16 % if the reference is the mean of
    # 64 exponentially distributed samples.
    #
    # Pixels are independent of one another. Channels may share paths, so the standard deviations of the
    # channels are added, which overestimates e by at most sqrt(c). The standard error of sqrt(E) is the
    # larger of its distances to sqrt(E + e) and to sqrt(max(E - e, 0)).
    #
    # Noise of variance v in the image adds v to D², and 4 v D² - 4 v s² - 2 v² to the estimate of the
    # variance of U. Only 4 v D² is counted, because v² is poorly known after few passes; the standard error
    # is then too large rather than too small.
    I, T, s2 = _masked_pixels(image, reference, mask, reference_variance)
    v = _masked_pixels(image, reference, mask, image_variance)[2]
    D, energy = I - T, float((T**2 - s2).sum())
    if energy <= 0:
        refuse("relative error", "a reference brighter than its noise", "it is darker", "Trace more paths")
    E = float((D**2 - s2 - v).sum()) / energy
    U = 4 * s2 * (D + E * T) ** 2 - 2 * (1 - E) ** 2 * s2**2 + 4 * v * D**2
    error = _standard_error_of_sum(U) / energy
    E = max(E, 0.0)
    low, root, high = np.sqrt([max(E - error, 0.0), E, E + error])
    return Estimate(float(root), float(max(high - root, root - low)))


def energy_ratio(
    image: ArrayLike,
    reference: ArrayLike,
    mask: Mask | None = None,
    reference_variance: ArrayLike | None = None,
) -> Estimate:
    """Return the sum of an image's values, divided by the sum of the reference's values [-].

    The parameters are those of `relative_rmse`. The ratio has the same relative standard error as the
    sum of the reference. In each channel, the variances of the pixels are added; the standard deviations of
    the channels are then added, because all channels may be computed from the same light paths.
    """
    I, T, s2 = _masked_pixels(image, reference, mask, reference_variance)
    total = float(T.sum())
    if total <= 0:
        refuse("energy ratio", "a reference with light in it", "its sum is not above 0", "Check the mask")
    ratio = float(I.sum()) / total
    return Estimate(ratio, abs(ratio) * _standard_error_of_sum(s2) / total)


def _standard_error_of_sum(variance: Floats) -> float:
    """Return an upper bound of the standard error of a sum over pixels whose channels may be correlated.

    variance : (n, c) variance of each pixel and channel
    """
    return float(np.sqrt(np.maximum(variance.sum(axis=0), 0)).sum())


def _masked_pixels(
    image: ArrayLike, reference: ArrayLike, mask: Mask | None, variance: ArrayLike | None
) -> tuple[Floats, Floats, Floats]:
    """Return the values of image, reference and variance at the n pixels in the mask, each (n, c)."""
    I, T = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    s2 = np.zeros_like(T) if variance is None else np.asarray(variance, np.float64)
    if I.shape != T.shape or s2.shape != T.shape or I.ndim not in (2, 3):
        actual = f"got {I.shape}, {T.shape} and {s2.shape}"
        refuse("metrics", "image, reference and variance of one shape (h, w[, c])", actual, "Align them")
    is_counted = _checked_mask(mask, T.shape[:2])
    I, T, s2 = (values.reshape(*T.shape[:2], -1)[is_counted] for values in (I, T, s2))
    if not (np.isfinite(I).all() and np.isfinite(T).all() and np.isfinite(s2).all() and (s2 >= 0).all()):
        refuse("metrics", "finite values and variances of 0 or more", "got others", "Mask them out")
    return I, T, s2


def _checked_mask(mask: Mask | None, shape: tuple[int, ...]) -> Mask:
    is_counted = np.ones(shape, bool) if mask is None else np.asarray(mask, bool)
    if is_counted.shape != shape or not is_counted.any():
        actual = f"got {is_counted.shape} with {int(is_counted.sum())} pixels"
        refuse("mask", f"one of {shape} with at least one pixel", actual, "Correct it")
    return is_counted


def flip(
    image: ArrayLike,
    reference: ArrayLike,
    mask: Mask | None = None,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    high_dynamic_range: bool = False,
) -> FlipDifference:
    """Return the FLIP error of a picture (h, w, 3) against a reference.

    image, reference : (h, w, 3) sRGB values in 0..1 as displayed, after exposure and tone curve; with
        `high_dynamic_range`, linear Rec. 709 values of 0 or more
    mask : (h, w) pixels to compare; elsewhere the image is set to the reference
    pixels_per_degree : assumed resolution at the eye
    high_dynamic_range : whether to compare at all exposures that suit the reference, and to keep
        the largest error of each pixel

    Raises DermisError when the package flip-evaluator is not installed.

    Source: [Andersson2020], and [Andersson2021] for high dynamic range.
    """
    evaluator = import_extra("flip_evaluator", "FLIP")
    T = _checked_picture(reference, high_dynamic_range)
    is_counted = _checked_mask(mask, T.shape[:2])
    I = np.where(is_counted[..., None], _checked_picture(image, high_dynamic_range, T.shape), T)
    mode = "HDR" if high_dynamic_range else "LDR"
    viewing = {"ppd": float(pixels_per_degree)}
    arrays = (np.ascontiguousarray(T), np.ascontiguousarray(I))
    error, _, _ = evaluator.evaluate(*arrays, mode, not high_dynamic_range, False, False, viewing)
    error = np.where(is_counted, error[..., 0], np.float32(0))
    return FlipDifference(float(error[is_counted].mean(dtype=np.float64)), error, float(pixels_per_degree))


def _checked_picture(
    picture: ArrayLike, high_dynamic_range: bool, shape: tuple[int, ...] | None = None
) -> NDArray[np.float32]:
    values = np.asarray(picture, np.float32)
    if values.ndim != 3 or values.shape[2] != 3 or (shape is not None and values.shape != shape):
        refuse("flip", f"two pictures of {shape or '(h, w, 3)'}", f"got {values.shape}", "Align them")
    highest = np.inf if high_dynamic_range else 1.0
    if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= highest):
        expected = "finite values of 0 or more" if high_dynamic_range else "sRGB values of 0 to 1"
        actual = f"they go from {values.min():.4g} to {values.max():.4g}"
        refuse("flip", expected, actual, "Tone-map and encode the picture first, or clip it")
    return values


def signed_difference(image: ArrayLike, reference: ArrayLike, difference_gain: float = 4.0) -> Floats:
    """Return an sRGB picture (h, w, 3) of image minus reference, mid-grey where both are equal.

    image, reference : (h, w, 3) linear Rec. 709 values; 1 is white
    difference_gain : factor by which the differences are multiplied. They are taken between sRGB values, so
        equal differences look about equally large
    """
    I, T = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    if I.shape != T.shape or I.ndim != 3 or I.shape[2] != 3:
        actual = f"got {I.shape} and {T.shape}"
        refuse("difference", "two pictures of one shape (h, w, 3)", actual, "Align them")
    if not (np.isfinite(I).all() and np.isfinite(T).all()):
        refuse("difference", "finite values", "got others", "Mask them out")
    if not difference_gain > 0:
        refuse("gain", "a number above 0", f"got {difference_gain}", "4 shows what the eye can just see")
    difference = encode_srgb(np.maximum(I, 0)) - encode_srgb(np.maximum(T, 0))
    return np.clip(ZERO_DIFFERENCE_GREY + difference_gain * difference, 0.0, 1.0)
