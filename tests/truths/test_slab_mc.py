"""Monte Carlo against published, exact and other programs' results."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2, norm
from tolerances import CHANCE, STANDARD_ERRORS

from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.optics.media import Floats

MCML_SLAB = (
    ScatteringLayer(0.1, 10.0, 1.0, 0.9, 1.37),
    ScatteringLayer(0.1, 1.0, 1.0, 0.0, 1.37),
    ScatteringLayer(0.2, 1.0, 2.0, 0.7, 1.37),
)
MCML_PHOTONS = 1_000_000


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def close(computed: float, error: float, expected: float) -> bool:
    return abs(computed - expected) < STANDARD_ERRORS * error


def consistent_with_chance(deviations: Floats) -> bool:
    """Return whether deviations in units of standard errors are consistent with chance."""
    count = len(deviations)
    worst = norm.isf(0.5 * (1.0 - (1.0 - CHANCE) ** (1.0 / count)))
    return bool(chi2.sf(np.sum(deviations**2), count) > CHANCE and np.abs(deviations).max() < worst)


def stack(row: dict[str, str]) -> list[ScatteringLayer]:
    """Return the layers of a row of the table of runs."""
    columns = (row["mua_per_mm"], row["mus_per_mm"], row["d_mm"])
    rows = zip(*([float(value) for value in column.split("|")] for column in columns), strict=True)
    return [ScatteringLayer(a, s, d, float(row["g"]), float(row["n"])) for a, s, d in rows]


def runs(sample_folder: Path) -> dict[str, dict[str, str]]:
    return {row["case"]: row for row in read(sample_folder / "reference" / "data" / "mc_totals.csv")}


def test_slab_of_van_de_hulst() -> None:
    """Albedo 0.9, optical thickness 2, g 0.75; the printed transmittance includes unscattered light."""
    run = trace_slab([ScatteringLayer(1.0, 9.0, 0.2, 0.75, 1.0)], 4_000_000)
    assert close(run.total_reflectance, run.total_reflectance_se, 0.09739)
    through = np.exp(-2.0)
    assert close(run.total_transmittance, run.total_transmittance_se, 0.66096 - through)
    error = np.sqrt(through * (1.0 - through) / run.photons)
    assert close(run.unscattered_transmittance, error, through)


def test_half_space_of_giovanelli() -> None:
    """The published 0.2600 includes the surface reflection of 0.04."""
    run = trace_slab([ScatteringLayer(1.0, 9.0, eta=1.5)], 4_000_000)
    assert run.specular == pytest.approx(0.04, abs=1e-12)
    assert close(run.total_reflectance + run.specular, run.total_reflectance_se, 0.2600)


@pytest.mark.parametrize(
    ("albedo", "exact"),
    [(0.5, 0.1152258777072045), (0.9, 0.41494747913081687), (0.98, 0.6710837470136696)],
)
def test_matched_half_space_is_that_of_chandrasekhar(albedo: float, exact: float) -> None:
    """The result is 1 - sqrt(1 - albedo) H(1), with H for isotropic scattering."""
    run = trace_slab([ScatteringLayer(1.0 - albedo, albedo, eta=1.0)], 2_000_000)
    assert run.specular == 0.0
    assert close(run.total_reflectance, run.total_reflectance_se, exact)


def test_three_layers_of_mcml(sample_folder: Path) -> None:
    """MCML's sample run has a million photons of weight 1 or less: binomial errors are an upper bound."""
    rows = read(sample_folder / "reference" / "data" / "mc_vs_mcml_sample_mco.csv")
    run = trace_slab(MCML_SLAB, 1_500_000, edges_mm=0.1 * np.arange(50))
    for kind, rings, total, overflow, published in (
        ("Rd_r", run.reflectance, run.total_reflectance, run.overflow_reflectance, 0.237544),
        ("Tt_r", run.transmittance, run.total_transmittance, run.overflow_transmittance, 0.0964896),
    ):
        theirs = np.array([float(row["MCML_sample_mco_per_mm2"]) for row in rows if row["quantity"] == kind])
        areas = (
            np.pi * 0.01 * (2.0 * np.arange(50) + 1.0)
        )  # the last ring of the table contains everything beyond
        expected = np.append(theirs * areas, published)
        computed = np.append(np.append(rings * areas[:-1], overflow), total)
        variance = expected * (1.0 - expected) * (1.0 / MCML_PHOTONS + (1.0 - run.specular) / run.photons)
        assert consistent_with_chance((computed - expected) / np.sqrt(variance))
    assert np.allclose(run.absorbed, [0.2612, 0.1488, 0.2316], atol=STANDARD_ERRORS * 6e-4)


def test_totals_of_other_runs(sample_folder: Path) -> None:
    """The totals of 38 media by another program include unscattered light."""
    deviations = []
    for row in runs(sample_folder).values():
        run = trace_slab(stack(row), 80_000)
        R = run.total_reflectance + run.unscattered_reflectance - float(row["Rd_per_incident"])
        deviations.append(R / np.hypot(run.total_reflectance_se, float(row["Rd_se"])))
        if "inf" not in row["d_mm"]:
            T = run.total_transmittance + run.unscattered_transmittance - float(row["Tt_per_incident"])
            error_density = float(row["Tt_per_incident"])
            error = np.sqrt(error_density * (1.0 - run.specular - error_density) / run.photons)
            deviations.append(T / np.hypot(error, float(row["Tt_se"])))
    assert len(deviations) > 40
    assert consistent_with_chance(np.array(deviations))


@pytest.mark.parametrize(
    ("case", "face"),
    [
        ("dj3_R_g0", "R"),
        ("dj3_B_g0.8", "R"),
        ("two_layer_g0", "R"),
        ("slab_a0.98_d2.0_n1.4_g0", "R"),
        ("slab_a0.98_d2.0_n1.4_g0", "T"),
        ("semiinf_a0.9_n1.4_g0", "R"),
    ],
)
def test_profiles_of_other_runs(sample_folder: Path, case: str, face: str) -> None:
    """All rings with at least 25 expected photons are compared."""
    data = np.load(sample_folder / "reference" / "data" / "mc_profiles.npz")
    edges, expected, their_error = (data[f"{case}/{name}"] for name in ("edges", face, f"{face}_se"))
    run = trace_slab(stack(runs(sample_folder)[case]), 1_500_000, edges_mm=edges)
    areas = np.pi * np.diff(edges**2)
    computed = run.reflectance if face == "R" else run.transmittance
    axis = run.unscattered_reflectance if face == "R" else run.unscattered_transmittance
    computed = computed + np.append(axis / areas[0], np.zeros(len(areas) - 1))
    error_density = expected * areas
    error = np.sqrt(error_density * (1.0 - run.specular - error_density) / run.photons) / areas
    full = error_density * run.photons > 25.0
    assert full.sum() > 50
    assert consistent_with_chance((computed - expected)[full] / np.hypot(error, their_error)[full])
