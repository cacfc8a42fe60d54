"""Media that scatter forward, against photons of the same phase function; alike in all directions at 0."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import FORWARD_AMOUNT, FORWARD_CONTINUOUS
from walk import fresnel, returned

from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.optics.directions import ROWS, Directions, directional_albedo, directions, mean_of_once
from dermis.optics.media import media
from dermis.optics.slabs import NODES, doubled_slabs, forward_directions, leaving_deep, phase, slabs
from dermis.optics.thin_parts import thin_parts

G = 0.8
PHOTONS = 60_000


def single(reduced: float, g: float = G) -> float:
    """Albedo of single scattering of a medium by its reduced one."""
    return reduced / (reduced + (1.0 - g) * (1.0 - reduced))


def from_above(cosine: np.ndarray, share: np.ndarray) -> float:
    """The nodes stop short of straight down."""
    return float(np.polyval(np.polyfit(cosine[-4:], share[-4:], 3), 1.0))


def law_of(reduced: float, eta: float) -> Directions:
    return forward_directions(float(directional_albedo(1.0, reduced, eta)), eta, G)


@pytest.mark.parametrize("eta", [1.0, 1.4])
@pytest.mark.parametrize("reduced", [0.9585, 0.678])
def test_photons_leave_slabs_as_often(reduced: float, eta: float) -> None:
    """From straight above, for depths that real skin has from 0.4 to 10 mm."""
    for depth in (0.5, 2.0, 10.0):
        body = ScatteringLayer(1.0 - reduced, reduced / (1.0 - G), depth, G, eta)
        run = trace_slab([body], PHOTONS).per_entering
        for nodes in (8, NODES):
            made = slabs(reduced, depth, eta, nodes, G)
            back, through = (from_above(made.cosine, part[0]) for part in (made.back, made.through))
            error = FORWARD_AMOUNT + 3.0 * run.total_reflectance_se
            assert back == pytest.approx(run.total_reflectance, abs=error)
            error = FORWARD_AMOUNT + 3.0 * run.total_transmittance_se
            assert through == pytest.approx(run.total_transmittance, abs=error)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_no_light_is_made_or_lost(eta: float) -> None:
    made = slabs(1.0, [20.0, 50.0], eta, g=G)
    assert np.abs(made.back + made.through - 1.0).max() < FORWARD_AMOUNT
    clear = slabs(1.0, 0.01, 1.0, g=G)  # five times as deep for what scatters five times as often
    assert np.abs(clear.back + clear.through + np.exp(-0.05 / clear.cosine) - 1.0).max() < 1e-5


def test_phase_functions_sum_to_one_and_have_their_mean() -> None:
    x, w = np.polynomial.legendre.leggauss(NODES)
    mu, weight = 0.5 * (x + 1.0), 0.5 * w
    made = phase(0.9, G, mu, NODES)
    assert 0.5 * (made.backward + made.forward) @ weight == pytest.approx(np.ones(NODES))
    on = G**NODES
    mean = on * mu + (1.0 - on) * 0.5 * (made.forward - made.backward) @ (weight * mu)
    assert mean == pytest.approx(G * mu)
    even = phase(0.9, 0.0, mu, NODES)
    assert (even.backward == 1.0).all() and (even.forward == 1.0).all()
    assert (even.albedo, even.extinction, even.whole_extinction) == (0.9, 1.0, 1.0)


def test_a_mean_cosine_of_0_is_the_medium_of_before() -> None:
    plain, forward = directions([0.4, 0.2], 1.4), forward_directions([0.4, 0.2], 1.4, 0.0)
    assert (plain.returned == forward.returned).all() and (plain.once == forward.once).all()
    for eta in (1.0, 1.4):
        near, at = forward_directions([0.4, 0.2], eta, 1e-6), directions([0.4, 0.2], eta)
        assert near.returned == pytest.approx(at.returned, rel=FORWARD_CONTINUOUS)
        assert near.from_everywhere == pytest.approx(at.from_everywhere, rel=FORWARD_CONTINUOUS)
        assert near.once == pytest.approx(at.once, rel=FORWARD_CONTINUOUS)


@pytest.mark.parametrize("eta", [1.0, 1.4])
@pytest.mark.parametrize("reduced", [0.9585, 0.678])
def test_light_at_a_slant_comes_back_as_photons_do(reduced: float, eta: float) -> None:
    """From 60 and 81 degrees, over light from above."""
    law = law_of(reduced, eta)
    above, _, _ = returned(1.0, single(reduced), eta, 100_000, g=G)
    for cosine in (0.5, 0.15):
        share, error, _ = returned(cosine, single(reduced), eta, 100_000, g=G)
        told = np.interp(np.sqrt(cosine), np.linspace(0.0, 1.0, ROWS), law.returned[:, 0])
        assert told == pytest.approx(share / above, rel=0.01 + 4.0 * error / share)
        even = np.interp(np.sqrt(cosine), np.linspace(0.0, 1.0, ROWS), directions(above, eta).returned[:, 0])
        assert even < told


def test_photons_leave_a_refracting_half_space_as_told() -> None:
    """Light that enters at 81 degrees, by quarters of the squared cosine outside."""
    reduced, cosine, eta = 0.68, 0.15, 1.4
    _, _, walked = returned(cosine, single(reduced), eta, 400_000, g=G)
    square = (np.arange(400) + 0.5) / 400
    a, b = (np.sqrt(1.0 - (1.0 - c2) / eta**2) for c2 in (cosine**2, square))

    def error(law: Directions) -> float:
        entering = np.interp(np.sqrt(cosine), np.linspace(0.0, 1.0, ROWS), law.returned[:, 0])
        radiance = 1.0 + law.once[0] * (1.0 / (a + b) - mean_of_once(cosine, eta)) / entering
        passed = (radiance * (1.0 - fresnel(b, eta))).reshape(4, 100).mean(axis=1)
        return float(np.abs(passed / passed.sum() / (walked / walked.sum()) - 1.0).max())

    assert error(law_of(reduced, eta)) < 0.05
    assert error(law_of(reduced, eta)) < 0.5 * error(
        directions(float(directional_albedo(1.0, reduced, eta)), eta)
    )


@pytest.mark.parametrize(("eta", "most"), [(1.0, 0.2), (1.4, 0.02)])
@pytest.mark.parametrize("reduced", [0.9585, 0.838, 0.678])
def test_all_pairs_of_directions(reduced: float, eta: float, most: float) -> None:
    """Radiance below the surface over all pairs, weighed by light that is alike from everywhere."""
    a, share, exact = leaving_deep(reduced, eta, NODES, G)
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    slant, weight = 1.0 / (a[:, None] + a) - mean_of_once(air, eta), np.outer(share, share)

    def error(law: Directions) -> float:
        table = np.interp(np.sqrt(air), np.linspace(0.0, 1.0, ROWS), law.returned[:, 0])
        above = (share @ exact).sum() / table.sum()
        off = above * (table + law.once[0] * slant) - exact
        return float(np.sqrt((weight * off**2).sum() / (weight * exact**2).sum()))

    even = directions(float(directional_albedo(1.0, reduced, eta)), eta)
    assert error(law_of(reduced, eta)) < most
    assert error(law_of(reduced, eta)) < 0.8 * error(even)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_amounts_of_thin_parts_are_those_of_slabs_cut_one_by_one(eta: float) -> None:
    """Found with twice as many cosines, and for each thickness; far more than of isotropic media."""
    body, reach, variance = media()["skin1"].with_eta(eta), 12.0, np.array([0.05, 0.5, 5.0, 20.0])
    made, even = thin_parts(body, variance, reach, G), thin_parts(body, variance, reach)
    depth, layer = reach * np.linspace(0.0, 1.0, len(made.deep))[1:] ** 2, body.layers[0]
    for c in range(3):
        albedo, extinction = float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c])
        cut, whole = slabs(albedo, extinction * depth, eta, g=G), slabs(albedo, 1e4, eta, g=G)
        share, all_back = made.through[1:, :, c].sum(axis=1), float(whole.back[0] @ whole.flux)
        assert share * all_back == pytest.approx(cut.through @ cut.flux, abs=FORWARD_AMOUNT)
    near = np.flatnonzero((depth > 0.4) & (depth < 1.2))
    assert (made.through[near + 1, :, 0].sum(axis=1) > 1.4 * even.through[near + 1, :, 0].sum(axis=1)).all()


def test_doubling_gives_all_depths_on_its_way() -> None:
    least = np.array([0.3, 0.5])
    made = doubled_slabs(0.9, least, 3, 1.4, g=G)
    one_by_one = slabs(0.9, np.concatenate([least * 2.0**k for k in range(4)]), 1.4, g=G)
    assert made.back == pytest.approx(one_by_one.back, abs=1e-4)
    assert made.through == pytest.approx(one_by_one.through, abs=1e-4)
