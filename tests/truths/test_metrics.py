"""Error measures with known results, and their standard errors by simulation."""

from __future__ import annotations

import sys
from math import erf

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.truths.metrics import Estimate, energy_ratio, flip, relative_rmse, signed_difference
from dermis.base.errors import DermisError
from dermis.images.colour import encode_srgb

Floats = NDArray[np.float64]

TRIALS = 400
SAMPLES = 64


def test_error_without_noise_is_the_plain_ratio() -> None:
    reference = np.full((4, 5, 3), 2.0)
    image = reference.copy()
    image[:2] += 0.5
    assert relative_rmse(image, reference) == pytest.approx((np.sqrt(0.5 * 0.25 / 4.0), 0.0))
    assert energy_ratio(image, reference) == pytest.approx((1.125, 0.0))
    assert relative_rmse(reference, reference) == Estimate(0.0, 0.0)
    assert relative_rmse(image[..., 0], reference[..., 0]).value == relative_rmse(image, reference).value


def test_only_the_mask_counts() -> None:
    reference = np.ones((4, 4, 3))
    image, mask = reference.copy(), np.zeros((4, 4), bool)
    mask[1:3] = True
    image[1:3] *= 1.1
    image[0] = 50.0
    assert relative_rmse(image, reference, mask).value == pytest.approx(0.1)
    assert energy_ratio(image, reference, mask).value == pytest.approx(1.1)


def scene() -> tuple[Floats, Floats, Floats]:
    """Return a reference, an image of it with an error of 8 %, and the standard deviation of one sample."""
    y, x = np.mgrid[:24, :24] / 24.0
    reference = 0.2 + np.sin(3.0 * x) ** 2 + 0.3 * y
    return reference, reference * (1.0 + 0.08 * np.cos(9.0 * y)) + 0.03, 0.8 * reference


def noisy(
    rng: np.random.Generator, reference: Floats, deviation: Floats, shared: bool = False, skewed: bool = False
) -> tuple[Floats, Floats]:
    """Return the mean of skewed samples, like those of rarely lit paths, and its estimated variance."""
    shape = (SAMPLES, *reference.shape[:2], 1 if shared else reference.shape[-1])
    paths = rng.exponential(size=shape) - 1.0 if skewed else rng.normal(size=shape)
    samples = reference + deviation * paths
    return samples.mean(axis=0), samples.var(axis=0, ddof=1) / SAMPLES


@pytest.mark.parametrize(
    ("channels", "shared", "skewed", "slack"),
    [(1, False, False, 1.0), (3, True, False, 1.0), (3, False, False, np.sqrt(3.0)), (1, False, True, 1.0)],
)
def test_noise_is_subtracted(channels: int, shared: bool, skewed: bool, slack: float) -> None:
    """The estimate is unbiased within three standard errors over many references.

    The stated errors match the spread. Deviations of channels are added: this is right when they share paths,
    and sqrt(3) too large when they do not. For skewed noise the stated error is 7 % too small here.
    """
    rng = np.random.default_rng(5)
    reference, image, deviation = (np.repeat(values[..., None], channels, axis=2) for values in scene())
    right = relative_rmse(image, reference).value, energy_ratio(image, reference).value
    biased, found = [], []
    for _ in range(TRIALS):
        mean, variance = noisy(rng, reference, deviation, shared, skewed)
        biased.append(relative_rmse(image, mean).value)
        found.append((relative_rmse(image, mean, None, variance), energy_ratio(image, mean, None, variance)))
    assert np.mean(biased) > 1.2 * right[0]
    for k, (expected, power) in enumerate(zip(right, (2, 1), strict=True)):
        values, errors = np.array([both[k] for both in found]).T
        # the square, whose estimate is unbiased
        off = (values**power).mean() - expected**power
        assert abs(off) < 3.0 * (values**power).std() / np.sqrt(TRIALS)
        assert errors.mean() == pytest.approx(slack * values.std(), rel=0.12)
        covered = (np.abs(values - expected) < errors).mean()
        assert covered == pytest.approx(erf(slack / np.sqrt(2.0)), abs=0.07)


def test_noise_of_both_pictures_is_subtracted() -> None:
    """A noisy image has the same error against a noisy reference as without noise.

    Its standard error is not too small.
    """
    rng = np.random.default_rng(7)
    reference, image, deviation = (values[..., None] for values in scene())
    right, found = relative_rmse(image, reference).value, []
    for _ in range(TRIALS):
        mean, variance = noisy(rng, reference, deviation)
        seen, own = noisy(rng, image, 0.5 * deviation)
        found.append(relative_rmse(seen, mean, None, variance, own))
    values, errors = np.array(found).T
    off = (values**2).mean() - right**2
    assert abs(off) < 3.0 * (values**2).std() / np.sqrt(TRIALS)
    assert values.std() < errors.mean() < 1.6 * values.std()


def test_a_perfect_picture_is_within_its_error() -> None:
    """Below the noise the root is 0 or small; it is at most its standard error in 84 of 100 cases."""
    rng = np.random.default_rng(6)
    reference, _, deviation = (values[..., None] for values in scene())
    found = [
        relative_rmse(reference, mean, None, variance)
        for mean, variance in (noisy(rng, reference, deviation) for _ in range(200))
    ]
    assert np.mean([e.value <= e.standard_error for e in found]) == pytest.approx(0.84, abs=0.08)
    assert all(0.0 < e.standard_error < 0.1 for e in found)


@pytest.mark.parametrize(
    ("image", "reference", "mask", "variance"),
    [
        (np.ones((2, 2)), np.ones((2, 3)), None, None),
        (np.ones((2, 2)), np.full((2, 2), np.nan), None, None),
        (np.ones((2, 2)), np.ones((2, 2)), np.zeros((2, 2), bool), None),
        (np.ones((2, 2)), np.ones((2, 2)), np.ones((3, 2), bool), None),
        (np.ones((2, 2)), np.ones((2, 2)), None, -np.ones((2, 2))),
        (np.ones((2, 2)), np.zeros((2, 2)), None, None),
        (np.ones((2, 2)), np.zeros((2, 2)), None, np.ones((2, 2))),
    ],
)
def test_wrong_pictures_are_refused(image: Floats, reference: Floats, mask: None, variance: None) -> None:
    with pytest.raises(DermisError):
        relative_rmse(image, reference, mask, variance)
    with pytest.raises(DermisError):
        energy_ratio(image, reference, mask, variance)


def flat(*colour: float) -> Floats:
    return np.broadcast_to(np.array(colour), (32, 32, 3)).copy()


def test_flip_matches_known_pairs() -> None:
    """FLIP is 1 for green against blue and 0 for equal pictures, and symmetric."""
    pytest.importorskip("flip_evaluator")
    assert flip(flat(0.2, 0.5, 0.7), flat(0.2, 0.5, 0.7)).mean == 0.0
    assert flip(flat(0.0, 0.0, 1.0), flat(0.0, 1.0, 0.0)).mean == pytest.approx(1.0, abs=1e-4)
    there, back = (
        flip(flat(0.5, 0.5, 0.5), flat(0.6, 0.5, 0.5)),
        flip(flat(0.6, 0.5, 0.5), flat(0.5, 0.5, 0.5)),
    )
    assert there.mean == pytest.approx(back.mean, rel=1e-4) and 0.05 < there.mean < 0.5
    assert there.pixels_per_degree == 67.0


def test_flip_uses_only_masked_pixels() -> None:
    pytest.importorskip("flip_evaluator")
    mask = np.zeros((32, 32), bool)
    mask[:, :16] = True
    spoilt = np.where(mask[..., None], flat(0.5, 0.5, 0.5), flat(1.0, 0.0, 0.0))
    assert flip(spoilt, flat(0.5, 0.5, 0.5), mask).mean == 0.0
    half = flip(np.where(mask[..., None], flat(0.7, 0.5, 0.5), 0.0), flat(0.5, 0.5, 0.5), mask)
    assert half.mean == pytest.approx(float(half.error[mask].mean())) and half.error[~mask].max() == 0.0


def test_flip_sees_less_of_finer_detail() -> None:
    """A checkerboard from farther away merges into grey."""
    pytest.importorskip("flip_evaluator")
    board = flat(0.4, 0.4, 0.4)
    board[::2, ::2] = board[1::2, 1::2] = 0.6
    grey = np.broadcast_to(encode_srgb(0.5 * (0.133 + 0.319)), board.shape)
    assert flip(board, grey, None, 100.0).mean < 0.7 * flip(board, grey, None, 15.0).mean


def test_flip_of_high_dynamic_range_chooses_its_exposure() -> None:
    pytest.importorskip("flip_evaluator")
    dim = flip(flat(0.6, 0.5, 0.5), flat(0.5, 0.5, 0.5), high_dynamic_range=True).mean
    bright = flip(flat(60.0, 50.0, 50.0), flat(50.0, 50.0, 50.0), high_dynamic_range=True).mean
    assert dim == pytest.approx(bright, rel=0.02) and dim > 0.02


def test_flip_refuses_invalid_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flip_evaluator")
    for image in (flat(1.2, 0.0, 0.0), flat(-0.1, 0.0, 0.0), flat(np.nan, 0.0, 0.0), np.zeros((4, 4))):
        with pytest.raises(DermisError, match="flip"):
            flip(image, flat(0.5, 0.5, 0.5))
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(DermisError, match=r"package flip-evaluator.*dermis\[truth\]"):
        flip(flat(0.5, 0.5, 0.5), flat(0.5, 0.5, 0.5))


def test_difference_is_grey_where_there_is_none() -> None:
    reference = flat(0.3, 0.2, 0.1)
    np.testing.assert_array_equal(signed_difference(reference, reference), 0.5)
    redder = signed_difference(reference * [1.1, 1.0, 1.0], reference, 4.0)[0, 0]
    assert redder[0] == pytest.approx(0.5 + 4.0 * (encode_srgb(0.33) - encode_srgb(0.3)))
    assert (redder[1:] == 0.5).all()
    assert (signed_difference(10.0 * reference, reference) == 1.0).all()
    assert (signed_difference(0.0 * reference, reference) == 0.0).all()


def test_wrong_differences_are_refused() -> None:
    with pytest.raises(DermisError, match="shape"):
        signed_difference(np.zeros((2, 2, 3)), np.zeros((2, 3, 3)))
    with pytest.raises(DermisError, match="finite"):
        signed_difference(np.full((2, 2, 3), np.inf), np.zeros((2, 2, 3)))
    with pytest.raises(DermisError, match="gain"):
        signed_difference(np.zeros((2, 2, 3)), np.zeros((2, 2, 3)), 0.0)
