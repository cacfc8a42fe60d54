"""Skin with a directional response, against closed forms and energy conservation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from setups import frontal, head_of, place, probe, run_frame, scene_of
from tolerances import TWIN

from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.gpu.textures import texture_from_array
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.angular_response import (
    DIRECTION_ROWS,
    angular_response,
    mean_single_scattering_kernel,
    refracted_cosine,
)
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import write_profile
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight, SpotLight
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
FLAT, BALL = head_of(plane(100.0)), head_of(uv_sphere(30.0, 64, 32))
COLOUR = np.array([146.0, 84.0, 51.0]) / 256.0
DRY = {"specular": "none", "energy": "none"}
ASLANT = 72.0
LIGHT = DirectionalLight(direction=(1.0, 0.5, -0.6), irradiance=(3.0, 2.0, 1.0), shadows=False)


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a file of a profile with a colour."""
    path = tmp_path_factory.mktemp("profile") / "own.toml"
    weight = np.outer([0.4, 0.6], COLOUR)
    write_profile(path, GaussianSum("own", np.array([0.005, 0.4]), weight), {})
    return str(path)


def seen_from(degrees: float) -> Camera:
    """Return a camera far away, so that the whole picture is seen from one direction."""
    angle = np.radians(degrees)
    eye = 3e4 * np.array([np.sin(angle), 0.0, np.cos(angle)])
    return Camera(position=place(FLAT, eye), target=place(FLAT, (0, 0, 0)), frame_mm=4.0)


def middle(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    inputs = run_frame(renderer, scene, **({"size": (9, 9), "atlas": 64} | settings))
    return download(renderer.device, inputs.resources.post.picture.exposed)[4, 4, :3].astype(float)


def law(cosine_in: float, cosine_out: float, eta: float, colour: Floats = COLOUR) -> Floats:
    """Return the response between two directions over the mean response at normal incidence."""
    told = angular_response(colour, eta)
    rows = np.linspace(0.0, 1.0, DIRECTION_ROWS)
    back = np.array([np.interp(np.sqrt(cosine_in), rows, told.relative_reflectance[:, c]) for c in range(3)])
    a, b = (np.sqrt(1.0 - (1.0 - c**2) / eta**2) for c in (cosine_in, cosine_out))
    return np.asarray(
        back + told.single_scattering * (1.0 / (a + b) - mean_single_scattering_kernel(cosine_in, eta))
    )


@pytest.mark.parametrize("surface", [DRY, {}], ids=["matched", "refracting"])
def test_angular_response_matches_the_law_for_all_directions(renderer: Renderer, surface: Any) -> None:
    """The response is finite for grazing entry and exit."""
    eta = 1.0 if surface else 1.4
    cosines = np.concatenate([[0.0, 1e-7, 1e-4, 3e-3], np.linspace(0.01, 1.0, 12)])
    pairs = np.stack([*np.meshgrid(cosines, cosines), *np.zeros((2, 16, 16))], axis=-1)
    turned = scene_of(
        head_of(plane(100.0), colour=np.tile(COLOUR, (8, 8, 1))), direction="half-space", **surface
    )
    bound = run_frame(renderer, turned, technique="none").bindings
    bound |= {"cosines": texture_from_array(renderer.device, pairs.astype(np.float32), "rgba32float")}
    back, beyond, around = (
        made[..., :3]
        for made in probe(renderer.device, "direction_probe", (16, 16), ["back", "beyond", "around"], **bound)
    )
    told = angular_response(COLOUR, eta)
    a, b = (np.maximum(refracted_cosine(pairs[..., k], eta), 1e-4) for k in (0, 1))
    rows, place = np.linspace(0.0, 1.0, DIRECTION_ROWS), np.sqrt(pairs[..., 0])
    expected = np.stack([np.interp(place, rows, told.relative_reflectance[:, c]) for c in range(3)], axis=-1)
    np.testing.assert_allclose(back, expected, rtol=1e-4)
    expected = (
        told.single_scattering
        * (1.0 / (a + b) - mean_single_scattering_kernel(pairs[..., 0], eta))[..., None]
    )
    np.testing.assert_allclose(beyond, expected, rtol=1e-2, atol=2e-3)  # floats round cosines near 0
    expected = (
        told.single_scattering
        * (mean_single_scattering_kernel(pairs[..., 1], eta) - told.mean_kernel)[..., None]
    )
    np.testing.assert_allclose(around, expected, atol=2e-3)


@pytest.mark.parametrize("technique", ["none", "texture-space", "screen-space"])
@pytest.mark.parametrize("surface", [DRY, {"roughness": 0.5, "rho_s": 0.4}], ids=["matched", "refracting"])
def test_uniform_light_on_a_plane_matches_the_law(
    renderer: Renderer, close: float, profile: str, surface: Any, technique: str
) -> None:
    """Compare at oblique view and light, without specular reflection."""
    scene = scene_of(FLAT, LIGHT, camera=seen_from(ASLANT), profile=profile, albedo="profile", **surface)
    turned = replace(scene, skin=scene.skin.model_copy(update={"direction": "half-space"}))
    made, plain = (middle(renderer, one, technique=technique, parts="diffuse") for one in (turned, scene))
    cosine = 0.6 / float(np.linalg.norm(LIGHT.direction))
    told = law(cosine, float(np.cos(np.radians(ASLANT))), 1.0 if surface is DRY else 1.4)
    np.testing.assert_allclose(made / plain, told, atol=3 * (TWIN if technique == "none" else close))
    assert np.abs(told - 1.0).max() > 0.1


def test_a_colour_map_counts_by_its_mean(renderer: Renderer) -> None:
    """Texels outside charts are black, and do not count."""
    colour = np.zeros((64, 64, 3))
    colour[:48] = [0.5, 0.25, 0.75]
    scene = scene_of(head_of(plane(100.0), colour=colour), LIGHT, camera=seen_from(ASLANT))
    turned = replace(scene, skin=scene.skin.model_copy(update={"direction": "half-space"}))
    made, plain = (middle(renderer, one, technique="none", parts="diffuse") for one in (turned, scene))
    cosine = 0.6 / float(np.linalg.norm(LIGHT.direction))
    told = law(cosine, float(np.cos(np.radians(ASLANT))), 1.4, colour[0, 0])
    np.testing.assert_allclose(made / plain, told, atol=3 * TWIN)


@pytest.mark.parametrize("technique", ["none", "texture-space", "pre-integrated"])
def test_uniform_environment_matches_the_law(renderer: Renderer, profile: str, technique: str) -> None:
    """A matched half-space under uniform light returns the light that enters it."""
    room, told = Environment(name="uniform"), angular_response(COLOUR, 1.0)
    for degrees in (10.0, 80.0):
        scene = scene_of(
            FLAT,
            camera=seen_from(degrees),
            profile=profile,
            albedo="profile",
            direction="half-space",
            **DRY,
        )
        made = middle(renderer, replace(scene, lights=(), environment=room), technique=technique)
        expected = told.relative_diffuse_reflectance + told.single_scattering * (
            mean_single_scattering_kernel(np.cos(np.radians(degrees)), 1.0) - told.mean_kernel
        )
        np.testing.assert_allclose(made, COLOUR * expected, rtol=2e-3)


def test_angular_response_integrates_to_the_albedo(renderer: Renderer, profile: str) -> None:
    angles = np.degrees(np.arccos(np.sqrt((np.arange(12) + 0.5) / 12)))
    for direction, expected in (
        ("lambertian", 1.0),
        ("half-space", angular_response(COLOUR, 1.0).relative_reflectance[-1]),
    ):
        seen = [
            middle(
                renderer,
                scene_of(
                    FLAT,
                    frontal(np.pi),
                    camera=seen_from(degrees),
                    profile=profile,
                    albedo="profile",
                    direction=direction,
                    **DRY,
                ),
            )
            for degrees in angles
        ]
        np.testing.assert_allclose(np.mean(seen, axis=0), COLOUR * expected, rtol=3e-3)


@pytest.mark.parametrize("technique", ["texture-space", "screen-space", "pre-integrated"])
def test_environment_light_has_no_single_scattering_factor(
    renderer: Renderer, profile: str, technique: str
) -> None:
    """Bumps with grazing light and view have little light below except from the surface around them."""
    bumps = np.random.default_rng(1).normal(0.0, 0.5, (256, 256, 2))
    rough = head_of(uv_sphere(30.0, 128, 64), normal=bumps)
    light = DirectionalLight(direction=(-1.0, 0.0, 0.1), irradiance=(3.0,) * 3, shadows=False)
    plain, turned = (
        download(
            renderer.device,
            run_frame(
                renderer,
                scene_of(rough, light, profile=profile, albedo="profile", direction=direction, **DRY),
                size=(192, 192),
                technique=technique,
                atlas=256,
            ).resources.post.picture.exposed,
        )[..., :3]
        for direction in ("lambertian", "half-space")
    )
    assert np.isfinite(turned).all() and turned.min() >= 0.0
    assert (turned.max(axis=(0, 1)) < 1.6 * plain.max(axis=(0, 1))).all()


def test_light_from_outside_the_footprint_leaves_isotropically(renderer: Renderer, profile: str) -> None:
    """In a shadow there is no single scattering: no direction becomes negative, and no edge appears.

    Lambertian skin is as bright there, or a pixel nearer to the light, by the oblique offset.
    """
    ball = scene_of(
        BALL,
        SpotLight(position=place(BALL, (300, 0, 60)), target=place(BALL, (0, 0, 0)), irradiance=(3, 3, 3)),
        profile=profile,
        albedo="profile",
        direction="half-space",
        **DRY,
    )
    plain = replace(ball, skin=ball.skin.model_copy(update={"direction": "lambertian"}))
    images = [
        download(renderer.device, run_frame(renderer, scene, atlas=256).resources.post.picture.exposed)[
            ..., :3
        ]
        for scene in (ball, plain)
    ]
    made, usual = images
    assert made.min() >= 0.0 and np.isfinite(made).all()
    dark = (usual.sum(axis=-1) > 0.0) & (usual.sum(axis=-1) < 0.01 * usual.sum(axis=-1).max())
    assert dark.sum() > 20
    assert (made[dark] < 3.0 * maximum_filter(usual, (3, 3, 1))[dark] + 1e-6).all()


def test_white_skin_is_not_made_brighter(renderer: Renderer) -> None:
    """White skin returns all light that enters it."""
    scene = scene_of(FLAT, LIGHT, camera=seen_from(0.0), albedo="profile", direction="half-space", **DRY)
    bright = angular_response(np.ones(3), 1.0)
    np.testing.assert_allclose(bright.relative_reflectance, 1.0, atol=1e-3)
    cosine = 0.6 / float(np.linalg.norm(LIGHT.direction))
    turned = bright.single_scattering * (1.0 / (cosine + 1.0) - mean_single_scattering_kernel(cosine, 1.0))
    made = middle(renderer, scene, technique="none")
    expected = np.multiply(LIGHT.irradiance, cosine) / np.pi * (1.0 + turned)
    np.testing.assert_allclose(made, expected, rtol=2e-3)
