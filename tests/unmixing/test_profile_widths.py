"""Spatially varying profiles from maps of melanin and blood."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.apps.inverse.unmixing.profile_widths import PROFILE_GRID_CORNERS, profile_mixture, save_mixture
from dermis.apps.inverse.unmixing.skin_model import skin_model
from dermis.apps.inverse.unmixing.unmix import unmix
from dermis.base.errors import DermisError
from dermis.frame.features.diffusion.mixture import load_blend_weights
from dermis.optics.profiles import load_profile


def test_profiles_follow_melanin_and_blood(tmp_path: Path) -> None:
    m, b = (one.ravel() for one in np.meshgrid(np.geomspace(0.01, 0.1, 24), np.geomspace(0.003, 0.04, 24)))
    found = unmix(skin_model().colours(m, b).reshape(24, 24, 3), adapter="cpu")
    blend = profile_mixture(found)
    assert (blend.error < 0.5 * blend.single_error).all() and blend.error.max() < 0.12
    for corner, fraction in (((0, 0), (0, 0)), ((-1, 0), (1, 0)), ((-1, -1), (0, 1))):
        np.testing.assert_allclose(blend.weights[corner], fraction, atol=0.02)
    written = save_mixture(tmp_path, blend)
    np.testing.assert_allclose(load_blend_weights(str(written[-1])), blend.weights, atol=1e-6)
    evaluate = [load_profile(tmp_path / f"{name}.toml") for name in PROFILE_GRID_CORNERS]
    prior_sd = [(one.variance_mm2 @ (one.weight / one.albedo))[0] for one in evaluate]
    assert prior_sd[0] > prior_sd[1] > prior_sd[2]  # blood and melanin shorten the paths of red light


def test_other_profiles_have_no_widths() -> None:
    with pytest.raises(DermisError, match="no texel is like skin"):
        profile_mixture(unmix(np.zeros((4, 4, 3)), adapter="cpu"))
