"""Multipole: supplied tables, the series against its closed form, limits, and thin layers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slabs import slab, table
from tolerances import CLOSED_FORM

from dermis.optics.diffusion import dipole, hankel, multipole
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.diffusion.multipole import Slab
from dermis.optics.media import Layer, Medium
from dermis.optics.radial import enclosed_energy, resample_profile

A = boundary_mismatch(1.4, "exact")


def of(medium: Medium, clamp: multipole.SourceDepthClamp = "layer") -> Slab:
    return Slab(medium.layers[0], A, A, clamp)


def totals(one: Slab) -> tuple[float, float]:
    R, T = (
        f(hankel.NEAR_ZERO_FREQUENCY, one)
        for f in (multipole.reflectance_hankel, multipole.transmittance_hankel)
    )
    return float(R[0, 0]), float(T[0, 0])


@pytest.mark.parametrize(
    ("name", "layer"),
    [
        ("slab_2mm", Layer(np.array([0.1]), np.array([1.0]), 2.0)),
        ("slab_5mm", Layer(np.array([0.02]), np.array([0.98]), 5.0)),
    ],
)
def test_profiles_of_the_table(sample_folder: Path, name: str, layer: Layer) -> None:
    rows = table(sample_folder, "diffusion_profiles.csv")
    own = rows[(rows["case"] == name) & (rows["r_mm"] > 0.0)]
    one = Slab(layer, A, A)
    R = multipole.reflectance(own["r_mm"], one)[:, 0]
    T = multipole.transmittance(own["r_mm"], one)[:, 0]
    seen = own["r_mm"] < 30.0
    assert np.allclose(R[seen], own["R_DJ_or_dipole_A_exact"][seen], rtol=CLOSED_FORM, atol=1e-13)
    assert np.allclose(T[seen], own["T_DJ_A_exact"][seen], rtol=CLOSED_FORM, atol=1e-13)


@pytest.mark.parametrize(
    ("thickness", "clamp"), [(0.3, "none"), (1.2, "none"), (1.2, "layer"), (4.0, "layer")]
)
def test_series_is_the_inverse_of_the_closed_sum(thickness: float, clamp: multipole.SourceDepthClamp) -> None:
    one = of(slab(0.95, thickness), clamp)
    r = np.geomspace(0.02, 8.0, 30)
    for series, closed in (
        (multipole.reflectance, multipole.reflectance_hankel),
        (multipole.transmittance, multipole.transmittance_hankel),
    ):
        exact = series(r, one)
        inverse = resample_profile(
            r, hankel.transform_radii(), hankel.inverse_transform(closed(hankel.transform_frequencies(), one))
        )
        assert np.allclose(inverse, exact, rtol=1e-5, atol=1e-7 * np.abs(exact).max())


def test_images_left_out_are_under_the_bound() -> None:
    one = of(slab(0.99, 2.0))
    grid = np.geomspace(1e-5, 1e3, 3000)
    for tolerance in (1e-2, 1e-4):
        kept = enclosed_energy(grid[-1:], grid, multipole.reflectance(grid, one, tolerance))[0]
        assert kept == pytest.approx(
            multipole.reflectance_hankel(hankel.NEAR_ZERO_FREQUENCY, one)[0], abs=2 * tolerance
        )


def test_without_absorption_all_light_leaves_one_face_or_the_other() -> None:
    one = of(slab(1.0, 3.0))
    R, T = (
        f(hankel.NEAR_ZERO_FREQUENCY, one)[0, 0]
        for f in (multipole.reflectance_hankel, multipole.transmittance_hankel)
    )
    assert abs(1.0 - R - T) < 1e-7
    r = np.geomspace(1e-4, 300.0, 2000)
    within = enclosed_energy(r[-1:], r, multipole.reflectance(r, one))[0, 0]
    assert within == pytest.approx(R, rel=2e-3)  # the tail beyond 300 mm, and images beyond the last


def test_thick_slab_is_the_dipole() -> None:
    deep, endless = of(slab(0.9, 60.0)), of(slab(0.9))
    r = np.geomspace(0.01, 10.0, 40)
    assert np.allclose(multipole.reflectance(r, deep), dipole.reflectance(r, endless.layer, A), rtol=1e-9)
    assert np.array_equal(multipole.reflectance(r, endless), dipole.reflectance(r, endless.layer, A))
    assert not multipole.transmittance(r, endless).any()


def test_printed_source_leaves_a_thin_slab_and_the_clamped_one_does_not() -> None:
    """A source below the slab makes its transmittance negative."""
    thin = slab(0.98, 0.5)
    lost = multipole.transmittance_hankel(hankel.NEAR_ZERO_FREQUENCY, of(thin, "none"))[0, 0]
    kept = multipole.transmittance_hankel(hankel.NEAR_ZERO_FREQUENCY, of(thin, "layer"))[0, 0]
    assert lost < 0.0 < kept < 1.0


@pytest.mark.parametrize("thickness", [2.0, 5.0, 10.0])
def test_slabs_of_monte_carlo(sample_folder: Path, thickness: float) -> None:
    """The known error of the diffuse part is 10 % at a reduced albedo of 0.98 and two mean free paths."""
    runs = table(sample_folder, "mc_totals.csv")
    run = runs[runs["case"] == f"slab_a0.98_d{thickness:.1f}_n1.4_g0"][0]
    one = of(slab(0.98, thickness))
    entering = 1.0 - run["Rsp"]
    R, T = (
        f(hankel.NEAR_ZERO_FREQUENCY, one)[0, 0]
        for f in (multipole.reflectance_hankel, multipole.transmittance_hankel)
    )
    assert entering * R == pytest.approx(run["Rd_per_incident"], rel=0.10)
    all_through = entering * (T + np.exp(-thickness))
    assert all_through == pytest.approx(run["Tt_per_incident"], rel=0.25)


def test_asymmetric_faces_turn_with_the_slab() -> None:
    one = Slab(Layer(np.array([0.1]), np.array([0.9]), 2.0), A, 1.0)
    assert one.upside_down().upside_down() == one
    up, down = (
        multipole.transmittance_hankel(hankel.NEAR_ZERO_FREQUENCY, s)[0, 0] for s in (one, one.upside_down())
    )
    assert up != pytest.approx(down, rel=1e-3)
