"""Slabs by adding and doubling: energy, a photon simulation, and the exact half-space."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.optics.angular_response import directional_reflectance, refracted_cosine
from dermis.optics.slabs import solve_doubled_slabs, solve_slabs

PHOTONS = 40_000


def straight_down(cosine: np.ndarray, fraction: np.ndarray) -> float:
    """Extrapolate from the nodes to normal incidence."""
    return float(np.polyval(np.polyfit(cosine[-4:], fraction[-4:], 3), 1.0))


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_photons_leave_slabs_as_often(eta: float) -> None:
    """Scattered light on both sides is compared at normal incidence."""
    for depth in (0.5, 2.0, 6.0):
        made = solve_slabs(0.9, depth, eta)
        ends = made.cosine[-4:]  # the nodes stop short of straight down
        back, through = (
            np.polyval(np.polyfit(ends, part[0, -4:], 3), 1.0) for part in (made.reflected, made.transmitted)
        )
        run = trace_slab([ScatteringLayer(0.1, 0.9, depth, 0.0, eta)], PHOTONS).relative_to_entering
        assert back == pytest.approx(run.total_reflectance, abs=4.0 * run.total_reflectance_se)
        assert through == pytest.approx(run.total_transmittance, abs=4.0 * run.total_transmittance_se)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_no_light_is_made_or_lost(eta: float) -> None:
    made = solve_slabs(1.0, [20.0, 50.0], eta)  # where all has scattered
    assert made.flux.sum() == pytest.approx(1.0)
    assert np.abs(made.reflected + made.transmitted - 1.0).max() < 1e-3
    clear = solve_slabs(1.0, 0.01, 1.0)
    straight = np.exp(-0.01 / clear.cosine)
    assert np.abs(clear.reflected + clear.transmitted + straight - 1.0).max() < 1e-5


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_a_deep_slab_is_a_half_space(eta: float) -> None:
    air = np.array([0.2, 0.6, 0.95])
    made = solve_slabs(0.95, 64.0, eta)
    found = np.interp(refracted_cosine(air, eta), made.cosine, made.reflected[0])
    assert found == pytest.approx(directional_reflectance(air, 0.95, eta), abs=2e-3)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_doubling_gives_all_depths_on_its_way(eta: float) -> None:
    least = np.array([0.3, 0.5])
    made = solve_doubled_slabs(0.9, least, 3, eta)
    one_by_one = solve_slabs(0.9, np.concatenate([least * 2.0**k for k in range(4)]), eta)
    for name in ("reflected", "transmitted"):
        assert getattr(made, name) == pytest.approx(getattr(one_by_one, name), abs=1e-5)
