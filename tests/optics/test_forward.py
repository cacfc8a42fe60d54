"""Anisotropic media against photons with the same phase function; isotropic for g = 0."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import FORWARD_AMOUNT, FORWARD_CONTINUOUS
from walk import fresnel, returned

from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.optics.angular_response import (
    DIRECTION_ROWS,
    AngularResponse,
    angular_response,
    directional_reflectance,
    mean_single_scattering_kernel,
)
from dermis.optics.media import published_media
from dermis.optics.slabs import (
    DIRECTION_NODE_COUNT,
    anisotropic_response,
    half_space_radiance,
    phase_matrices,
    solve_doubled_slabs,
    solve_slabs,
)
from dermis.optics.thin_parts import solve_thin_parts

G = 0.8
PHOTONS = 60_000


def single(reduced: float, g: float = G) -> float:
    """Return the single-scattering albedo of a medium from its reduced albedo."""
    return reduced / (reduced + (1.0 - g) * (1.0 - reduced))


def from_above(cosine: np.ndarray, fraction: np.ndarray) -> float:
    """Extrapolate from the nodes to normal incidence."""
    return float(np.polyval(np.polyfit(cosine[-4:], fraction[-4:], 3), 1.0))


def law_of(reduced: float, eta: float) -> AngularResponse:
    return anisotropic_response(float(directional_reflectance(1.0, reduced, eta)), eta, G)


@pytest.mark.parametrize("eta", [1.0, 1.4])
@pytest.mark.parametrize("reduced", [0.9585, 0.678])
def test_photons_leave_slabs_as_often(reduced: float, eta: float) -> None:
    """Light is at normal incidence; depths correspond to 0.4 to 10 mm of skin."""
    for depth in (0.5, 2.0, 10.0):
        body = ScatteringLayer(1.0 - reduced, reduced / (1.0 - G), depth, G, eta)
        run = trace_slab([body], PHOTONS).relative_to_entering
        for nodes in (8, DIRECTION_NODE_COUNT):
            made = solve_slabs(reduced, depth, eta, nodes, G)
            back, through = (from_above(made.cosine, part[0]) for part in (made.reflected, made.transmitted))
            error = FORWARD_AMOUNT + 3.0 * run.total_reflectance_se
            assert back == pytest.approx(run.total_reflectance, abs=error)
            error = FORWARD_AMOUNT + 3.0 * run.total_transmittance_se
            assert through == pytest.approx(run.total_transmittance, abs=error)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_no_light_is_made_or_lost(eta: float) -> None:
    made = solve_slabs(1.0, [20.0, 50.0], eta, g=G)
    assert np.abs(made.reflected + made.transmitted - 1.0).max() < FORWARD_AMOUNT
    clear = solve_slabs(1.0, 0.01, 1.0, g=G)  # five times as deep for what scatters five times as often
    assert np.abs(clear.reflected + clear.transmitted + np.exp(-0.05 / clear.cosine) - 1.0).max() < 1e-5


def test_phase_functions_sum_to_one_and_have_their_mean() -> None:
    x, w = np.polynomial.legendre.leggauss(DIRECTION_NODE_COUNT)
    mu, weight = 0.5 * (x + 1.0), 0.5 * w
    made = phase_matrices(0.9, G, mu, DIRECTION_NODE_COUNT)
    assert 0.5 * (made.backward + made.forward) @ weight == pytest.approx(np.ones(DIRECTION_NODE_COUNT))
    on = G**DIRECTION_NODE_COUNT
    mean = on * mu + (1.0 - on) * 0.5 * (made.forward - made.backward) @ (weight * mu)
    assert mean == pytest.approx(G * mu)
    even = phase_matrices(0.9, 0.0, mu, DIRECTION_NODE_COUNT)
    assert (even.backward == 1.0).all() and (even.forward == 1.0).all()
    assert (even.albedo, even.extinction, even.unscaled_extinction) == (0.9, 1.0, 1.0)


def test_a_mean_cosine_of_0_is_the_medium_of_before() -> None:
    plain, forward = angular_response([0.4, 0.2], 1.4), anisotropic_response([0.4, 0.2], 1.4, 0.0)
    assert (plain.relative_reflectance == forward.relative_reflectance).all() and (
        plain.single_scattering == forward.single_scattering
    ).all()
    for eta in (1.0, 1.4):
        near, at = anisotropic_response([0.4, 0.2], eta, 1e-6), angular_response([0.4, 0.2], eta)
        assert near.relative_reflectance == pytest.approx(at.relative_reflectance, rel=FORWARD_CONTINUOUS)
        assert near.relative_diffuse_reflectance == pytest.approx(
            at.relative_diffuse_reflectance, rel=FORWARD_CONTINUOUS
        )
        assert near.single_scattering == pytest.approx(at.single_scattering, rel=FORWARD_CONTINUOUS)


@pytest.mark.parametrize("eta", [1.0, 1.4])
@pytest.mark.parametrize("reduced", [0.9585, 0.678])
def test_light_at_a_slant_comes_back_as_photons_do(reduced: float, eta: float) -> None:
    """Reflectance at 60 and 81 degrees is relative to normal incidence."""
    law = law_of(reduced, eta)
    above, _, _ = returned(1.0, single(reduced), eta, 100_000, g=G)
    for cosine in (0.5, 0.15):
        fraction, error, _ = returned(cosine, single(reduced), eta, 100_000, g=G)
        interpolated = np.interp(
            np.sqrt(cosine), np.linspace(0.0, 1.0, DIRECTION_ROWS), law.relative_reflectance[:, 0]
        )
        assert interpolated == pytest.approx(fraction / above, rel=0.01 + 4.0 * error / fraction)
        even = np.interp(
            np.sqrt(cosine),
            np.linspace(0.0, 1.0, DIRECTION_ROWS),
            angular_response(above, eta).relative_reflectance[:, 0],
        )
        assert even < interpolated


def test_photons_leave_a_refracting_half_space_as_told() -> None:
    """Light enters at 81 degrees; radiance is by quarters of the squared exit cosine."""
    reduced, cosine, eta = 0.68, 0.15, 1.4
    _, _, walked = returned(cosine, single(reduced), eta, 400_000, g=G)
    square = (np.arange(400) + 0.5) / 400
    a, b = (np.sqrt(1.0 - (1.0 - c2) / eta**2) for c2 in (cosine**2, square))

    def error(law: AngularResponse) -> float:
        entering = np.interp(
            np.sqrt(cosine), np.linspace(0.0, 1.0, DIRECTION_ROWS), law.relative_reflectance[:, 0]
        )
        radiance = (
            1.0
            + law.single_scattering[0]
            * (1.0 / (a + b) - mean_single_scattering_kernel(cosine, eta))
            / entering
        )
        passed = (radiance * (1.0 - fresnel(b, eta))).reshape(4, 100).mean(axis=1)
        return float(np.abs(passed / passed.sum() / (walked / walked.sum()) - 1.0).max())

    assert error(law_of(reduced, eta)) < 0.05
    assert error(law_of(reduced, eta)) < 0.5 * error(
        angular_response(float(directional_reflectance(1.0, reduced, eta)), eta)
    )


@pytest.mark.parametrize(("eta", "most"), [(1.0, 0.2), (1.4, 0.02)])
@pytest.mark.parametrize("reduced", [0.9585, 0.838, 0.678])
def test_all_pairs_of_directions(reduced: float, eta: float, most: float) -> None:
    """Radiance below the surface is weighted by uniform light."""
    a, fraction, exact = half_space_radiance(reduced, eta, DIRECTION_NODE_COUNT, G)
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    slant, weight = (
        1.0 / (a[:, None] + a) - mean_single_scattering_kernel(air, eta),
        np.outer(fraction, fraction),
    )

    def error(law: AngularResponse) -> float:
        table = np.interp(np.sqrt(air), np.linspace(0.0, 1.0, DIRECTION_ROWS), law.relative_reflectance[:, 0])
        above = (fraction @ exact).sum() / table.sum()
        off = above * (table + law.single_scattering[0] * slant) - exact
        return float(np.sqrt((weight * off**2).sum() / (weight * exact**2).sum()))

    even = angular_response(float(directional_reflectance(1.0, reduced, eta)), eta)
    assert error(law_of(reduced, eta)) < most
    assert error(law_of(reduced, eta)) < 0.8 * error(even)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_amounts_of_thin_parts_are_those_of_slabs_cut_one_by_one(eta: float) -> None:
    """Expected values use twice as many cosines, and one solution per thickness."""
    body, reach, variance = published_media()["skin1"].with_eta(eta), 12.0, np.array([0.05, 0.5, 5.0, 20.0])
    made, even = solve_thin_parts(body, variance, reach, G), solve_thin_parts(body, variance, reach)
    depth, layer = reach * np.linspace(0.0, 1.0, len(made.directionality))[1:] ** 2, body.layers[0]
    for c in range(3):
        albedo, extinction = float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c])
        cut, whole = solve_slabs(albedo, extinction * depth, eta, g=G), solve_slabs(albedo, 1e4, eta, g=G)
        fraction, all_back = made.transmitted[1:, :, c].sum(axis=1), float(whole.reflected[0] @ whole.flux)
        assert fraction * all_back == pytest.approx(cut.transmitted @ cut.flux, abs=FORWARD_AMOUNT)
    near = np.flatnonzero((depth > 0.4) & (depth < 1.2))
    assert (
        made.transmitted[near + 1, :, 0].sum(axis=1) > 1.4 * even.transmitted[near + 1, :, 0].sum(axis=1)
    ).all()


def test_doubling_gives_all_depths_on_its_way() -> None:
    least = np.array([0.3, 0.5])
    made = solve_doubled_slabs(0.9, least, 3, 1.4, g=G)
    one_by_one = solve_slabs(0.9, np.concatenate([least * 2.0**k for k in range(4)]), 1.4, g=G)
    assert made.reflected == pytest.approx(one_by_one.reflected, abs=1e-4)
    assert made.transmitted == pytest.approx(one_by_one.transmitted, abs=1e-4)
