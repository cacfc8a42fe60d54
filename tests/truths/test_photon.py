"""Compiled parts of a photon's random walk against known results."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths import photon
from dermis.optics.diffusion.boundary import fresnel

DIRECTIONS = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.0, -0.8), (-0.48, 0.64, 0.6), (1.0, 0.0, 0.0)]
DEFLECTIONS = 20_000


def generator() -> photon.RandomState:
    return np.random.SeedSequence(0).generate_state(4, np.uint64)


def test_random_words_are_those_of_the_published_generator() -> None:
    """The first words from the state (1, 2, 3, 4) are those that the authors' program prints."""
    rng = np.array([1, 2, 3, 4], np.uint64)
    published = [
        41943041,
        58720359,
        3588806011781223,
        3591011842654386,
        9228616714210784205,
        9973669472204895162,
        14011001112246962877,
        12406186145184390807,
        15849039046786891736,
        10450023813501588000,
    ]
    assert [int(photon.next_uint64(rng)) for _ in published] == published


@pytest.mark.parametrize(("word", "expected"), [(0, 2.0**-53), (2**64 - 1, 1.0 - 2.0**-53)])
def test_uniform_number_is_never_0_or_1(word: int, expected: float) -> None:
    rng = np.array([word, 0, 0, 0], np.uint64)  # the state before the smallest or largest word
    assert photon.random_uniform(rng) == expected


@pytest.mark.parametrize("eta", [0.7, 1.0 / 1.4, 1.0, 1.05, 1.5])
def test_refraction_is_that_of_the_closed_form(eta: float) -> None:
    cosines = np.linspace(0.01, 1.0, 200)
    computed = np.array([photon.refract(cosine, eta) for cosine in cosines])
    assert np.allclose(computed[:, 0], fresnel(cosines, 1.0 / eta), atol=1e-12)
    sine2 = eta**2 * (1.0 - cosines**2)
    assert np.allclose(computed[:, 1] ** 2, np.maximum(1.0 - sine2, 0.0), atol=1e-12)


@pytest.mark.parametrize("g", [-0.5, 0.0, 1e-9, 0.8, 0.98])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_deflections_have_the_moments_of_henyey_and_greenstein(
    direction: tuple[float, float, float], g: float
) -> None:
    """The Legendre moments of the cosine are g and g^2, the mean sideways is 0, and lengths stay 1."""
    rng = generator()
    after = np.array([photon.scatter_direction(*direction, g, rng) for _ in range(DEFLECTIONS)])
    assert np.allclose(np.linalg.norm(after, axis=1), 1.0, atol=1e-12)
    cosine = after @ direction
    for moment, expected in ((cosine, g), (1.5 * cosine**2 - 0.5, g**2)):
        assert abs(moment.mean() - expected) < 4.0 * moment.std() / np.sqrt(DEFLECTIONS)
    across = after - np.outer(cosine, direction)
    assert (np.abs(across.mean(axis=0)) < 4.0 / np.sqrt(2.0 * DEFLECTIONS)).all()
