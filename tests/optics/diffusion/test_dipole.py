"""Dipoles: published intermediate results, supplied profiles, totals, and known errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slabs import case, slab, table
from tolerances import CLOSED_FORM

from dermis.base.errors import DermisError
from dermis.optics.diffusion import dipole
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.media import published_media
from dermis.optics.radial import enclosed_energy

MARBLE_GREEN = published_media()["marble"].channel(1).with_eta(1.5)


def test_marble_of_the_notebook() -> None:
    """Intermediates of the fit that comes with [dEonLuebke2007]."""
    layer, A = MARBLE_GREEN.layers[0], boundary_mismatch(1.5)
    z_r, z_v = dipole.source_depths(layer, A)
    assert layer.alpha_prime[0] == pytest.approx(0.99843756, abs=1e-8)
    assert (z_r[0], z_v[0]) == pytest.approx((0.38108304, 2.39343224), abs=1e-8)
    assert layer.sigma_tr[0] == pytest.approx(0.17965642, abs=1e-8)
    assert dipole.total_reflectance(layer, A)[0] == pytest.approx(0.790932, abs=1e-6)


def test_profiles_of_the_table(sample_folder: Path) -> None:
    rows = table(sample_folder, "diffusion_profiles.csv")
    for name in ("skin1_R", "skin1_G", "skin1_B"):
        own = rows[rows["case"] == name]
        layer = case(name).layers[0]
        R = dipole.reflectance(own["r_mm"], layer, boundary_mismatch(1.3, "exact"))[:, 0]
        assert np.allclose(R, own["R_DJ_or_dipole_A_exact"], rtol=CLOSED_FORM, atol=0.0)


def test_totals_of_the_table(sample_folder: Path) -> None:
    for row in table(sample_folder, "diffusion_totals.csv"):
        if row["case"].startswith("skin1"):
            total = dipole.total_reflectance(case(row["case"]).layers[0], row["A"])[0]
            assert total == pytest.approx(row["R_total_DJ_or_dipole"], rel=CLOSED_FORM)


@pytest.mark.parametrize(
    ("alpha_prime", "eta", "printed"),
    [(0.3, 1.0, 0.0403), (0.5, 1.4, 0.0738), (0.9, 1.4, 0.2844), (0.99, 1.5, 0.5831), (0.999, 1.3, 0.8639)],
)
def test_total_in_closed_form(alpha_prime: float, eta: float, printed: float) -> None:
    layer, A = slab(alpha_prime).layers[0], boundary_mismatch(eta)
    q = np.sqrt(3.0 * (1.0 - alpha_prime))
    closed = 0.5 * alpha_prime * (1.0 + np.exp(-4.0 / 3.0 * A * q)) * np.exp(-q)
    assert dipole.total_reflectance(layer, A)[0] == pytest.approx(closed, rel=1e-12)
    # The printed table rounds the polynomial's coefficients, and leaves 0.0017 of it at a matched surface.
    assert closed == pytest.approx(printed, abs=2e-4)


def test_total_is_the_integral() -> None:
    layer, A = MARBLE_GREEN.layers[0], boundary_mismatch(1.5)
    grid = np.geomspace(1e-6, 1e3, 2000)
    integral = enclosed_energy(grid[-1:], grid, dipole.reflectance(grid, layer, A))[0]
    assert integral == pytest.approx(dipole.total_reflectance(layer, A), rel=1e-6)


def test_white_medium_gives_all_back() -> None:
    assert dipole.total_reflectance(slab(1.0).layers[0], boundary_mismatch(1.4))[0] == pytest.approx(1.0)
    assert diffusion_profile(published_media()["spectralon"], "dipole").total == pytest.approx(
        [1.0, 1.0, 1.0]
    )


@pytest.mark.parametrize(
    ("alpha_prime", "exact"), [(0.8, 0.1575), (0.9, 0.2579), (0.95, 0.3696), (0.98, 0.5162), (0.99, 0.6210)]
)
def test_better_dipole_nears_the_exact_total_with_single_scattering(alpha_prime: float, exact: float) -> None:
    """Exact totals are by adding and doubling; single scattering, which the model omits, is added."""
    medium = slab(alpha_prime)
    multiple = diffusion_profile(medium, "better-dipole").total[0]
    once = alpha_prime * _leaves_after_one_event(1.4)
    assert multiple < exact
    assert multiple + once == pytest.approx(exact, rel=0.15)


def _leaves_after_one_event(eta: float) -> float:
    """Return the fraction of light that leaves a half-space after exactly one scattering event."""
    from dermis.optics.diffusion.boundary import fresnel

    mu = (np.arange(20_000) + 0.5) / 20_000
    return float(0.5 * np.mean((1.0 - fresnel(mu, 1.0 / eta)) * mu / (1.0 + mu)))


def test_better_dipole_converges_in_its_sources() -> None:
    layer = slab(0.95).layers[0]
    r = np.geomspace(0.05, 20.0, 40)
    few, many = (dipole.better_dipole_reflectance(r, layer, 1.4, source_count=n) for n in (100, 1600))
    assert np.allclose(few, many, rtol=0.02)


@pytest.mark.parametrize("model", ["dipole", "better-dipole"])
def test_stacks_are_refused(model: str) -> None:
    with pytest.raises(DermisError, match=r"one semi-infinite layer.*3 layers.*multipole or layered"):
        diffusion_profile(published_media()["dj3"], model)  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="one semi-infinite layer"):
        diffusion_profile(slab(0.9, 2.0), model)  # type: ignore[arg-type]
