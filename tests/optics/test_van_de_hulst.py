"""Van de Hulst's formula for the albedo of a colour, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.half_space import diffuse_albedo
from dermis.optics.media import albedo_from_colour

PRINTED = 1e-4  # its constants have six digits


def colour_from_albedo(alpha: np.ndarray, g: float) -> np.ndarray:
    """Return the diffuse reflectance of a half-space, after [dEon2016]."""
    s = np.sqrt((1.0 - alpha) / (1.0 - alpha * g))
    return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)


@pytest.mark.parametrize("colour", [0.05, 0.21, 0.43, 0.7, 0.95])
def test_a_half_space_of_the_albedo_returns_the_colour(colour: float) -> None:
    assert diffuse_albedo(float(albedo_from_colour(colour))) == pytest.approx(colour, abs=0.003)


@pytest.mark.parametrize("g", [0.0, 0.8, -0.3])
def test_colour_and_albedo_are_each_others_inverse(g: float) -> None:
    colour = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(colour_from_albedo(albedo_from_colour(colour, g), g), colour, atol=PRINTED)
