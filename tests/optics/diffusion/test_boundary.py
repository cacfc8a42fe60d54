"""Smooth surface: Fresnel reflectance against a supplied table, moments, and the boundary mismatch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slabs import table
from tolerances import PUBLISHED

from dermis.optics.diffusion.boundary import (
    boundary_mismatch,
    diffuse_fresnel_reflectance,
    fresnel,
    internal_moment,
    normal_reflectance,
)


def test_fresnel_of_the_table(sample_folder: Path) -> None:
    rows = table(sample_folder, "fresnel_eta1.4.csv")
    assert np.allclose(fresnel(rows["cos_theta"], 1.4), rows["F_exact_eta14"], rtol=PUBLISHED)


def test_hemispherical_means_of_the_table(sample_folder: Path) -> None:
    for row in table(sample_folder, "fresnel_hemispherical.csv"):
        assert diffuse_fresnel_reflectance(row["eta"], "exact") == pytest.approx(
            row["Fdr_internal_exact"], abs=1e-12
        )
        assert boundary_mismatch(row["eta"], "exact") == pytest.approx(row["A_exact"], rel=1e-12)
        # The table rounds the polynomial's coefficients to three digits.
        assert boundary_mismatch(row["eta"]) == pytest.approx(row["A_egan"], rel=1e-3)


def test_marble_of_the_notebook() -> None:
    """Intermediates of the fit that comes with [dEonLuebke2007]."""
    assert diffuse_fresnel_reflectance(1.5) == pytest.approx(0.59681111, abs=1e-8)
    assert boundary_mismatch(1.5) == pytest.approx(3.96045416, abs=1e-8)


@pytest.mark.parametrize("kind", ["polynomial", "exact"])
def test_matched_surface_does_nothing(kind: str) -> None:
    assert boundary_mismatch(1.0, kind) == 1.0  # type: ignore[arg-type]
    assert normal_reflectance(1.0) == 0.0
    assert internal_moment(1, 1.0) == 0.0


def test_reflectance_ends() -> None:
    assert fresnel(1.0, 1.4) == pytest.approx(normal_reflectance(1.4))
    assert fresnel(0.0, 1.4) == pytest.approx(1.0)
    assert fresnel(0.6, 1.0 / 1.4) == 1.0  # beyond the critical angle


def test_light_goes_both_ways_alike() -> None:
    """Reflectance along a path is equal from both sides."""
    outside = np.linspace(0.05, 1.0, 20)
    inside = np.sqrt(1.0 - (1.0 - outside**2) / 1.4**2)
    assert np.allclose(fresnel(outside, 1.4), fresnel(inside, 1.0 / 1.4), rtol=1e-12)


def test_moments_by_brute_force() -> None:
    mu = (np.arange(400_000) + 0.5) / 400_000
    for order in (1, 2):
        brute = float(np.mean(fresnel(mu, 1.0 / 1.4) * mu**order))
        assert internal_moment(order, 1.4) == pytest.approx(brute, abs=1e-7)
