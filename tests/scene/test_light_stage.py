"""Light stage: uniform lights, and weights that reproduce an environment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.environment.panorama import texel_solid_angles
from dermis.images.io import write_exr
from dermis.scene.environment import Environment
from dermis.scene.light_stage import light_stage, light_stage_weights


def test_lights_are_distributed_evenly() -> None:
    places = -np.array([light.direction for light in light_stage(200)])
    assert np.allclose(np.linalg.norm(places, axis=1), 1.0)
    assert np.abs(places.mean(axis=0)).max() < 0.01
    assert np.allclose(places.T @ places / 200, np.eye(3) / 3, atol=0.01)


def test_weights_match_the_rotated_environment(tmp_path: Path) -> None:
    """Check the total irradiance, and that most of it comes from the rotated bright spot."""
    sky = np.full((256, 512, 3), 0.1, np.float32)
    sky[128, 384] = (900.0, 600.0, 300.0)  # towards +X
    write_exr(tmp_path / "spot.exr", sky)
    around = Environment(name=str(tmp_path / "spot.exr"), rotation_degrees=90.0, exposure=2.0)
    lights = light_stage(32)
    weights = light_stage_weights(lights, around)
    assert np.allclose(
        weights.sum(axis=0), 2.0 * (sky * texel_solid_angles(256, 512)[..., None]).sum(axis=(0, 1))
    )
    brightest = -np.array(lights[int(weights[:, 0].argmax())].direction)
    assert brightest @ (0.0, 0.0, -1.0) > 0.9  # counter-clockwise seen from above


def test_less_than_one_light_is_refused() -> None:
    with pytest.raises(DermisError, match="light stage: expected a whole number from 1"):
        light_stage(0)
