"""Tabulated Monte Carlo profiles in place of layered diffusion."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import COUNTED_TOTAL

from dermis.apps.truths.half_space import directional_albedo
from dermis.apps.validation.comparisons import scenes as profile_models
from dermis.apps.validation.comparisons.scenes import ModelName, medium_scene
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import published_media

BALL = Head("ball", uv_sphere(100.0, 12, 6), Maps())
BODY = published_media()["skin1"].with_eta(1.0)


@pytest.fixture(scope="module")
def profiles() -> dict[ModelName, GaussianSum]:
    found: dict[ModelName, GaussianSum] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(profile_models, "_PHOTONS_PER_CHANNEL", 100_000)
        models: tuple[ModelName, ...] = ("layered", "montecarlo", "counted")
        for model in models:
            with medium_scene(BALL, "laser", "ear", BODY, model) as (_, found[model]):
                pass
    return found


def test_total_equals_the_half_space(profiles: dict[ModelName, GaussianSum]) -> None:
    exact = np.array([float(directional_albedo(1.0, float(one))) for one in BODY.layers[0].alpha_prime])
    error = {name: np.abs(one.albedo / exact - 1.0) for name, one in profiles.items()}
    assert (error["montecarlo"] < 0.005).all() and (error["counted"] < COUNTED_TOTAL).all()
    assert max(error["montecarlo"].mean(), error["counted"].mean()) < 0.2 * error["layered"].mean()


def test_less_light_travels_far(profiles: dict[ModelName, GaussianSum]) -> None:
    """Diffusion underestimates the light that leaves within half a mean free path."""
    near = [profiles[name] for name in ("montecarlo", "counted", "layered")]
    radius = 0.5 * BODY.layers[0].mean_free_path_mm[0]
    now, tables, layered = (
        (one.weight[:, 0] * -np.expm1(-(radius**2) / (2.0 * one.variance_mm2))).sum() / one.albedo[0]
        for one in near
    )
    assert min(now, tables) > 1.05 * layered
    assert tables == pytest.approx(now, rel=0.03)


def test_tables_are_the_default_where_available() -> None:
    with medium_scene(BALL, "laser", "ear", BODY) as (_, usual):
        assert usual.from_photons
    with medium_scene(BALL, "laser", "ear", published_media()["dj3"].with_eta(1.0)) as (_, usual):
        assert not usual.from_photons
