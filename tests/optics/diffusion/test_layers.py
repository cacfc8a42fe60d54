"""Layered media: supplied totals and profiles, a medium divided into two layers, and layered diffusion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.special import j0, jn_zeros
from slabs import TWO_LAYER, case, ring_means, slab, table
from tolerances import CLOSED_FORM, LAYERED_TOTAL

from dermis.optics.diffusion import dipole, hankel, layered_diffusion, multipole
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.media import Layer, Medium, published_media
from dermis.optics.radial import enclosed_energy, resample_profile

A = boundary_mismatch(1.4, "exact")
PRINTED_A = 3.250697461379377  # at 1.4, with the polynomial's coefficients rounded to three digits
CASES = ("dj3_R", "dj3_G", "dj3_B", "two_layer")
MODELS = ("multipole", "layered", "layered-point")


@pytest.mark.parametrize("name", (*CASES, "skin1_R", "skin1_G", "skin1_B"))
def test_totals_of_the_table(sample_folder: Path, name: str) -> None:
    for row in table(sample_folder, "diffusion_totals.csv"):
        if row["case"] != name:
            continue
        medium, A = case(name), row["A"]
        added = multipole.stack_response(hankel.NEAR_ZERO_FREQUENCY, medium, A, "none").R_above[0, 0]
        beam, point = (
            layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, medium, A, s)[0][0, 0]
            for s in ("beam", "point")
        )
        assert added == pytest.approx(row["R_total_DJ_or_dipole"], rel=CLOSED_FORM)
        assert beam == pytest.approx(row["R_total_LD"], rel=CLOSED_FORM)
        assert point == pytest.approx(row["R_total_LP"], rel=CLOSED_FORM)


@pytest.mark.parametrize("name", CASES)
def test_profiles_of_the_table(sample_folder: Path, name: str) -> None:
    rows = table(sample_folder, "diffusion_profiles.csv")
    own = rows[(rows["case"] == name) & (rows["r_mm"] > 0.0)]
    s = hankel.transform_frequencies()
    for transform, column in (
        (multipole.stack_response(s, case(name), A, "none").R_above, "R_DJ_or_dipole_A_exact"),
        (layered_diffusion.solve_layers(s, case(name), A, "point")[0], "R_layered_point_LP_A_exact"),
    ):
        R = resample_profile(own["r_mm"], hankel.transform_radii(), hankel.inverse_transform(transform))[:, 0]
        assert np.allclose(R, own[column], rtol=CLOSED_FORM, atol=1e-8 * own[column].max())


@pytest.mark.parametrize("name", CASES)
def test_beam_profile_in_the_rings_of_the_table(sample_folder: Path, name: str) -> None:
    """The tolerance is larger because the inversion of the table oscillates near its centre."""
    rows = table(sample_folder, "profiles_mc_vs_diffusion.csv")
    own = rows[rows["case"] == f"{name}_g0"]
    own = own[(own["r_lo_mm"] > 0.003) & (own["r_hi_mm"] < 8.0)]
    grid = hankel.transform_radii()[500:1400]
    R = hankel.inverse_transform(
        layered_diffusion.solve_layers(hankel.transform_frequencies(), case(name), A)[0]
    )[500:1400]
    within = enclosed_energy(np.append(own["r_lo_mm"], own["r_hi_mm"][-1]), grid, R)
    means = np.diff(within, axis=0)[:, 0] / (np.pi * (own["r_hi_mm"] ** 2 - own["r_lo_mm"] ** 2))
    assert np.allclose(means, own["R_layered_diffusion_LD"], rtol=0.025, atol=1e-6)


@pytest.mark.parametrize("r", [1e-3, 0.05, 1.0])
def test_beam_profile_by_another_quadrature(r: float) -> None:
    """Integrals between zeros of the Bessel function, with repeated averaging of the alternating sums."""
    medium = published_media()["dj3"].channel(1)

    def part(low: float, high: float) -> float:
        x, w = np.polynomial.legendre.leggauss(64)
        s = 0.5 * (high - low) * x + 0.5 * (low + high)
        R = layered_diffusion.solve_layers(s, medium, A)[0][:, 0]
        return float(0.5 * (high - low) * w @ (R * s * j0(s * r)))

    zeros = jn_zeros(0, 200) / r
    fine = np.concatenate([[0.0], np.geomspace(1e-6, zeros[0], 150)])
    sums = np.cumsum([sum(map(part, fine[:-1], fine[1:])), *map(part, zeros[:-1], zeros[1:])])
    for _ in range(60):
        sums = 0.5 * (sums[1:] + sums[:-1])
    R = hankel.inverse_transform(layered_diffusion.solve_layers(hankel.transform_frequencies(), medium, A)[0])
    assert resample_profile(np.array([r]), hankel.transform_radii(), R)[0, 0] == pytest.approx(
        sums[-1] / (2 * np.pi), rel=1e-7
    )


def test_thin_layers_lose_light_as_printed_and_not_when_clamped() -> None:
    """Against 20 million photons: red .472, green .382, blue .286."""
    photons = np.array([0.47244, 0.38236, 0.28576])
    printed = diffusion_profile(published_media()["dj3"], "multipole", clamp="none")
    clamped = diffusion_profile(published_media()["dj3"], "multipole")
    layered = diffusion_profile(published_media()["dj3"], "layered")
    assert printed.total[0] < 0.6 * photons[0]
    assert np.abs(clamped.total / photons - 1.0).max() < 0.035
    assert np.abs(layered.total / photons - 1.0).max() < LAYERED_TOTAL
    assert any("thinner than a mean free path" in warning for warning in printed.warnings)


@pytest.mark.parametrize("alpha_prime", [0.9, 0.98])
@pytest.mark.parametrize("depth", [0.05, 0.5, 1.0, 3.0])
def test_layered_diffusion_does_not_see_a_cut(alpha_prime: float, depth: float) -> None:
    whole = slab(alpha_prime)
    (layer,) = whole.layers
    parted = Medium("cut", (Layer(layer.sigma_a, layer.sigma_s_prime, depth), layer))
    s = np.geomspace(1e-6, 1e3, 60)
    for source in ("beam", "point"):
        one, two = (layered_diffusion.solve_layers(s, medium, A, source)[0] for medium in (whole, parted))
        assert np.allclose(one, two, rtol=1e-9, atol=1e-15)


def test_cuts_of_the_table_in_the_multipole(sample_folder: Path) -> None:
    for row in table(sample_folder, "dj_split_consistency.csv"):
        medium = _cut(row["mua"], row["musp"], row["cut_depth_mfp"])
        if row["cut_depth_mfp"] == 1.0:
            continue  # the printed source is just on the cut: either side of it is right
        total = multipole.stack_response(hankel.NEAR_ZERO_FREQUENCY, medium, PRINTED_A, "none").R_above[0, 0]
        assert total == pytest.approx(row["R_total_DJ_two_layers"], rel=CLOSED_FORM)
        uncut = dipole.total_reflectance(medium.layers[-1], PRINTED_A)[0]
        assert uncut == pytest.approx(row["R_total_uncut_dipole"], rel=CLOSED_FORM)


def _cut(sigma_a: float, sigma_s_prime: float, depth_mfp: float) -> Medium:
    a, s = np.array([sigma_a]), np.array([sigma_s_prime])
    return Medium("cut", (Layer(a, s, depth_mfp / float(a[0] + s[0])), Layer(a, s)))


def test_white_stack_gives_all_back() -> None:
    white = Medium(
        "white", (Layer(np.zeros(1), np.array([5.0]), 0.3), Layer(np.zeros(1), np.array([1.0]), 4.0))
    )
    R, T = layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, white, A)
    unscattered = np.exp(-(5.0 * 0.3 + 4.0))
    assert (R + T)[0, 0] == pytest.approx(1.0 - unscattered, abs=1e-6)


def test_slab_transmits_alike_in_both_models_when_it_is_thick() -> None:
    thick = slab(0.99, 12.0)
    T = multipole.stack_response(hankel.NEAR_ZERO_FREQUENCY, thick, A).T_down[0, 0]
    assert layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, thick, A)[1][0, 0] == pytest.approx(
        T, rel=0.05
    )


@pytest.mark.parametrize("model", MODELS)
def test_rings_hold_the_total(model: str) -> None:
    profile = diffusion_profile(published_media()["dj3"], model)  # type: ignore[arg-type]
    assert np.allclose(profile.ring_energy.sum(axis=0), profile.total, rtol=3e-4)
    means = ring_means(profile.edges_mm, profile.ring_energy)
    assert (means[:-30] > 0.0).all()


def test_point_in_a_thin_slab_is_inside_it() -> None:
    R, T = layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, slab(0.9, 0.2), A, "point")
    assert 0.0 < R[0, 0] < 1.0 and 0.0 < T[0, 0] < 1.0 and R[0, 0] + T[0, 0] < 1.0


@pytest.mark.parametrize("thickness", [0.2, 5.0])
def test_point_of_a_slab_thinner_than_a_mean_free_path_lies_in_its_middle(thickness: float) -> None:
    """With equal faces, the same light leaves on both sides."""
    thin = Medium("thin", (Layer(np.zeros(1), np.array([0.01]), thickness),))
    R, T = layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, thin, A, "point")
    assert R[0, 0] == pytest.approx(T[0, 0], rel=1e-6)


def test_channels_are_independent() -> None:
    together = diffusion_profile(published_media()["dj3"], "layered")
    for channel in range(3):
        alone = diffusion_profile(published_media()["dj3"].channel(channel), "layered")
        assert np.allclose(alone.reflectance[:, 0], together.reflectance[:, channel], rtol=1e-9, atol=1e-12)


def test_two_layer_total_is_near_monte_carlo(sample_folder: Path) -> None:
    runs = table(sample_folder, "mc_totals.csv")
    truth = runs[runs["case"] == "two_layer_g0"][0]["Rd_per_entering"]
    layered = diffusion_profile(TWO_LAYER, "layered").total[0]
    multipole = diffusion_profile(TWO_LAYER, "multipole").total[0]
    assert abs(layered / truth - 1.0) < 0.04 < abs(multipole / truth - 1.0)


@pytest.mark.parametrize("source", ["beam", "point"])
def test_what_is_reflected_alone_is_the_same(source: layered_diffusion.SourceKind) -> None:
    medium, frequency = published_media()["dj3"], hankel.transform_frequencies()
    alone = layered_diffusion.solve_reflectance(frequency, medium, A, source)
    assert np.array_equal(alone, layered_diffusion.solve_layers(frequency, medium, A, source)[0])
