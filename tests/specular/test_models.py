"""Specular models compared with published numbers and with physical laws."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import PUBLISHED, RECIPROCAL

from dermis.base import citations as cite
from dermis.specular.beckmann import beckmann
from dermis.specular.comparison import normal_incidence_peak, reciprocity_error
from dermis.specular.cosines import Cosines, cosines
from dermis.specular.fresnel import ENERGY_SCHEMES, FRESNEL, SKIN_F0, schlick
from dermis.specular.models import MODELS, EnergyConservationName, FresnelName
from dermis.specular.torrance_sparrow import smith_masking
from dermis.specular.two_lobe import NARROW_FACTOR, WIDE_FACTOR, two_lobe_masking

Floats = NDArray[np.float64]
Z = np.array([0.0, 0.0, 1.0])
# Columns of the reference samples: Kelemen's is without the 1/pi.
COLUMNS = {
    "kelemen": (4, np.pi),
    "torrance-sparrow": (5, 1.0),
    "torrance-sparrow-smith": (6, 1.0),
    "blinn-phong": (7, 1.0),
}


def towards(theta: Floats, phi: Floats) -> Floats:
    """Return unit vectors (n, 3) from angles to +Z and azimuths [degrees]."""
    t, p = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


def test_names_are_the_same_everywhere_and_in_one_order() -> None:
    assert get_args(FresnelName) == tuple(FRESNEL)
    assert get_args(EnergyConservationName) == tuple(ENERGY_SCHEMES)


@pytest.mark.parametrize("name", MODELS)
def test_sources_are_in_the_bibliography(name: str) -> None:
    assert MODELS[name].sources and set(MODELS[name].sources) <= cite.citation_keys()


@pytest.mark.parametrize("m", [0.1, 0.2, 0.3, 0.4, 0.5])
@pytest.mark.parametrize("name", COLUMNS)
def test_lobe_is_the_reference_lobe(sample_folder: Path, name: str, m: float) -> None:
    path = sample_folder / "reference" / "data" / "specular_brdf_samples.csv"
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    rows = rows[rows[:, 0] == m]
    assert len(rows) > 20
    light, view = towards(rows[:, 1], 0 * rows[:, 1]), towards(rows[:, 2], rows[:, 3])
    column, factor = COLUMNS[name]
    made = factor * MODELS[name].lobe(cosines(Z, light, view), m)
    assert np.allclose(made, rows[:, column], rtol=PUBLISHED, atol=1e-30)


@pytest.mark.parametrize("name", MODELS)
def test_models_stated_reciprocal_are_reciprocal(name: str) -> None:
    """Check reciprocity; the plain highlights are not reciprocal."""
    error = reciprocity_error(name)
    assert error < RECIPROCAL if MODELS[name].reciprocal else error > 0.1
    assert MODELS[name].reciprocal or "not reciprocal" in MODELS[name].note


@pytest.mark.parametrize("m", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("name", MODELS)
def test_lobe_is_finite_not_negative_and_ends_at_the_horizon(name: str, m: float) -> None:
    rng = np.random.default_rng(5)
    light, view = (towards(rng.uniform(0, 90, 500), rng.uniform(0, 360, 500)) for _ in range(2))
    lobe = MODELS[name].lobe(cosines(Z, light, view), m)
    assert np.isfinite(lobe).all() and (lobe >= 0).all() and lobe.any()
    below, above = towards(np.array([91.0, 120, 179]), np.array([0.0, 90, 0])), towards(np.full(3, 30.0), 0.0)
    assert not MODELS[name].lobe(cosines(Z, below, above), m).any()
    assert not MODELS[name].lobe(cosines(Z, above, below), m).any()


@pytest.mark.parametrize("name", MODELS)
def test_roughness_may_differ_from_point_to_point(name: str) -> None:
    m = np.array([0.1, 0.3, 0.7])
    light, view = towards(np.full(3, 20.0), np.zeros(3)), towards(np.full(3, 35.0), np.full(3, 170.0))
    together = MODELS[name].lobe(cosines(Z, light, view), m)
    apart = [float(MODELS[name].lobe(cosines(Z, light[k], view[k]), m[k])) for k in range(3)]
    assert together == pytest.approx(apart, rel=1e-14)


@pytest.mark.parametrize("m", [0.1, 0.3, 0.5])
def test_peaks_match_the_reference(m: float) -> None:
    """Compare with F0 / (4 pi m^2) of Beckmann lobes and equally wide powers; two lobes mix theirs."""
    one = SKIN_F0 / (4 * np.pi * m**2)
    for name in ("kelemen", "torrance-sparrow", "torrance-sparrow-smith", "blinn-phong"):
        assert normal_incidence_peak(name, m) == pytest.approx(one, rel=1e-9)
    two = 0.85 / max(NARROW_FACTOR, 0.05 / m) ** 2 + 0.15 / min(WIDE_FACTOR, 1 / m) ** 2
    assert normal_incidence_peak("two-lobe", m) == pytest.approx(one * two, rel=1e-9)


def test_models_agree_about_narrow_lobes_that_meet_at_a_small_angle() -> None:
    """Compare near the normal, where masking and the length of the half vector do not matter."""
    angles = cosines(Z, towards(np.array([8.0]), np.zeros(1)), towards(np.array([8.0]), np.array([175.0])))
    lobes = [MODELS[name].lobe(angles, 0.1) for name in COLUMNS]
    assert np.ptp(lobes) < 0.03 * np.max(lobes)


def test_smith_masking_at_its_limits() -> None:
    cosine = np.linspace(0.01, 1.0, 200)
    seen = smith_masking(cosine, 0.4)
    assert (np.diff(seen) >= 0).all() and seen[-1] == 1.0
    # nearly level views see 2 a sqrt(pi) of the facets, a = cot(theta) / m
    assert smith_masking(1e-4, 0.4) == pytest.approx(2 * np.sqrt(np.pi) * 1e-4 / 0.4, rel=1e-3)


@pytest.mark.parametrize("degrees", [30.0, 70.0, 85.0])
def test_visible_facets_project_to_the_surface_area(degrees: float) -> None:
    """Check that projected areas of visible facets sum to cos theta."""
    m, step = 0.3, np.pi / 400
    theta, phi = np.meshgrid(step * (np.arange(200) + 0.5), step * np.arange(800))
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    facing = sine * np.sin(theta) * np.cos(phi) + cosine * np.cos(theta)
    kinds = ((0.85, NARROW_FACTOR * m), (0.15, WIDE_FACTOR * m))
    slopes = sum(share * beckmann(np.cos(theta), rough) / np.pi for share, rough in kinds)
    areas = (slopes * np.maximum(facing, 0) * np.sin(theta)).sum() * step**2
    assert areas * two_lobe_masking(cosine, m) == pytest.approx(cosine, rel=1e-3)


def test_equal_two_lobes_reduce_to_torrance_sparrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.specular.two_lobe.NARROW_FACTOR", 1.0)
    monkeypatch.setattr("dermis.specular.two_lobe.WIDE_FACTOR", 1.0)
    angles = cosines(Z, towards(np.array([75.0]), np.zeros(1)), towards(np.array([60.0]), np.array([170.0])))
    one, other = (MODELS[name].lobe(angles, 0.3) for name in ("two-lobe", "torrance-sparrow-smith"))
    assert one == pytest.approx(other, rel=1e-12)


def test_each_model_uses_its_reflectance() -> None:
    angles = cosines(Z, towards(np.array([40.0]), np.zeros(1)), towards(np.array([50.0]), np.array([170.0])))
    for name, model in MODELS.items():
        twice = model.lobe(angles, 0.3, lambda cosine: 2.0 * schlick(cosine))
        assert twice == pytest.approx(2.0 * model.lobe(angles, 0.3), rel=1e-14), name


def test_cosines_of_opposite_directions_are_finite() -> None:
    angles = cosines(Z, Z, -Z)
    assert isinstance(angles, Cosines) and np.isfinite([angles.n_h, angles.v_h]).all()
