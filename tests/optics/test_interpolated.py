"""Interpolation between cached tables."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.optics.angular_response import (
    INTERPOLATION_STEPS,
    angular_response,
    directional_reflectance,
    interpolate_table,
)


def test_what_is_linear_is_itself() -> None:
    for at in (0.0, 0.3, 0.999, 1.0):
        assert interpolate_table(lambda x: np.array([2.0 * x, 1.0 - x]), at) == pytest.approx(
            [2.0 * at, 1.0 - at]
        )


def test_only_the_two_beside_are_made() -> None:
    asked: list[float] = []

    def made(at: float) -> np.ndarray:
        asked.append(at * INTERPOLATION_STEPS)
        return np.array([at])

    interpolate_table(made, 0.5 + 0.25 / INTERPOLATION_STEPS)
    assert asked == [INTERPOLATION_STEPS / 2, INTERPOLATION_STEPS / 2 + 1]


def test_beyond_the_ends_are_the_ends() -> None:
    assert (
        interpolate_table(lambda x: np.array([x]), -0.2) == 0.0
        and interpolate_table(lambda x: np.array([x]), 1.5) == 1.0
    )


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_half_spaces_between_steps(eta: float) -> None:
    """Interpolated half-spaces are compared with solved ones, for reflectances of skin from 0.05."""
    cosine = np.linspace(0.1, 1.0, 10)
    for albedo in (0.4, 0.73, 0.91, 0.984, 0.9991):
        above = float(directional_reflectance(1.0, albedo, eta))
        law = angular_response([above], eta).relative_reflectance[:, 0]
        found = np.interp(np.sqrt(cosine), np.linspace(0.0, 1.0, len(law)), law)
        assert found == pytest.approx(directional_reflectance(cosine, albedo, eta) / above, abs=2e-3), albedo
