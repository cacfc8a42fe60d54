"""Mitsuba's scene against the renderer: the same pixels show the same light on the same head."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from lit_balls import COLOUR, DRY, LIGHTS, ball_scene
from numpy.typing import NDArray

from dermis.apps.truths.path_traced import Lambertian, PathTraced, path_trace
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.optics.profiles import load_profile
from dermis.scene.camera import Camera, portrait
from dermis.scene.environment import Environment
from dermis.scene.heads import load_head
from dermis.scene.lights import PointLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

pytest.importorskip("mitsuba")


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


def both(renderer: Renderer, scene: Scene, samples: int, **given: Any) -> tuple[NDArray[Any], PathTraced]:
    """Return an image without scattering by the renderer, and the same by Mitsuba."""
    settings = Settings(**({"atlas": 64, "samples": 16, "technique": "none", "shadow_size": 4096} | given))
    dry = renderer.draw(scene, settings).linear().astype(np.float64)
    albedo = tuple(load_profile(scene.skin.profile).weight.sum(axis=0).tolist())
    return dry, path_trace(scene, Lambertian(albedo), samples, settings)


def error_of(dry: NDArray[Any], reference: PathTraced) -> tuple[float, float]:
    """Return the relative RMSE over covered pixels without the reference's noise, and the energy ratio."""
    whole = reference.mask > 0.999
    image, noise = (
        reference.image[whole].astype(np.float64),
        reference.variance[whole].astype(np.float64).mean(),
    )
    squared = np.mean((dry[whole] - image) ** 2) - noise
    return float(np.sqrt(max(squared, 0.0) / (np.mean(image**2) - noise))), float(
        dry[whole].sum() / image.sum()
    )


@pytest.mark.parametrize("kind", LIGHTS)
def test_lights_match_the_renderer(renderer: Renderer, kind: str) -> None:
    error, energy = error_of(*both(renderer, ball_scene(LIGHTS[kind]), 64, size=(96, 96)))
    assert error < 0.01
    assert energy == pytest.approx(1.0, abs=0.005)


def test_uniform_light_matches_the_renderer(renderer: Renderer) -> None:
    scene = ball_scene(environment=Environment(name="uniform", exposure=2.0))
    error, energy = error_of(*both(renderer, scene, 128, size=(64, 64), occlusion="none"))
    assert error < 0.01
    assert energy == pytest.approx(1.0, abs=0.005)


@pytest.mark.samples
@pytest.mark.parametrize("degrees", [0.0, 70.0])
def test_environment_rotation_matches_the_renderer(renderer: Renderer, degrees: float) -> None:
    around = Environment(name="lebombo", rotation_degrees=degrees)
    error, energy = error_of(
        *both(renderer, ball_scene(environment=around), 256, size=(64, 64), occlusion="none")
    )
    assert error < 0.01
    assert energy == pytest.approx(1.0, abs=0.005)


@pytest.fixture(scope="module")
def scan(sample_folder: Any) -> Head:
    head = load_head("lee_perry_smith", subdivide=1)
    return Head(head.name, head.mesh, Maps())


@pytest.mark.parametrize("position", [(60, 60, 1100), (-450, 400, 1000)])
def test_lit_scan_matches_the_renderer(
    renderer: Renderer, scan: Head, position: tuple[float, float, float]
) -> None:
    light = PointLight(position=position, irradiance=COLOUR, softness_mm=0.3)
    scene = Scene(scan, lights=(light,), camera=portrait(scan), skin=DRY)
    straight = {"interreflection": False, "shadow_size": 8192}  # as in the reference
    error, energy = error_of(*both(renderer, scene, 64, size=(128, 128), **straight))
    assert error < 0.01
    assert energy == pytest.approx(1.0, abs=0.003)


def coverage(renderer: Renderer, scene: Scene, settings: Settings) -> NDArray[np.float64]:
    black, white = (
        renderer.draw(scene, settings.model_copy(update={"background": (one,) * 3})).linear()[..., 0]
        for one in (0.0, 1.0)
    )
    return 1.0 - (white.astype(np.float64) - black)


def shift_between(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shift of an image to the right of and below another, by least squares [pixel]."""
    down, right = np.gradient(ours)
    slopes = np.column_stack((right.ravel(), down.ravel()))
    return -np.linalg.lstsq(slopes, (theirs - ours).ravel(), rcond=None)[0]


@pytest.mark.samples
@pytest.mark.parametrize("turned", [False, True])
def test_pixels_match_the_renderer(renderer: Renderer, scan: Head, turned: bool) -> None:
    camera = portrait(scan)
    if turned:
        camera = Camera(position=(700, 500, 300), target=(20, -40, 10), up=(0.4, 1, 0.1), frame_mm=300.0)
    scene = Scene(scan, lights=(PointLight(position=(0, 0, 900)),), camera=camera, skin=DRY)
    settings = Settings(size=(160, 112), atlas=64, samples=32, technique="none")
    ours = coverage(renderer, scene, settings)
    theirs = path_trace(scene, Lambertian((1, 1, 1)), 8, settings).mask.astype(np.float64)
    # In all four quadrants, which shows differences of scale and rotation too.
    for rows in (slice(0, 56), slice(56, 112)):
        for columns in (slice(0, 80), slice(80, 160)):
            assert np.abs(shift_between(ours[rows, columns], theirs[rows, columns])).max() < 0.03
    assert np.sqrt(np.mean((ours - theirs) ** 2)) < 0.02
