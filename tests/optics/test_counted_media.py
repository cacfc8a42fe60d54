"""Profiles from tables of photon counts, against new photon counts and exact totals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerances import COUNTED_FLESH, COUNTED_RINGS, COUNTED_TOTAL

from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.truths.slab_mc import monte_carlo_profile
from dermis.base.errors import DermisError
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.equivalent_medium import equivalent_medium
from dermis.optics.media import Layer, Medium, published_media
from dermis.optics.profiles import fit_profile, fit_radial, load_profile, write_profile
from dermis.optics.tissue import Tissue, load_tissue


def of(name: str, eta: float = 1.4) -> Tissue:
    return Tissue(published_media()[name].with_eta(eta))


@pytest.mark.parametrize("name", ["skin1", "skin2", "chicken1", "marble"])
def test_totals_are_those_of_h_functions(name: str) -> None:
    single = published_media()[name].layers[0].alpha_prime
    exact = [float(directional_albedo(1.0, float(one))) for one in single]
    assert of(name, 1.0).profile().total == pytest.approx(exact, rel=COUNTED_TOTAL)


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_rings_are_those_of_photons_one_by_one(eta: float) -> None:
    tissue = of("skin1", eta)
    now, table = monte_carlo_profile(tissue.medium, photons=400_000, seed=3), tissue.profile()
    assert now.standard_error is not None
    miss = np.linalg.norm(table.ring_energy - now.ring_energy, axis=0)
    assert (miss < COUNTED_RINGS * np.linalg.norm(now.ring_energy, axis=0)).all()
    significant = (now.reflectance > 10.0 * now.standard_error) & (now.reflectance > 0.0)
    channels = table.reflectance.T
    tabulated = np.stack([np.interp(now.radius_mm, table.radius_mm, one) for one in channels], axis=1)
    off = (tabulated - now.reflectance)[significant] / now.standard_error[significant]
    assert np.sqrt((off**2).mean()) < 1.5  # both have noise


def test_lengths_scale_with_the_mean_free_path() -> None:
    one = of("skin1").profile()
    layer = published_media()["skin1"].layers[0]
    dense = Tissue(Medium("dense", (Layer(10.0 * layer.sigma_a, 10.0 * layer.sigma_s_prime),))).profile()
    assert dense.total == pytest.approx(one.total)
    both = (one.radius_mm > 2e-3) & (one.radius_mm < 5.0)
    grown = [np.interp(one.radius_mm, 10.0 * dense.radius_mm, column) for column in dense.reflectance.T]
    assert 0.01 * np.stack(grown, axis=1)[both] == pytest.approx(one.reflectance[both], rel=0.01)


def test_homogeneous_media_have_them_by_default_and_no_others() -> None:
    assert load_tissue("skin1").profile().model == "counted"
    assert of("skin1", 1.0).profile().model == "counted"
    for other in (of("skin1", 1.3), load_tissue("dj3"), load_tissue("light"), load_tissue("spectralon")):
        assert other.profile().model == "layered"
        with pytest.raises(DermisError, match=r"model counted: .*one semi-infinite layer .*layered"):
            other.profile("counted")


def test_layered_diffusion_can_still_be_asked_for() -> None:
    layered, own = load_tissue("skin1").profile("layered"), diffusion_profile(published_media()["skin1"])
    assert layered.model == "layered" and (layered.reflectance == own.reflectance).all()


def test_gaussians_keep_their_light_and_tell_that_they_are_of_photons() -> None:
    radial, profile = load_tissue("skin2").profile(), load_profile("skin2")
    assert profile.from_photons and profile.albedo == pytest.approx(radial.total, rel=1e-9)
    assert not load_profile("dj3").from_photons and not load_profile("gpu-gems-3").from_photons
    own = fit_radial(radial, "skin2", similar_fit=profile)
    assert own.from_photons and own.albedo == pytest.approx(radial.total, rel=1e-9)


@pytest.mark.parametrize(("model", "counted"), [("counted", True), ("montecarlo", True), ("layered", False)])
def test_files_tell_it_too(tmp_path: Path, model: str, counted: bool) -> None:
    write_profile(tmp_path / "own.toml", load_profile("skin1"), {"model": model})
    assert load_profile(tmp_path / "own.toml").from_photons is counted


@pytest.mark.parametrize("eta", [1.0, 1.4])
@pytest.mark.parametrize("name", ["skin1", "skin2"])
def test_flesh_of_such_a_profile_is_its_medium(name: str, eta: float) -> None:
    """With the widths of diffusion, the medium would be up to two thirds denser."""
    tissue = of(name, eta)
    profile, layer = fit_profile(tissue, name), tissue.medium.layers[0]
    found = equivalent_medium(profile, profile.albedo, eta).layers[0]
    assert found.alpha_prime == pytest.approx(layer.alpha_prime, abs=0.001)
    assert found.sigma_t_prime == pytest.approx(layer.sigma_t_prime, rel=COUNTED_FLESH)
    other = equivalent_medium(replace(profile, from_photons=False), profile.albedo, eta).layers[0]
    assert (other.sigma_t_prime > 1.06 * layer.sigma_t_prime).all()
