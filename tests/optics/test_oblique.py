"""Lateral offset of obliquely incident light, against photon simulations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from dermis.optics.equivalent_medium import oblique_offset_mm
from dermis.optics.media import Layer, Medium

Floats = NDArray[np.float64]
_PHOTONS, _MOST_STEPS, _LEAST = 100_000, 3000, 0.05


def left(albedo: float, angle: float) -> tuple[Floats, Floats]:
    """Return exit positions of photons that entered a half-space at 0 along +x, and their weights."""
    rng = np.random.default_rng(1)
    x, z, weight = np.zeros(_PHOTONS), np.zeros(_PHOTONS), np.ones(_PHOTONS)
    along, down = np.full(_PHOTONS, np.sin(angle)), np.full(_PHOTONS, np.cos(angle))
    positions, weights = [], []
    for _ in range(_MOST_STEPS):
        step = rng.exponential(size=len(x))
        out = z + step * down < 0.0
        positions.append(x[out] - z[out] / down[out] * along[out])
        weights.append(weight[out])
        x, z, weight = (one[~out] for one in (x + step * along, z + step * down, albedo * weight))
        lives = rng.random(len(x)) < weight / _LEAST
        x, z, weight = x[lives], z[lives], np.maximum(weight[lives], _LEAST)
        if not len(x):
            break
        down = rng.uniform(-1.0, 1.0, len(x))
        along = np.sqrt(1.0 - down**2) * np.cos(rng.uniform(0.0, 2.0 * np.pi, len(x)))
    return np.concatenate(positions), np.concatenate(weights)


def middle(positions: Floats, weights: Floats, beyond: float) -> float:
    """Return the position with equal amounts of light farther than `beyond` on both sides."""

    def more_ahead(at: float) -> float:
        return float(weights[positions > at + beyond].sum() - weights[positions < at - beyond].sum())

    return float(brentq(more_ahead, -2.0, 4.0))


@pytest.mark.parametrize("albedo", [0.96, 0.9, 0.84])
def test_light_lies_where_photons_do(albedo: float) -> None:
    """The offset is between the centres of light farther than one and than two mean free paths."""
    angle = np.radians(60.0)
    leaving = left(albedo, angle)
    near, far = (middle(*leaving, beyond) / np.sin(angle) for beyond in (1.0, 2.0))
    layer = Layer(np.array([1.0 - albedo]), np.array([albedo]))
    assert near < oblique_offset_mm(Medium("flesh", (layer,), 1.0)) < far


def test_it_is_the_mean_of_channels_and_less_below_a_surface() -> None:
    layer = Layer(np.array([0.0, 0.0, 0.0]), np.array([0.5, 1.0, 2.0]))
    assert oblique_offset_mm(Medium("flesh", (layer,), 1.0)) == pytest.approx((2.0 + 1.0 + 0.5) / 3)
    assert oblique_offset_mm(Medium("flesh", (layer,), 1.4)) == pytest.approx((2.0 + 1.0 + 0.5) / 3 / 1.4)
