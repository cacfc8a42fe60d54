"""Frames with screen-space scattering."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, place, run_frame, scene_of
from tolerances import TWIN

from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene import Scene
from dermis.scene.lights import DirectionalLight, StripeLight

Floats = NDArray[np.float64]
BALL = head_of(uv_sphere(30.0, 48, 24))
SIDE_LIGHT = DirectionalLight(direction=(-2, -1, -1), irradiance=(3.0, 2.0, 1.0), shadows=False)


def image(renderer: Renderer, scene: Scene, technique: str, **settings: Any) -> Floats:
    inputs = run_frame(renderer, scene, **({"size": (64, 64)} | settings), technique=technique)
    return download(renderer.device, inputs.resources.post.picture.exposed).astype(float)


def narrow(folder: Path) -> str:
    """Return a profile that scatters light by 10 micrometres, less than any pixel here."""
    path = folder / "narrow.csv"
    path.write_text("variance_mm2,red,green,blue\n0.0001,0.9,0.8,0.7\n")
    return str(path)


@pytest.mark.parametrize("albedo", ["map", "profile"])
@pytest.mark.parametrize("samples", [1, 4])
def test_profile_without_spread_equals_unblurred_skin(
    renderer: Renderer, tmp_path: Path, samples: int, albedo: str
) -> None:
    """Light that is separated and recombined equals dry skin; colour is applied once."""
    scene = scene_of(BALL, SIDE_LIGHT, camera=front_camera(BALL), profile=narrow(tmp_path), albedo=albedo)
    dry, apart = (
        image(renderer, scene, technique, samples=samples, background=(0.2, 0.4, 0.1))
        for technique in ("none", "screen-space")
    )
    assert np.abs(apart - dry).max() < 10 * TWIN * dry.max()


def test_uniform_light_equals_unblurred_skin(renderer: Renderer) -> None:
    head = head_of(plane(100.0), colour=np.broadcast_to([0.5, 0.25, 0.75], (8, 8, 3)))
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=50.0), roughness=0.5, mix=0.3)
    dry, spread = (image(renderer, scene, technique) for technique in ("none", "screen-space"))
    # What enters depends on the angle a little, and so spreads.
    assert np.abs(spread - dry).max() < 1e-3 * dry.max()


def test_energy_on_a_ball(renderer: Renderer) -> None:
    """Light crosses the terminator, and hardly any is lost over the limb."""
    scene = scene_of(BALL, SIDE_LIGHT, camera=front_camera(BALL), rho_s=0.0, energy="none")
    dry, spread = (image(renderer, scene, t, size=(128, 128))[..., :3] for t in ("none", "screen-space"))
    assert np.abs(spread.sum(axis=(0, 1)) / dry.sum(axis=(0, 1)) - 1).max() < 0.01
    dark = (dry.sum(axis=-1) == 0) & (spread.sum(axis=-1) > 0)
    assert dark.sum() > 100
    assert spread[dark][:, 0].mean() > 5 * spread[dark][:, 2].mean()  # it is red


def test_plain_materials_stay_as_they_are(renderer: Renderer) -> None:
    """An eye beside skin, lit from the side: neither receives light of the other."""
    mesh = joined(
        (plane(40.0), (-20, 0, 0), (0, 0, 0.5)),
        (plane(40.0), (20, 0, 0), (0.5, 0.5, 0.5)),
        kinds=["skin", "opaque"],
    )
    head = head_of(mesh)
    scene = scene_of(head, SIDE_LIGHT, camera=front_camera(head, frame_mm=30.0))
    dry, spread = (image(renderer, scene, technique) for technique in ("none", "screen-space"))
    assert np.abs(spread - dry)[:, 33:].max() < TWIN * dry.max()
    assert np.abs(spread - dry)[:, :31].max() < 0.01 * dry.max()


def test_lit_plate_does_not_bleed_onto_a_shaded_wall(renderer: Renderer) -> None:
    """Dark skin behind lit skin: no light leaks over the antialiased edge."""
    mesh = joined((plane(40.0), (-20, 0, 30), (0, 0, 0.5)), (plane(200.0), (0, 0, 0), (0.5, 0.5, 0.5)))
    head = head_of(mesh)
    # From the left, rising: the plate's shadow falls on the wall to the right of its edge.
    light = DirectionalLight(direction=(1, 0, -1), irradiance=(3.0,) * 3, softness_mm=0.1)
    scene = scene_of(head, light, camera=front_camera(head, (0, 0, 30), frame_mm=40.0))
    dry, spread = (
        image(renderer, scene, technique, samples=4, shadow_size=1024)
        for technique in ("none", "screen-space")
    )
    row = slice(24, 40)
    shaded = slice(36, 44)
    assert dry[row, 8:24, 0].min() > 0.1 and dry[row, shaded, :3].max() < 1e-3
    assert spread[row, shaded, :3].max() < 1e-3
    assert np.abs(spread - dry)[row, 8:24, :3].max() < 0.01 * dry.max()


def test_step_within_a_pixel_leaves_no_dark_line(renderer: Renderer) -> None:
    """A step of a millimetre in skin beside a stripe of light is no dark line."""
    mesh = joined((plane(40.0), (-20, 0, 1), (0, 0, 0.5)), (plane(200.0), (0, 0, 0), (0.5, 0.5, 0.5)))
    head = head_of(mesh)
    beside = place(head, (-3, 0, 1))
    stripe = StripeLight(direction=(0, 0, -1), position=beside, width_mm=3.0, irradiance=(90.0,) * 3)
    camera = front_camera(head, (0.02, 0, 1), frame_mm=10.0)
    scene = scene_of(head, stripe, camera=camera, specular="none", energy="none")
    dry, spread = (
        image(renderer, scene, technique, samples=4)[32, :, 0] for technique in ("none", "screen-space")
    )
    assert dry[31] < 1e-3 * dry.max()
    assert spread[31] > 0.95 * 0.5 * (spread[30] + spread[32])
