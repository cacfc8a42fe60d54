"""Interreflection: an integrating sphere, a white corner in a furnace, and the passes that run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hinged import FOOT_MM, corner
from setups import entered_light, front_camera, frontal, head_of, place, run_frame, scene_of
from tolerances import FURNACE_OF_LINKS, INTEGRATING_SPHERE
from twins import surface

from dermis.atlas.build import cached_atlas
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.lights import PointLight

pytestmark = pytest.mark.usefixtures("many_form_factor_lines")

SIDE = 64


@pytest.mark.parametrize("albedo", [0.3, 0.6])
def test_integrating_sphere_matches_its_closed_form(renderer: Renderer, albedo: float) -> None:
    """Bounces add albedo / (1 - albedo) times the direct light."""
    ball = uv_sphere(40.0, 48, 24)
    within = replace(ball, normals=-ball.normals, triangles=np.ascontiguousarray(ball.triangles[:, ::-1]))
    head = head_of(within, colour=np.full((4, 4, 3), albedo))
    middle = place(head, (0, 0, 0))
    lamp = PointLight(position=middle, target=(0, 0, 50), irradiance=(3.0, 3.0, 3.0), shadows=False)
    scene = scene_of(head, lamp, rho_s=0.0)
    shown = cached_atlas(within, SIDE).lit_mask
    straight, all_of_it = (
        entered_light(renderer, run_frame(renderer, scene, atlas=SIDE, interreflection=on))[shown][:, :3]
        for on in (False, True)
    )
    by_bounces = all_of_it / straight - 1.0
    assert np.abs(by_bounces * (1.0 - albedo) / albedo - 1.0).max() < INTEGRATING_SPHERE[albedo]


@pytest.mark.parametrize("direction", ["lambertian", "half-space"])
def test_white_corner_passes_the_furnace_test(renderer: Renderer, direction: str) -> None:
    """The light of the wall replaces the uniform light that it hides."""
    head = corner(colour=np.ones((4, 4, 3)))
    scene = replace(scene_of(head, rho_s=0.0, direction=direction), environment=Environment(name="uniform"))
    points, normals = surface(cached_atlas(head.mesh, SIDE), head)
    floor = (normals[..., 2] > 0.9) & (np.abs(points[..., 1]) < 50.0)
    beside = floor & (points[..., 0] < FOOT_MM + 30.0)
    made = run_frame(renderer, scene, atlas=SIDE, transmission="none")
    light = entered_light(renderer, made)[..., :3]
    shares = light[beside] / light[floor & (points[..., 0] > 60.0)].mean(axis=0)
    assert beside.sum() > 50
    assert abs(shares.mean() - 1.0) < FURNACE_OF_LINKS
    assert np.abs(shares - 1.0).max() < 6.0 * FURNACE_OF_LINKS  # cells are met by few lines


def test_camera_change_does_not_recompute_interreflection(renderer: Renderer) -> None:
    head = corner()
    run_frame(renderer, scene_of(head, frontal()), atlas=SIDE)
    assert "interreflection" in renderer.graph.executed_stages
    run_frame(renderer, scene_of(head, frontal(), camera=front_camera(head, frame_mm=150.0)), atlas=SIDE)
    assert "interreflection" not in renderer.graph.executed_stages
    run_frame(renderer, scene_of(head, frontal(2.0)), atlas=SIDE)
    assert "interreflection" in renderer.graph.executed_stages
