"""Colours of many skins from a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.hankel import NEAR_ZERO_FREQUENCY
from dermis.optics.diffusion.models import hankel_transform
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN as FACE
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import dj2006_layers, spectral_medium
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.skin_colours import colour_table
from dermis.optics.tissue import load_tissue

WORST, WORST_LIVING = 0.006, 0.0015
"""What the table's docstring promises: anywhere, and for skin with at least 0.001 of melanin and blood."""


def computed(parameters: SkinParameters, melanin: Floats, blood: Floats) -> Floats:
    """Return colours computed without a table, one skin at a time."""
    media = [
        spectral_medium("dj2006", replace(parameters, melanin=m, blood=b))
        for m, b in zip(melanin, blood, strict=True)
    ]
    spectra = np.array(
        [hankel_transform(medium, "layered", "layer", NEAR_ZERO_FREQUENCY)[0] for medium in media]
    )
    return (1.0 - normal_reflectance(media[0].eta)) * spectra @ rgb_weights(WAVELENGTHS_NM).T


def test_layers_of_many_shares_are_those_of_each_skin() -> None:
    """Layers are equal bit for bit."""
    fractions = np.array([0.0, 0.01, 0.3, 1.0])
    mixed = dj2006_layers(FACE, fractions)
    for row, fraction in enumerate(fractions):
        alone = spectral_medium("dj2006", replace(FACE, melanin=fraction, blood=fraction)).layers
        for many, one in zip(mixed, alone, strict=True):
            assert (many.thickness_mm, many.name) == (one.thickness_mm, one.name)
            assert np.array_equal(many.sigma_a[row], one.sigma_a)
            assert np.array_equal(many.sigma_s_prime[row], one.sigma_s_prime)


@pytest.mark.parametrize("thickness", [0.03, 0.05, 0.25])
@pytest.mark.parametrize(("least", "worst"), [(0.0, WORST), (0.001, WORST_LIVING)])
def test_table_is_near_what_it_stands_for(thickness: float, least: float, worst: float) -> None:
    parameters = replace(FACE, epidermis_mm=thickness)
    rng = np.random.default_rng(1)
    melanin, blood = np.maximum(rng.random((2, 120)) ** 3, least)
    error = np.abs(colour_table(parameters).lookup(melanin, blood) - computed(parameters, melanin, blood))
    assert error.max() < worst
    assert error.mean() < 0.0005


def test_nodes_are_the_tissues_own_colours() -> None:
    table = colour_table(FACE)
    melanin, blood = (8 / 64) ** 2, (4 / 64) ** 2
    tissue = load_tissue("spectral", pigments={"melanin": melanin, "blood": blood})
    assert table.lookup(np.array([melanin]), np.array([blood]))[0] == pytest.approx(
        tissue.profile().total, abs=1e-9
    )


def test_pigments_darken_and_blood_reddens() -> None:
    table = colour_table(FACE)
    fractions = np.linspace(0, 1, 50)
    for colours in (table.lookup(fractions, np.full(50, 0.01)), table.lookup(np.full(50, 0.01), fractions)):
        assert (np.diff(colours.sum(axis=1)) < 0).all()
    pale, flushed = table.lookup(np.array([0.015, 0.015]), np.array([0.005, 0.05]))
    assert flushed[0] / flushed[1] > 1.15 * pale[0] / pale[1]


def test_shares_beyond_are_read_at_the_edge() -> None:
    table = colour_table(FACE)
    outside = table.lookup(np.array([-1.0, 2.0]), np.array([2.0, -1.0]))
    edge = table.colours[[0, -1], [-1, 0]]
    assert outside == pytest.approx(edge)
