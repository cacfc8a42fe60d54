"""Pictures of simple scenes compared with closed forms, pixel by pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, place, run_frame, scene_of
from tolerances import TWIN

from dermis.frame import programs
from dermis.frame.features.shading import shade
from dermis.frame.renderer import Renderer
from dermis.gpu import CommandList, download, upload
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere
from dermis.optics.profiles import load_profile
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
Z = np.array([0.0, 0.0, 1.0])
FLAT = head_of(plane(100.0))
CREAM = head_of(plane(100.0), colour=np.broadcast_to([0.5, 0.25, 0.75], (8, 8, 3)))
SIZE = (40, 24)
WEIGHTS = load_profile("gpu-gems-3").weight


def image(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    inputs = run_frame(renderer, scene, **({"size": SIZE} | settings))
    return download(renderer.device, inputs.resources.post.picture.exposed).astype(float)


def seen_points(scene: Scene) -> tuple[Floats, Floats]:
    """Return the (h, w, 3) points of the plane z = 0 at pixel centres, and unit vectors to the eye."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    eye = np.add(scene.camera.position, scene.head.centre_mm)
    pixel = scene.camera.frame_mm / SIZE[1]
    points = np.stack(
        [eye[0] + (x - SIZE[0] / 2) * pixel, eye[1] - (y - SIZE[1] / 2) * pixel, np.zeros(x.shape)], axis=-1
    )
    view = eye - points
    return points, view / np.linalg.norm(view, axis=-1, keepdims=True)


def closed_form(scene: Scene, colour: Floats | float) -> Floats:
    """Return the diffuse and specular radiance of the plane under its lights, without diffusion."""
    points, view = seen_points(scene)
    m, rho_s = scene.skin.roughness, scene.skin.rho_s
    below = twins.entering(scene, points, np.broadcast_to(Z, points.shape))
    radiance = below * colour * twins.leaves(view[..., 2], m, rho_s)[..., None] / np.pi
    for light in scene.lights:
        to_light, arriving = twins.incident(light, scene.head.centre_mm, points)
        lobe = (
            rho_s
            * MODELS[scene.skin.specular].lobe(cosines(Z, np.asarray(to_light), view), m)
            * np.maximum(to_light[..., 2], 0)
        )
        radiance = radiance + arriving * lobe[..., None]
    return radiance


AIM = {"position": place(FLAT, (60, 40, 120)), "target": place(FLAT, (0, 0, 0))}
LIGHTS = {
    "point": PointLight(**AIM, irradiance=(3.0, 2.0, 1.0), shadows=False),
    "spot": SpotLight(**AIM, inner_degrees=5, outer_degrees=12, shadows=False),
    "directional": DirectionalLight(direction=(1, 0.5, -1), irradiance=(1.0, 2.0, 3.0), shadows=False),
    "mirrored": PointLight(position=place(FLAT, (0, 0, 290)), target=place(FLAT, (0, 0, 0)), shadows=False),
    "behind": DirectionalLight(direction=(0, 0, 1), shadows=False),
}


@pytest.mark.parametrize("mix", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("name", LIGHTS)
def test_plane_without_scattering_matches_the_closed_form(renderer: Renderer, name: str, mix: float) -> None:
    """With technique "none" all light leaves where it enters, in every pixel."""
    scene = scene_of(
        FLAT, LIGHTS[name], camera=front_camera(FLAT, frame_mm=50.0), mix=mix, roughness=0.5, rho_s=0.4
    )
    exact = closed_form(scene, twins.DEFAULT_COLOUR)
    made = image(renderer, scene, technique="none")
    assert np.abs(made[..., :3] - exact).max() <= TWIN * max(exact.max(), 1e-3)
    assert (made[..., 3] == 1).all()


@pytest.mark.parametrize("technique", ["texture-space", "none"])
@pytest.mark.parametrize("albedo", ["map", "profile"])
def test_uniform_light_is_unchanged_by_scattering(
    renderer: Renderer, albedo: str, technique: str, close: float
) -> None:
    """Diffusion does not change uniform light, and the weights of a profile are its colour."""
    scene = scene_of(
        FLAT, LIGHTS["directional"], camera=front_camera(FLAT, frame_mm=50.0), albedo=albedo, roughness=0.5
    )
    colour = WEIGHTS.sum(axis=0) if albedo == "profile" else twins.DEFAULT_COLOUR
    exact = closed_form(scene, colour)
    made = image(renderer, scene, technique=technique, atlas=128)[..., :3]
    assert np.abs(made - exact).max() < close * exact.max()


def test_a_profile_keeps_its_own_colour(renderer: Renderer, tmp_path: Any) -> None:
    """Weights that sum to less than 1 darken the skin by that factor."""
    path = tmp_path / "dark.csv"
    path.write_text("variance_mm2,red,green,blue\n0.005,0.1,0.2,0.05\n0.5,0.3,0.1,0.2\n")
    scene = scene_of(
        FLAT,
        LIGHTS["directional"],
        camera=front_camera(FLAT, frame_mm=50.0),
        albedo="profile",
        profile=str(path),
        roughness=0.5,
    )
    for technique in ("texture-space", "none"):
        made = image(renderer, scene, technique=technique, atlas=128)[..., :3]
        exact = closed_form(scene, np.array([0.4, 0.3, 0.25]))
        assert np.abs(made - exact).max() < TWIN * exact.max()


@pytest.mark.parametrize("mix", [0.0, 0.3, 1.0])
def test_colour_map_is_applied_once_for_any_mix(renderer: Renderer, mix: float) -> None:
    """A uniform colour is applied once, however it is divided between entry and exit."""
    scene = scene_of(
        CREAM, LIGHTS["directional"], camera=front_camera(CREAM, frame_mm=50.0), mix=mix, roughness=0.5
    )
    exact = closed_form(scene, np.array([0.5, 0.25, 0.75]))
    made = image(renderer, scene, atlas=128)[..., :3]
    assert np.abs(made - exact).max() < TWIN * exact.max()


BALL = head_of(uv_sphere(30.0, 48, 24))


@pytest.mark.parametrize("background", [(0.0, 0.0, 0.0), (0.25, 0.5, 2.0)])
@pytest.mark.parametrize("exposure", [1.0, 0.25])
def test_silhouette_is_antialiased(renderer: Renderer, background: Any, exposure: float) -> None:
    """Coverage is the fraction of samples on the ball, and the background is independent of exposure."""
    scene = scene_of(BALL, frontal(), camera=front_camera(BALL, frame_mm=80.0))
    made = image(renderer, scene, samples=8, background=background, exposure=exposure, size=(40, 40))
    black = image(renderer, scene, samples=8, exposure=exposure, size=(40, 40))
    cover = made[..., 3]
    assert np.array_equal(cover, black[..., 3])
    assert np.array_equal(np.unique(np.round(cover * 8, 5) % 1), [0.0])
    assert 0 < ((cover > 0) & (cover < 1)).sum() < 160
    disc = np.pi * (30 * 300 / np.sqrt(300**2 - 30**2)) ** 2 / 80**2
    assert cover.mean() == pytest.approx(disc, rel=0.02)
    expected = black[..., :3] + (1 - cover[..., None]) * np.array(background)
    assert np.abs(made[..., :3] - expected).max() < TWIN * max(1.0, *background)


def test_more_samples_change_only_edges(renderer: Renderer) -> None:
    scene = scene_of(BALL, frontal(), camera=front_camera(BALL, frame_mm=80.0))
    one, many = (image(renderer, scene, samples=n, size=(40, 40)) for n in (1, 5))
    inner = (one[..., 3] == 1) & (many[..., 3] == 1)
    edge = (many[..., 3] > 0) & (many[..., 3] < 1)
    assert inner.sum() > 500 and edge.any()
    assert np.abs(one - many)[inner].max() < 0.05 * one.max()  # shading itself varies within a pixel
    assert np.array_equal(one[~inner & ~edge], many[~inner & ~edge])


def test_opaque_material_does_not_scatter(renderer: Renderer) -> None:
    """An opaque material has its own colour and a wet surface, without diffusion."""
    mesh = joined((plane(100.0), (0, 0, 0), (0, 0, 1)), kinds=["opaque"])
    head = head_of(mesh, colour=np.full((8, 8, 3), 0.9))
    light = DirectionalLight(direction=(1, 0, -1), irradiance=(2.0, 2.0, 2.0), shadows=False)
    made = image(renderer, scene_of(head, light, camera=front_camera(head, frame_mm=5.0)), atlas=128)
    cosine = np.sqrt(0.5)
    below = 2.0 * cosine * twins.enters([cosine], 0.1, 1.0) * twins.leaves([1.0], 0.1, 1.0)
    exact = below * np.array([0.5, 0.25, 0.125]) / np.pi
    assert np.abs(made[..., :3] - exact).max() < 10 * TWIN * exact.max()


def unmapped_head() -> Head:
    """Return two planes side by side; the uv of the right one is smaller than a texel."""
    return head_of(
        joined((plane(40.0), (-20, 0, 0), (0, 0, 0.9)), (plane(40.0), (20, 0, 0), (0.99, 0.99, 0.002)))
    )


@pytest.mark.parametrize("albedo", ["map", "profile"])
def test_unmapped_triangles_keep_all_their_light(renderer: Renderer, albedo: str, close: float) -> None:
    head = unmapped_head()
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=30.0), albedo=albedo, roughness=0.5)
    made = image(renderer, scene, size=(40, 20), atlas=128)[..., :3]
    left, right = made[:, :19], made[:, :20:-1]
    assert left.min() > 0.1
    assert np.abs(left - right[:, :19]).max() < 2 * close * made.max()


def tailed() -> Head:
    """Return a strip 80 mm long: in uv a square, a taper, and a tail too thin for any texel centre."""
    x = np.repeat([-40.0, -10.0, 0.0, 40.0], 2)
    y = np.tile([20.0, -20.0], 4)
    u = np.repeat([0.05, 0.4, 0.45, 0.9], 2)
    v = np.array([0.05, 0.45, 0.05, 0.45, 0.2510, 0.2515, 0.2510, 0.2515])
    triangles = [[2 * k + i for i in corner] for k in range(3) for corner in ((0, 3, 2), (0, 1, 3))]
    positions = np.column_stack([x, y, 0 * x])
    return head_of(build_mesh(positions, np.column_stack([u, v]), triangles, np.zeros(6), SKIN_MATERIALS))


def test_a_thin_tail_of_a_chart_is_not_left_dark(renderer: Renderer) -> None:
    """In uniform light the tail, which owns no texels, is as bright as the rest of its chart."""
    head = tailed()
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=30.0), roughness=0.5)
    made = image(renderer, scene, size=(70, 28), atlas=64)[..., :3]
    left, right = made[:, 2:25], made[:, -3:-26:-1]
    assert left.min() > 0.1
    assert np.abs(left - right).max() < 0.01 * made.max()


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("technique", ["texture-space", "screen-space"])
def test_software_adapters_get_the_picture_of_gpus(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, technique: str, samples: int
) -> None:
    """Strips of pixels give the same picture, and so does skipping lights from behind."""
    sun = DirectionalLight(direction=(2, -1, 1), shadows=False)
    scene = scene_of(head_of(uv_sphere(30.0, 24, 12)), sun, LIGHTS["spot"], frontal(), sun)
    own = [one for one in programs.device_constants(renderer.device) if one[0] == "MESH_IN_BUFFERS"]
    made = []
    for constants in ((), (("SKIPS_UNLIT", 1), ("STRIP", 16))):
        monkeypatch.setattr(programs, "device_constants", lambda _, more=constants: (*own, *more))
        monkeypatch.setattr(renderer.device, "programs", {})
        made.append(image(renderer, scene, size=(45, 37), samples=samples, technique=technique))
    assert made[0].max() > 0.1 and np.array_equal(*made)


def test_strip_is_released_after_its_last_pixel(renderer: Renderer) -> None:
    """A strip ends at its last pixel even if that shows nothing."""
    head = head_of(plane(20.0))
    camera = front_camera(head, (0, 10.0, 0), frame_mm=40.0)  # its upper edge is in the middle of the picture
    scene, size = scene_of(head, frontal(), camera=camera), (16, 256)
    inputs = run_frame(renderer, scene, size=size, technique="none")
    resources = inputs.resources
    radiance = resources.post.picture.radiance
    upload(renderer.device, radiance, np.full((256, 16, 4), 7.0, np.float32))
    frame, look = CommandList(renderer.device), (inputs.bindings, inputs.view, inputs.constants)
    shade.draw(frame, *look, resources.visibility, resources.scattered, radiance, (16, 128))
    frame.submit()
    renderer.graph.invalidate()  # it knows nothing of this
    made = download(renderer.device, radiance)
    assert not made[:128].any() and (made[128:] == 7.0).all()
