"""Empty space of maps: what is known stays, what is not takes after its neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.images.filters import fill_empty


def island() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    known = np.zeros((64, 64), bool)
    known[20:40, 10:50] = True
    return rng.uniform(0.4, 0.6, (64, 64, 3)).astype(np.float32), known


def test_known_pixels_stay() -> None:
    image, known = island()
    assert np.array_equal(fill_empty(image, known)[known], image[known])


def test_empty_pixels_are_within_the_range_of_the_known() -> None:
    image, known = island()
    image[~known] = 99.0
    filled = fill_empty(image, known)
    assert filled.min() >= image[known].min() - 1e-6 and filled.max() <= image[known].max() + 1e-6


def test_constants_stay_constant() -> None:
    _, known = island()
    assert fill_empty(np.full((64, 64, 1), 0.25), known) == pytest.approx(0.25, abs=1e-6)


def test_neighbours_count_more_than_what_is_far() -> None:
    known = np.zeros((64, 64), bool)
    known[:, :8] = known[:, -8:] = True
    image = np.zeros((64, 64, 1), np.float32)
    image[:, -8:] = 1.0
    filled = fill_empty(image, known)[32, :, 0]
    assert filled[9] < 0.2 and filled[-10] > 0.8


def test_nothing_known_is_black() -> None:
    assert not fill_empty(np.ones((16, 16, 1)), np.zeros((16, 16), bool)).any()
