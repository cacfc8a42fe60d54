"""A head relit from pictures of a light stage equals the head rendered in that environment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.environment.panorama import texel_directions
from dermis.frame.renderer import Renderer
from dermis.images.io import write_exr
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Camera, Environment, Scene, Settings, Skin
from dermis.scene.light_stage import light_stage, light_stage_weights

BALL = Head("ball", uv_sphere(100.0, 32, 16), Maps())
SKIN = Skin(profile="gpu-gems-3", albedo="profile", specular="none", energy="none")
SETTINGS = Settings(size=(24, 24), atlas=64, samples=1, technique="none", occlusion="none")


@pytest.mark.parametrize("degrees", [0.0, 90.0])
def test_relit_picture_equals_a_rendered_one(renderer: Renderer, tmp_path: Path, degrees: float) -> None:
    """In a sky that is brightest towards +X; the opposite rotation has ten times the error."""
    sky = (
        1.0
        + 0.9 * texel_directions(256, 512) @ np.array([[0.9, 0.3, 0.0], [0.2, 0.8, 0.0], [-0.4, 0.1, 0.9]]).T
    )
    write_exr(tmp_path / "sky.exr", sky.astype(np.float32))
    around = Environment(name=str(tmp_path / "sky.exr"), rotation_degrees=degrees)
    camera = Camera(position=(300.0, 100.0, 900.0), frame_mm=160.0, target=(0.0, 20.0, 0.0))
    lights = [light.model_copy(update={"shadows": False}) for light in light_stage(64)]
    weights = light_stage_weights(lights, around)
    relit = sum(
        weight * renderer.draw(Scene(BALL, [light], camera, SKIN), SETTINGS).linear()
        for weight, light in zip(weights, lights, strict=True)
    )
    rendered = renderer.draw(Scene(BALL, [], camera, SKIN, around), SETTINGS).linear()
    seen = rendered.sum(axis=-1) > 0
    assert seen.mean() > 0.5
    assert np.abs(relit - rendered)[seen].max() < 0.03 * rendered.max()
