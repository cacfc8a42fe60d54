"""Fits of Gaussians: published and best known errors, energy, warm starts, and invalid input."""

from __future__ import annotations

import csv
import itertools
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.optics.fits import gaussian as fit_module
from dermis.optics.fits import variable_projection
from dermis.optics.fits.gaussian import GaussianFit, fit_gaussians
from dermis.optics.fits.targets import PointTarget, RingTarget, ring_error
from dermis.optics.gaussians import GaussianSum
from dermis.optics.tissue import load_tissue

Floats = NDArray[np.float64]
Counted = Callable[[str], RingTarget]

BAR = 1.001
"""Errors of our fits against the best that other code found from ten random starts."""

PRINTED_ERROR = 1e-6
"""Errors of published weights, by our quadrature against an adaptive one, absolute."""

MARBLE = {
    1: ([0.3395204000621387], [0.12585927168766622], 0.26556),
    2: (
        [0.20340934347175627, 0.3755620603387926],
        [0.07215800051973968, 1.0594650470790643],
        0.09556127690884979,
    ),
    4: (
        [0.0703083292545895, 0.18376670319465674, 0.20579595664394942, 0.2883451363447344],
        [0.036276803420493116, 0.14600343435834506, 0.9089692906732176, 6.986783328169455],
        0.012535333149773434,
    ),
}
"""Weights, variances and errors of fits to green marble, printed with [dEonLuebke2007]."""


def marble() -> PointTarget:
    """Return R(r) of the classical dipole of green marble."""
    sigma_a, sigma_s, eta = 0.0041, 2.62, 1.5
    sigma_t = sigma_a + sigma_s
    F_dr = -1.4399 / eta**2 + 0.7099 / eta + 0.6681 + 0.0636 * eta
    A = (1 + F_dr) / (1 - F_dr)
    alpha, sigma_tr = sigma_s / sigma_t, np.sqrt(3 * sigma_a * sigma_t)
    z = np.array([1 / sigma_t, (1 + 4 * A / 3) / sigma_t])
    r = np.geomspace(1e-5, 200.0, 1500)
    rho = np.sqrt(r[:, None] ** 2 + z**2)
    R = alpha / (4 * np.pi) * (z * (1 + sigma_tr * rho) * np.exp(-sigma_tr * rho) / rho**3).sum(axis=1)
    total = 0.5 * alpha * np.exp(-sigma_tr * z).sum()
    return PointTarget(r, R[:, None], np.array([total]))


def best_known(folder: Path) -> list[tuple[PointTarget, int, Floats]]:
    """Return targets, numbers of terms and errors of other code."""
    data = folder / "reference" / "data"
    stored: dict[str, Floats] = {}
    groups: dict[tuple[str, int], dict[str, float]] = defaultdict(dict)
    for infix in ("", "_djclamped"):
        stored |= dict(np.load(data / f"fit_targets{infix}.npz"))
        with (data / f"gauss_fit{infix}_best_errors.csv").open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                group = row["fit"] if row["fit"].startswith("shared") else row["target"]
                groups[group, int(row["n_gauss"])][row["target"]] = float(row["err"])
    return [
        (
            PointTarget(
                stored["r"],
                np.stack([stored[name] for name in errors], axis=1),
                np.array([float(stored[f"{name}_total"]) for name in errors]),
            ),
            terms,
            np.array(list(errors.values())),
        )
        for (_, terms), errors in groups.items()
    ]


def stored_rgb(folder: Path, name: str) -> PointTarget:
    stored = np.load(folder / "reference" / "data" / "fit_targets.npz")
    values = np.stack([stored[f"{name}_{c}"] for c in "RGB"], axis=1)
    return PointTarget(stored["r"], values, np.array([float(stored[f"{name}_{c}_total"]) for c in "RGB"]))


def made_of(profile: GaussianSum, kind: str) -> PointTarget | RingTarget:
    """Return a sum of Gaussians as a target."""
    if kind == "pointwise":
        r = np.geomspace(1e-4, 60.0, 400)
        return PointTarget(r, profile.radiant_exitance(r), profile.albedo)
    edges = np.append(0.0, np.geomspace(1e-3, 60.0, 120))
    return RingTarget(edges, np.diff(profile.energy_within(edges), axis=0), profile.albedo)


def three() -> GaussianSum:
    weight = np.array([[0.3, 0.2, 0.1], [0.2, 0.2, 0.1], [0.1, 0.05, 0.02]])
    return GaussianSum("three", np.array([0.02, 0.3, 4.0]), weight)


def mean_error(fit: GaussianFit) -> float:
    return float(np.sqrt((fit.error**2).mean()))


@pytest.mark.parametrize("terms", MARBLE)
def test_error_of_published_weights_is_the_published_one(terms: int) -> None:
    weight, variance, error = MARBLE[terms]
    ours = marble().error(np.array(variance), np.array(weight)[:, None])
    assert ours[0] == pytest.approx(error, abs=PRINTED_ERROR)


@pytest.mark.parametrize("terms", MARBLE)
def test_our_fit_is_no_worse_than_the_published_one(terms: int) -> None:
    assert fit_gaussians(marble(), terms).error[0] <= MARBLE[terms][2]


def test_the_best_fit_loses_light_unless_told_to_keep_it() -> None:
    free, kept = (fit_gaussians(marble(), 4, keep_energy=keep) for keep in (False, True))
    assert free.energy_error[0] == pytest.approx(-0.054, abs=5e-4)
    assert abs(kept.energy_error[0]) < 1e-6
    assert free.error[0] < kept.error[0] < 3 * free.error[0]


def test_errors_reach_the_best_known(sample_folder: Path) -> None:
    cases = best_known(sample_folder)
    assert len(cases) == 49 + 14 + 21 + 7
    for target, terms, errors in cases:
        ours = fit_gaussians(target, terms)
        assert (ours.error <= BAR * errors).all(), (terms, ours.error, errors)


def test_fits_per_channel_reach_the_best_known_in_one_sum(sample_folder: Path) -> None:
    best = {errors[0]: terms for target, terms, errors in best_known(sample_folder) if len(errors) == 1}
    ours = fit_gaussians(stored_rgb(sample_folder, "dj3"), 8, shared=False)
    known = sorted(error for error, terms in best.items() if terms == 8)
    assert len(ours.profile.variance_mm2) == 24
    assert ((ours.profile.weight > 0).sum(axis=0) == 8).all()
    assert all(min(abs(error / bar - 1) for bar in known) < 1e-3 for error in ours.error)


@pytest.mark.parametrize("kind", ["pointwise", "annulus"])
@pytest.mark.parametrize("shared", [True, False])
def test_gaussians_are_found_again(kind: str, shared: bool) -> None:
    found = fit_gaussians(made_of(three(), kind), 3, shared=shared)
    assert found.kind == kind and found.shared is shared
    assert (found.error < 1e-6).all() and (abs(found.energy_error) < 1e-6).all()
    for i in range(3):
        lit = found.profile.weight[:, i] > 0
        assert np.allclose(found.profile.variance_mm2[lit], three().variance_mm2, rtol=1e-3)
        assert np.allclose(found.profile.weight[lit, i], three().weight[:, i], rtol=1e-3)


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("terms", [1, 3, 8])
@pytest.mark.parametrize("case", ["skin1/g0", "dj3/g0.8"])
def test_energy_is_kept_when_asked(counted: Counted, case: str, terms: int, shared: bool) -> None:
    target = counted(case)
    free = fit_gaussians(target, terms, shared=shared)
    kept = fit_gaussians(target, terms, shared=shared, keep_energy=True)
    assert (abs(kept.energy_error) < 1e-6).all()
    assert (abs(free.energy_error) > 1e-4).all()
    assert mean_error(free) <= mean_error(kept)
    assert (kept.profile.weight >= 0).all()


def test_more_gaussians_follow_counted_light_closer(counted: Counted) -> None:
    target = counted("skin1/g0")
    errors = [mean_error(fit_gaussians(target, terms)) for terms in range(1, 9)]
    assert all(b < 0.8 * a for a, b in itertools.pairwise(errors))
    assert errors[5] < 0.065 and errors[7] < 0.03


def test_own_widths_are_no_worse_than_shared_ones(sample_folder: Path) -> None:
    target = stored_rgb(sample_folder, "skin1_dipole")
    own, shared = (fit_gaussians(target, 4, shared=shared) for shared in (False, True))
    assert (own.error < shared.error).all()


def test_error_over_rings_is_that_of_its_formula(counted: Counted) -> None:
    target = counted("dj3/g0")
    found = fit_gaussians(target, 5)
    through = np.diff(found.profile.energy_within(target.edges_mm), axis=0)
    by_hand = np.sqrt(((through - target.energy) ** 2).sum(axis=0) / (target.energy**2).sum(axis=0))
    assert np.allclose(found.error, by_hand, rtol=1e-9)
    sectors = np.repeat(through[:, None] / 7, 7, axis=1)
    assert np.allclose(ring_error(target, sectors), by_hand, rtol=1e-9)


@pytest.mark.parametrize("shared", [True, False])
def test_a_near_fit_leads_to_the_cold_optimum(
    sample_folder: Path, monkeypatch: pytest.MonkeyPatch, shared: bool
) -> None:
    target = stored_rgb(sample_folder, "dj3")
    wider = PointTarget(1.1 * target.radius_mm, target.reflectance * [1.0, 0.8, 0.6], target.total)
    before, cold = (fit_gaussians(t, 6, shared=shared) for t in (wider, target))
    monkeypatch.setattr(fit_module, "_START_LIGHT_FRACTIONS", ())  # no other start is needed
    warm = fit_gaussians(target, 6, shared=shared, similar_fit=before.profile)
    assert mean_error(warm) <= 1.001 * mean_error(cold)


def test_a_slider_over_all_melanin_stays_near_the_cold_optima() -> None:
    initial = None
    for melanin in np.linspace(0.0, 0.5, 21):
        target = load_tissue("spectral", pigments={"melanin": float(melanin)}).profile().ring_target()
        warm, cold = fit_gaussians(target, 6, similar_fit=initial), fit_gaussians(target, 6)
        assert mean_error(warm) < 1.2 * mean_error(cold)
        initial = warm.profile


def test_a_near_fit_of_another_size_is_left_aside(sample_folder: Path) -> None:
    target = stored_rgb(sample_folder, "dj3")
    four = fit_gaussians(target, 4)
    assert np.allclose(
        fit_gaussians(target, 5, similar_fit=four.profile).error, fit_gaussians(target, 5).error
    )


def test_fits_take_few_steps(sample_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interactive sliders need fast fits; benchmarks/profiles.py measures the time."""
    target, steps, project = stored_rgb(sample_folder, "dj3"), [0], variable_projection._optimal_weights

    def counted(*given: Any) -> variable_projection.WeightedFit:
        steps[0] += 1
        return project(*given)

    monkeypatch.setattr(variable_projection, "_optimal_weights", counted)
    profile = fit_gaussians(target, 6).profile
    assert 0 < steps[0] < 200
    steps[0] = 0
    fit_gaussians(target, 6, similar_fit=profile)
    assert 0 < steps[0] < 10


def test_size_and_strength_scale_out() -> None:
    base = marble()
    scaled = PointTarget(0.1 * base.radius_mm, 50.0 * base.reflectance, 0.5 * base.total)
    a, b = fit_gaussians(base, 4), fit_gaussians(scaled, 4)
    assert np.allclose(b.profile.variance_mm2, 0.01 * a.profile.variance_mm2, rtol=1e-3)
    assert np.allclose(b.profile.weight, 0.5 * a.profile.weight, rtol=1e-3)
    assert np.allclose(b.error, a.error, rtol=1e-6)


@pytest.mark.parametrize("kind", ["pointwise", "annulus"])
def test_light_below_zero_is_fitted_around(kind: str) -> None:
    """A multipole whose source is below its slab can be negative."""
    clean = made_of(three(), kind)
    r = clean.radius_mm if isinstance(clean, PointTarget) else clean.edges_mm[1:]
    dent = 0.05 * np.exp(-((np.log(r / 3.0)) ** 2))[:, None]
    if isinstance(clean, PointTarget):
        target: PointTarget | RingTarget = PointTarget(r, clean.reflectance - dent, clean.total)
    else:
        target = RingTarget(clean.edges_mm, clean.energy - dent, clean.total)
    assert (target.samples < 0).any()
    found = fit_gaussians(target, 4)
    assert (found.profile.weight >= 0).all() and np.isfinite(found.error).all()
    assert (found.error < 1.0).all()


GOOD = np.ones((3, 1))
RADII = np.array([0.1, 1.0, 2.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PointTarget(RADII, np.ones((2, 1)), np.ones(1)), "n, n x c and c"),
        (lambda: PointTarget(RADII, GOOD, np.ones(2)), "n, n x c and c"),
        (lambda: PointTarget(RADII, GOOD * np.nan, np.ones(1)), "finite"),
        (lambda: PointTarget(RADII[::-1], GOOD, np.ones(1)), "increase"),
        (lambda: PointTarget(np.array([0.0, 1.0, 2.0]), GOOD, np.ones(1)), "above 0"),
        (
            lambda: PointTarget(RADII, np.stack([RADII, 0 * RADII], 1), np.ones(2)),
            "channel 1 has a max.* of 0",
        ),
        (lambda: PointTarget(RADII, GOOD, np.array([-0.2])), "a sum of -0.2"),
        (lambda: RingTarget(np.array([0.5, 0.2, 1.0, 2.0]), GOOD, np.ones(1)), "increase from 0"),
    ],
)
def test_impossible_targets_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        make()


@pytest.mark.parametrize("terms", [0, 9])
def test_impossible_numbers_of_terms_are_refused(terms: int) -> None:
    with pytest.raises(DermisError, match="1 to 8 Gaussians"):
        fit_gaussians(marble(), terms)


def test_a_profile_that_no_gaussian_comes_near_is_refused() -> None:
    r = np.geomspace(1e-3, 10.0, 50)
    with pytest.raises(DermisError, match="Gaussians can fit"):
        fit_gaussians(PointTarget(r, -np.exp(-r)[:, None], np.ones(1)), 3)
