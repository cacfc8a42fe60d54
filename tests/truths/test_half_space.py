"""Closed forms of a half-space against published values and each other."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.half_space import diffuse_albedo, directional_albedo, h_function, reflected_radiance
from dermis.base.errors import DermisError

# Normal incidence by adding-doubling, to four digits.
NORMAL = {0.3: 0.0572, 0.5: 0.1152, 0.8: 0.2853, 0.9: 0.4150, 0.95: 0.5355, 0.99: 0.7527, 0.999: 0.9129}


@pytest.mark.parametrize("albedo", NORMAL)
def test_normal_incidence_matches_published_values(albedo: float) -> None:
    assert float(directional_albedo(1.0, albedo)) == pytest.approx(NORMAL[albedo], abs=6e-5)


@pytest.mark.parametrize("albedo", [0.2, 0.8, 0.99])
def test_h_solves_its_equation(albedo: float) -> None:
    # Form with cancellation, on other nodes: H = 1 + albedo / 2 mu H int H' / (mu + mu') dmu'.
    nodes, weights = np.polynomial.legendre.leggauss(200)
    mu, weight = 0.5 * (nodes + 1.0), 0.5 * weights
    H = h_function(mu, albedo)
    right = 1.0 + 0.5 * albedo * mu * H * (weight * H / (mu[:, None] + mu)).sum(axis=1)
    assert right == pytest.approx(H, rel=1e-4)
    assert (weight * H).sum() == pytest.approx(2.0 / albedo * (1.0 - np.sqrt(1.0 - albedo)), rel=1e-6)


@pytest.mark.parametrize("albedo", [0.5, 0.95])
def test_integral_over_views_is_the_albedo(albedo: float) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(100)
    view, weight = 0.5 * (nodes + 1.0), 0.5 * weights
    for cosine in (0.2, 1.0):
        radiance = reflected_radiance(cosine, view, albedo)
        seen = 2.0 * np.pi * (weight * view * radiance).sum()
        assert seen == pytest.approx(float(directional_albedo(cosine, albedo)), rel=1e-5)


def test_reflection_is_reciprocal() -> None:
    assert float(reflected_radiance(0.3, 0.9, 0.8)) == pytest.approx(
        float(reflected_radiance(0.9, 0.3, 0.8)), rel=1e-12
    )


def test_diffuse_light_is_reflected_more_than_normal_light() -> None:
    for albedo in (0.3, 0.9):
        assert float(directional_albedo(1.0, albedo)) < diffuse_albedo(albedo) < 1.0
    assert diffuse_albedo(0.0) == 0.0


def test_albedo_of_one_is_refused() -> None:
    with pytest.raises(DermisError, match="below 1"):
        h_function(1.0, 1.0)
