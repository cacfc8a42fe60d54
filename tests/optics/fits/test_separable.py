"""Separable kernels: light by sectors, exact cases, and their errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ndtr

from dermis.optics.fits.burley import fit_burley
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.fits.separable import (
    SECTORS_PER_QUADRANT,
    SeparableKernel,
    evaluate_kernel,
    fit_separable,
    preintegrated_kernel,
)
from dermis.optics.fits.targets import RingTarget
from dermis.optics.gaussians import GaussianSum

EDGES = np.append(0.0, np.geomspace(1e-3, 60.0, 120))
CROSS = SeparableKernel(np.array([0.8]), np.array([[0.04], [4.0]]), np.array([[0.5], [0.5]]))


def rings_of(profile: GaussianSum) -> RingTarget:
    return RingTarget(EDGES, np.diff(profile.energy_within(EDGES), axis=0), profile.albedo)


def line_profile(kernel: SeparableKernel, offset_mm: Any) -> np.ndarray:
    """Return a(x) of one pass, (..., c) [1/mm]."""
    x, v = np.asarray(offset_mm)[..., None, None], kernel.variance_mm2
    return (kernel.weight * np.exp(-(x**2) / (2.0 * v)) / np.sqrt(2.0 * np.pi * v)).sum(axis=-2)


def one(variance: float) -> GaussianSum:
    return GaussianSum("one", np.array([variance]), np.array([[0.7]]))


def test_all_light_goes_somewhere_alike_in_x_and_y() -> None:
    cells = CROSS.sector_energy(EDGES)
    assert cells.shape == (120, SECTORS_PER_QUADRANT, 1)
    assert cells.sum() == pytest.approx(0.8, rel=1e-9)
    assert np.allclose(cells, cells[:, ::-1], atol=1e-15)


def test_cells_are_the_integral_of_the_kernel() -> None:
    """The integral over a quarter disc is by columns."""
    radius = 1.3

    def column(x: float) -> float:
        height = np.sqrt(radius**2 - x**2)
        under = 0.5 * sum(2 * ndtr(height / s) - 1 for s in (0.2, 2.0))
        return float(line_profile(CROSS, x)[0] * under)

    disc = 4 * 0.8 * quad(column, 0, radius, epsabs=1e-12)[0] / 2
    assert CROSS.sector_energy(np.array([0.0, radius])).sum() == pytest.approx(disc, rel=1e-7)


def test_sectors_near_the_axes_get_the_light_of_the_cross() -> None:
    """A thin ring at 2.8 degrees from an axis is compared with 42 degrees."""
    ring = np.array([1.99, 2.01])
    cells = CROSS.sector_energy(ring)[0, :, 0]
    theta = (np.arange(SECTORS_PER_QUADRANT) + 0.5) * np.pi / 2 / SECTORS_PER_QUADRANT
    along_x, along_y = (line_profile(CROSS, 2 * f(theta))[:, 0] for f in (np.cos, np.sin))
    density = 0.8 * along_x * along_y
    area = np.pi * (ring[1] ** 2 - ring[0] ** 2) / SECTORS_PER_QUADRANT
    assert cells[0] > 3 * cells[7]
    assert np.allclose(cells[3:-3], (area * density)[3:-3], rtol=0.02)  # the middle stands for the sector


def test_a_round_kernel_has_the_ring_error_of_its_gaussian() -> None:
    target = rings_of(GaussianSum("two", np.array([0.1, 2.0]), np.array([[0.4], [0.5]])))
    single = fit_gaussians(target, 1, keep_energy=True)
    assert np.allclose(
        evaluate_kernel(preintegrated_kernel(single.profile), target).error, single.error, rtol=1e-9
    )


def test_preintegrated_kernel_is_the_profile_from_its_side() -> None:
    profile = GaussianSum("two", np.array([0.1, 2.0]), np.array([[0.4, 0.1], [0.5, 0.2]]))
    kernel = preintegrated_kernel(profile)
    assert np.allclose(kernel.weight.sum(axis=0), 1.0)
    for x in (0.0, 0.4, 2.0):
        side = [
            2 * quad(lambda y, i=i, x=x: profile.radiant_exitance(np.hypot(x, y))[i], 0, 30)[0]
            for i in range(2)
        ]
        assert np.allclose(kernel.albedo * line_profile(kernel, x), side, rtol=1e-6)


def test_preintegrated_kernel_is_not_round() -> None:
    profile = GaussianSum("two", np.array([0.1, 2.0]), np.array([[0.4], [0.5]]))
    found = evaluate_kernel(preintegrated_kernel(profile), rings_of(profile))
    assert found.error[0] > 0.1 and abs(found.energy_error[0]) < 1e-12


@pytest.mark.parametrize("variance", [0.01, 5.0])
def test_one_gaussian_is_found_again(variance: float) -> None:
    found = fit_separable(rings_of(one(variance)))
    spread = (found.kernel.weight * found.kernel.variance_mm2).sum()
    assert found.error[0] < 1e-4
    assert spread == pytest.approx(variance, rel=1e-3)


def test_the_artists_model_beats_preintegration_by_this_number(counted_skin: RingTarget) -> None:
    fitted = fit_separable(counted_skin)
    exact = evaluate_kernel(
        preintegrated_kernel(fit_gaussians(counted_skin, 6, keep_energy=True).profile), counted_skin
    )
    assert (fitted.error < exact.error).all()
    assert (abs(fitted.energy_error) < 1e-12).all() and (abs(exact.energy_error) < 1e-6).all()
    near, far = np.sqrt(fitted.kernel.variance_mm2)
    assert (near < far).all() and np.allclose(fitted.kernel.weight.sum(axis=0), 1.0)


def test_three_kinds_of_fit_compare_by_one_number(counted_skin: RingTarget) -> None:
    gaussians = fit_gaussians(counted_skin, 6).error
    burley = fit_burley(counted_skin).error
    separable = fit_separable(counted_skin).error
    assert (gaussians < burley).all() and (burley < separable).all()
    assert (separable < 0.7).all()
