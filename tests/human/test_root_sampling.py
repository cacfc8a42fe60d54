"""Blue noise of hair roots: counts in circles vary less than those of independent points."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.human.hair.root_sampling import CANDIDATES_PER_SAMPLE, progressive_samples, spread_thresholds

Floats = NDArray[np.float64]
SIDE_MM, COUNT = 60.0, 12_000


@cache
def samples() -> Floats:
    places = np.random.default_rng(0).random((CANDIDATES_PER_SAMPLE * COUNT, 3)) * [SIDE_MM, SIDE_MM, 0.0]
    return places[progressive_samples(places, SIDE_MM**2, COUNT)]


def relative_variance(places: Floats) -> float:
    """Return the variance of the number of points in circles of 30 points, divided by its mean."""
    from scipy.spatial import cKDTree

    radius = SIDE_MM * np.sqrt(30.0 / np.pi / len(places))
    inside = radius + np.random.default_rng(1).random((600, 2)) * (SIDE_MM - 2.0 * radius)
    counts = cKDTree(places[:, :2]).query_ball_point(inside, radius, return_length=True)
    return float(counts.var() / counts.mean())


def test_there_are_as_many_samples_as_requested() -> None:
    assert 0.98 * COUNT <= len(samples()) <= COUNT
    assert len(progressive_samples(np.zeros((0, 3)), 1.0, 0)) == 0


@pytest.mark.parametrize("fraction", [1.0, 0.8, 0.5, 0.1, 0.05])
def test_every_prefix_is_blue_noise(fraction: float) -> None:
    places = samples()[: round(fraction * len(samples()))]
    assert relative_variance(places) < 0.4


def test_samples_keep_their_distance() -> None:
    from scipy.spatial import cKDTree

    distance = np.asarray(cKDTree(samples()).query(samples(), k=2)[0])[:, 1]
    assert distance.min() > 0.65 * SIDE_MM / np.sqrt(COUNT)


@pytest.mark.parametrize("density", [0.9, 0.5, 0.2])
@pytest.mark.parametrize("fraction", [1.0, 0.3])
def test_thresholds_thin_evenly(density: float, fraction: float) -> None:
    """Independent thresholds would add 1 minus the density to the relative variance."""
    places = samples()
    thresholds = spread_thresholds(places)
    count = round(fraction * len(places))
    kept = places[:count][thresholds[:count] < density]
    assert len(kept) == pytest.approx(density * count, rel=0.02)
    assert relative_variance(kept) < 0.55
