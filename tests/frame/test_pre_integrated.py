"""Tables of light on spheres and across shadow edges, and pictures that use them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import front_camera, head_of, joined, place, run_frame, scene_of, settings_of
from tolerances import TWIN

from dermis.frame.renderer import Renderer
from dermis.frame.techniques.pre_integrated import (
    MAX_CURVATURE_PER_MM,
    half_light_sigma_mm,
    penumbra_width_mm,
    scattered_cosine,
    shadow_edge_row,
    sphere_irradiance_table,
)
from dermis.gpu import download
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene import Camera, Scene
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
PROFILE = load_profile("gpu-gems-3")
SPHERES = sphere_irradiance_table(PROFILE)
COSINES = np.linspace(-1, 1, SPHERES.shape[1])
CURVATURES = np.linspace(0, MAX_CURVATURE_PER_MM, len(SPHERES))


def on_sphere(cosine: float, radius_mm: float, profile: GaussianSum) -> Floats:
    """Return (c,) scattered light at a point by plain sums over the sphere."""
    angle = np.pi * (np.arange(4000) + 0.5) ** 2 / 4000**2  # finer near the point
    width = np.diff(np.pi * np.arange(4001) ** 2 / 4000**2)
    azimuth = np.pi * (np.arange(256) + 0.5) / 256
    sine = np.sqrt(1 - cosine**2)
    lit = np.maximum(
        cosine * np.cos(angle)[:, None] + sine * np.sin(angle)[:, None] * np.cos(azimuth), 0
    ).mean(axis=1)
    bell = profile.radiant_exitance(2 * radius_mm * np.sin(angle / 2)) * (np.sin(angle) * width)[:, None]
    return np.asarray((lit[:, None] * bell).sum(axis=0) / bell.sum(axis=0))


@pytest.mark.parametrize("radius_mm", [2.0, 8.0, 64.0])
def test_sphere_table_matches_quadrature(radius_mm: float) -> None:
    """Each Gaussian is normalised on its own."""
    for cosine in (-0.6, -0.1, 0.0, 0.05, 0.3, 0.9, 1.0):
        for variance in (0.0064, 0.187, 7.41):
            one = GaussianSum("one", np.array([variance]), np.ones((1, 1)))
            made = scattered_cosine([cosine], radius_mm**2 / variance)[0]
            assert made == pytest.approx(on_sphere(cosine, radius_mm, one)[0], abs=2e-4)


def test_flat_skin_is_unspread() -> None:
    assert np.array_equal(SPHERES[0], np.repeat(np.maximum(COSINES, 0)[:, None], 3, axis=1))


def test_first_curved_row_follows_from_the_flat_one() -> None:
    """At the terminator it is a Gaussian average of a ramp: curvature times sigma / sqrt(2 pi)."""
    one = GaussianSum("one", np.array([1.0]), np.ones((1, 1)))
    rows = sphere_irradiance_table(one)[:4, COSINES == 0.0, 0].ravel()
    assert np.allclose(rows, CURVATURES[:4] / np.sqrt(2 * np.pi), rtol=0.01)


def test_each_sphere_conserves_energy() -> None:
    """The mean over a sphere, half the integral over N.L, is 1/4."""
    mean = 0.5 * np.trapezoid(SPHERES, COSINES, axis=1)
    assert np.abs(mean / 0.25 - 1).max() < 1e-4


def test_higher_curvature_is_softer() -> None:
    assert (np.diff(SPHERES[:, COSINES <= 0], axis=0) >= 0).all()
    assert (np.diff(SPHERES[:, -1], axis=0) < 0).all()
    assert (np.diff(SPHERES, axis=1) >= 0).all()
    assert (SPHERES[5:, 128, 0] > SPHERES[5:, 128, 1]).all()  # red goes farther


@pytest.mark.parametrize("half_width_mm", [0.0, 1.0])
def test_shadow_edge_matches_quadrature(half_width_mm: float) -> None:
    """Compare with a step blurred by the line profile: odd about its centre, from 0 to 1."""
    radius = penumbra_width_mm(PROFILE)
    made = shadow_edge_row(PROFILE, radius, half_width_mm)
    assert made[0].max() < 1e-15 and made[-1].min() == 1
    assert np.allclose(made + made[::-1], 1) and (np.diff(made, axis=0) >= 0).all()
    x = np.linspace(-40, 40, 16001)
    variance = PROFILE.variance_mm2[:, None]
    line = PROFILE.weight.T @ (np.exp(-(x**2) / (2 * variance)) / np.sqrt(variance))
    tent = np.maximum(1 - np.abs(x[abs(x) <= 2]) / max(half_width_mm, 1e-9), 0)
    line = np.stack([np.convolve(channel, tent, "same") for channel in line])
    for dark in (-1.0, -2.5):
        beyond = line[:, x < dark].sum(axis=1) / line.sum(axis=1)
        at = [np.interp(dark / radius, np.linspace(-1, 1, len(made)), made[:, k]) for k in range(3)]
        assert np.abs(at - beyond).max() < 0.012  # what would go beyond the radius is shared out within it
    assert made[len(made) // 8, 2] < 1e-3  # blue hardly leaves the tent


def test_relief_is_smoothed_by_the_radius_of_half_the_light() -> None:
    one = GaussianSum("one", np.array([0.49]), np.full((1, 3), 0.3))
    assert np.allclose(half_light_sigma_mm(one), 0.7, rtol=1e-3)
    red, green, blue = half_light_sigma_mm(PROFILE)
    assert red > green > blue


def image(renderer: Renderer, scene: Scene, technique: str = "pre-integrated", **settings: Any) -> Floats:
    inputs = run_frame(renderer, scene, **({"size": (64, 64)} | settings), technique=technique)
    return download(renderer.device, inputs.resources.post.picture.exposed).astype(float)


RADIUS = 10.0
BALL = head_of(uv_sphere(RADIUS, 96, 48))


def table(cosines: Floats, curvature: float) -> Floats:
    """Interpolate the (..., 3) table like the shader."""
    row = curvature / MAX_CURVATURE_PER_MM * (len(SPHERES) - 1)
    low = int(row)
    entries = SPHERES[low] + (row - low) * (SPHERES[low + 1] - SPHERES[low])
    return np.stack([np.interp(cosines, COSINES, entries[:, k]) for k in range(3)], axis=-1)


def ball_cosines(scene: Scene, size: int, direction: Floats) -> tuple[Floats, Floats]:
    """Return N.L over the picture of the ball, and the mask of the ball."""
    y, x = np.mgrid[:size, :size] + 0.5
    frame = scene.camera.frame_mm
    ray = np.stack([(x / size - 0.5) * frame, (0.5 - y / size) * frame, np.full(x.shape, -300.0)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    b = ray[..., 2] * 300.0
    square = b**2 - (300.0**2 - RADIUS**2)
    t = -b - np.sqrt(np.maximum(square, 0))
    point = np.array([0, 0, 300.0]) + t[..., None] * ray
    return point @ -direction / np.linalg.norm(direction) / RADIUS, square > 2.0


@pytest.mark.parametrize("shadows", [False, True])
def test_shaded_ball_matches_numpy(renderer: Renderer, shadows: bool) -> None:
    """Every pixel of a ball lit from the side equals the table; its own shadow hardly changes that."""
    direction = np.array([-2.0, -1.0, -1.0])
    light = DirectionalLight(direction=tuple(direction), irradiance=(3.0, 2.0, 1.0), shadows=shadows)
    scene = scene_of(BALL, light, camera=front_camera(BALL, frame_mm=24.0), rho_s=0.0, energy="none")
    made = image(renderer, scene, size=(128, 128), shadow_size=1024)[..., :3]
    cosines, inside = ball_cosines(scene, 128, direction)
    exact = twins.DEFAULT_COLOUR / np.pi * np.array([3.0, 2.0, 1.0]) * table(cosines, 1 / RADIUS)
    assert inside.sum() > 5000
    off = np.abs(made - exact)[inside].max(axis=0) / exact.max(axis=(0, 1))
    assert off.max() < (0.08 if shadows else 0.01)


def test_unspread_profile_is_dry_skin(renderer: Renderer, tmp_path: Path) -> None:
    """Without scattering the technique equals dry skin, gloss and energy term included."""
    path = tmp_path / "narrow.csv"
    path.write_text("variance_mm2,red,green,blue\n0.00001,0.9,0.8,0.7\n")
    light = DirectionalLight(direction=(-2, -1, -1), irradiance=(3.0, 2.0, 1.0), shadows=False)
    camera = front_camera(BALL, frame_mm=24.0)
    scene = scene_of(BALL, light, camera=camera, profile=str(path), albedo="profile", rho_s=0.5)
    dry, made = (image(renderer, scene, technique) for technique in ("none", "pre-integrated"))
    assert np.abs(made - dry).max() < 0.005 * dry.max()


def test_flat_skin_under_even_light_is_dry_skin(renderer: Renderer) -> None:
    head = head_of(plane(100.0), colour=np.broadcast_to([0.5, 0.25, 0.75], (8, 8, 3)))
    light = DirectionalLight(direction=(1, 0.5, -1), irradiance=(1.0, 2.0, 3.0))
    scene = scene_of(head, light, camera=front_camera(head, frame_mm=50.0), mix=0.3)
    dry, made = (image(renderer, scene, technique) for technique in ("none", "pre-integrated"))
    assert np.abs(made - dry).max() < 10 * TWIN * dry.max()


@pytest.mark.parametrize("down", [0.0, 1.5])
def test_straight_shadow_matches_numpy(renderer: Renderer, down: float) -> None:
    """The shadow of a plate on a wall has the profile of the table, for normal and oblique light."""
    mesh = joined((plane(60.0), (-30, 0, 20), (0, 0, 0.5)), (plane(200.0), (0, 0, 0), (0.5, 0.5, 0.5)))
    head = head_of(mesh)
    light = DirectionalLight(direction=(0.5, -down, -1), irradiance=(3.0,) * 3, softness_mm=1.0)
    camera = front_camera(head, (10, -20 * down, 0), frame_mm=16.0)
    scene = scene_of(head, light, camera=camera, rho_s=0.0, energy="none")
    made, dry = (
        image(renderer, scene, technique, shadow_size=2048, size=(128, 128))[64, :, :3]
        for technique in ("pre-integrated", "none")
    )
    x = 10 + (np.arange(128) + 0.5 - 64) / 128 * 16.0
    seen = x > 6.0  # farther left the plate itself is in the way
    middle = np.interp(0.5, dry[seen, 0] / dry.max(), x[seen])
    assert middle == pytest.approx(10.0, abs=0.15 + 0.4 * down)  # points are lifted off the wall
    radius = penumbra_width_mm(PROFILE)
    edge = shadow_edge_row(PROFILE, radius, 0.5)
    at = np.clip((x - middle) / radius, -1, 1)
    exact = np.stack([np.interp(at, np.linspace(-1, 1, len(edge)), edge[:, k]) for k in range(3)], axis=-1)
    off = np.abs(made / made.max() - exact)[seen]
    assert off.max() < 0.06 and off.mean() < 0.004


def test_grazing_light_is_handled(renderer: Renderer) -> None:
    """On skin that is curved across the light but hardly along it, no light comes from beyond the horizon."""
    ball = uv_sphere(10.0, 96, 48)
    mesh = build_mesh(
        ball.positions * np.float32([1, 1, 4]), ball.uv, ball.triangles, ball.material, ball.materials
    )
    head = head_of(mesh)
    light = DirectionalLight(direction=(0, 0, -1), irradiance=(3.0,) * 3)
    eye = Camera(position=place(head, (300, 0, 0)), target=place(head, (0, 0, 0)), frame_mm=90.0)
    scene = scene_of(head, light, camera=eye, rho_s=0.0, energy="none")
    made = image(renderer, scene, size=(128, 128), shadow_size=1024)[64, :, 0] / (3.0 / np.pi)
    z = (63.5 - np.arange(128)) / 128 * 90.0
    assert made[abs(z - 25) < 5].min() > 0.1
    assert made[z < 0].max() < 0.003


@pytest.mark.parametrize("number", [0, 4, 5])
def test_shadows_hold_where_the_surface_faces_the_light(renderer: Renderer, number: int) -> None:
    """A cosine that rounds to more than 1 adds no light."""
    n = np.random.default_rng(number).normal(size=3)
    n /= np.linalg.norm(n)
    a = np.cross([0, 1, 0], n) / np.linalg.norm(np.cross([0, 1, 0], n))
    turn = np.stack([a, np.cross(n, a), n], axis=1)
    both = joined((plane(60.0), (0, 0, 0), (0, 0, 0.5)), (plane(30.0), (0, 0, 15), (0.5, 0, 0.5)))
    mesh = build_mesh(both.positions @ turn.T, both.uv, both.triangles, both.material, both.materials)
    head = head_of(mesh)
    camera = Camera(
        position=place(head, turn @ (0, -260, 100)),
        target=place(head, (0, 0, 0)),
        up=tuple(turn @ (0, 0, 1)),
        frame_mm=60,
    )
    light = DirectionalLight(direction=tuple(-n), irradiance=(1, 1, 1))
    scene = scene_of(head, light, camera=camera, albedo="profile", specular="none", energy="none")
    lit = [
        np.count_nonzero(
            renderer.draw(scene, settings_of(technique=technique, shadow_size=256)).linear()[..., 0] > 0.02
        )
        for technique in ("none", "pre-integrated")
    ]
    assert 1.0 < lit[1] / lit[0] < 1.04  # red light spreads a little into the shadow
