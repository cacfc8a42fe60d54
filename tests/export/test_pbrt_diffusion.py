"""Photon beam diffusion as pbrt tabulates it."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.export.targets.pbrt.target import diffusion_table
from dermis.apps.truths.slab_mc import trace_medium
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.media import Layer, Medium

ETA = 1.4
DIFFUSION = 0.02  # of the reflectance: diffusion against Monte Carlo
BRIGHTNESS = 0.06  # relative error of the total reflectance


def test_darker_media_return_less() -> None:
    table = diffusion_table(ETA)
    assert table.reflectance[0] == 0.0 and (np.diff(table.reflectance) > 0.0).all()
    assert (np.diff(table.reflectance_within, axis=1) > -1e-5).all()


@pytest.mark.parametrize("albedo", [0.8, 0.95, 0.99])
def test_diffusion_matches_photon_counts(albedo: float) -> None:
    edges = np.array([0.0, 0.3, 1.0, 3.0, 10.0, 300.0])
    medium = Medium("test", (Layer(np.array([1.0 - albedo]), np.array([albedo])),), ETA)
    simulated = trace_medium(medium, 40_000, edges_mm=edges)[0]
    fraction = np.cumsum(simulated.reflectance * np.pi * np.diff(edges**2)) / (1.0 - normal_reflectance(ETA))
    table = diffusion_table(ETA)
    found = table.interpolate_reflectance_within(
        edges[1:], float(np.interp(albedo, table.albedo, table.reflectance))
    )
    assert found[-1] == pytest.approx(fraction[-1], rel=BRIGHTNESS)
    np.testing.assert_allclose(found / found[-1], fraction / fraction[-1], atol=DIFFUSION)
