"""Fresnel reflectance compared with independent tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import PUBLISHED

from dermis.specular.fresnel import SKIN_ETA, SKIN_F0, dielectric, hemispherical_reflectance, schlick


@pytest.fixture(scope="module")
def columns(sample_folder: Path) -> NDArray[np.float64]:
    """Return the cosine, exact, Schlick from the exact F0, and Schlick from 0.028."""
    path = sample_folder / "reference" / "data" / "fresnel_eta1.4.csv"
    return np.loadtxt(path, delimiter=",", skiprows=1).T


def test_both_curves_match_the_reference_columns(columns: NDArray[np.float64]) -> None:
    cosine, exact, schlick_exact, schlick_rounded = columns
    assert np.allclose(dielectric(cosine), exact, rtol=PUBLISHED)
    assert np.allclose(schlick(cosine, ((SKIN_ETA - 1) / (SKIN_ETA + 1)) ** 2), schlick_exact, rtol=PUBLISHED)
    assert np.allclose(schlick(cosine), schlick_rounded, rtol=PUBLISHED)


def test_schlick_follows_fresnel() -> None:
    """Check deviations from the exact curve of at most 0.05 near grazing and 0.0003 at normal incidence."""
    cosine = np.linspace(0.0, 1.0, 501)
    assert np.abs(schlick(cosine) - dielectric(cosine)).max() < 0.05
    assert abs(schlick(1.0) - dielectric(1.0)) < 3e-4


@pytest.mark.parametrize("eta", [1.2, 1.3, 1.33, 1.38, 1.4, 1.45, 1.5, 1.55])
def test_hemispherical_reflectance_matches_quadrature(sample_folder: Path, eta: float) -> None:
    path = sample_folder / "reference" / "data" / "fresnel_hemispherical.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    external = float(table[table[:, 0] == eta, 3][0])
    assert hemispherical_reflectance(lambda c: dielectric(c, eta)) == pytest.approx(external, rel=PUBLISHED)


def test_hemispherical_reflectance_exceeds_six_percent_of_the_talk() -> None:
    assert hemispherical_reflectance() == pytest.approx(0.0768, abs=5e-5)
    # Schlick's curve integrates in closed form: F0 + (1 - F0) / 21
    assert hemispherical_reflectance(schlick) == pytest.approx(SKIN_F0 + (1 - SKIN_F0) / 21, rel=1e-12)


def test_a_matched_surface_reflects_nothing() -> None:
    assert np.abs(dielectric(np.linspace(0.1, 1, 10), 1.0)).max() < 1e-20
