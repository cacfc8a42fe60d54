"""Environment light in the frame: against NumPy, against plain sums, and white furnaces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import light_twins as twins
import numpy as np
import pytest
from numpy.typing import NDArray
from setups import entered_light, front_camera, frontal, head_of, probe, run_frame, scene_of, settings_of
from tolerances import FURNACE, PANORAMA, PREFILTERED
from twins import DEFAULT_COLOUR, surface, surface_albedo

from dermis.atlas.build import cached_atlas
from dermis.base.errors import DermisError
from dermis.environment.isotropic_lobes import isotropic_lobe_table
from dermis.environment.panorama import texel_directions, texel_solid_angles
from dermis.environment.prefilter import MIN_LAYER_ROUGHNESS, prefilter
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.gpu.textures import texture_from_array
from dermis.images.io import write_exr
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.specular.fresnel import ENERGY_SCHEMES

Floats = NDArray[np.float64]
SIZE = 32
BALL = uv_sphere(40.0, 48, 24)
WHITE = head_of(BALL, colour=np.ones((4, 4, 3)))


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a panorama with a coloured side, a window and a bright lamp that becomes a sun."""
    towards = texel_directions(64, 128)
    radiance = 0.5 + 0.4 * towards * [1, 0.5, -0.5]
    radiance[towards[..., 0] > 0.85] += [2.0, 2.5, 3.0]
    radiance[towards @ [0.6, 0.64, 0.48] > np.cos(np.radians(5.0))] += [300.0, 250.0, 150.0]
    path = tmp_path_factory.mktemp("environment") / "room.exr"
    write_exr(path, radiance.astype(np.float32))
    return str(path)


def around(head: Any, environment: Environment, **skin: Any) -> Scene:
    return replace(scene_of(head, camera=front_camera(head), **skin), environment=environment)


def exposed(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    """Return the (h, w, 4) picture and coverage."""
    picture = run_frame(renderer, scene, **settings).resources.post.picture
    return download(renderer.device, picture.exposed).astype(float)


def hemisphere(seed: int) -> Floats:
    """Return (n, n, 3) unit vectors in all directions, as float32 values."""
    v = np.random.default_rng(seed).normal(size=(SIZE, SIZE, 3))
    return twins.unit(v).astype(np.float32).astype(float)


def facing(normal: Floats, seed: int) -> Floats:
    """Return unit vectors on the side of the normal."""
    v = hemisphere(seed)
    return np.where(twins.dot(v, normal)[..., None] > 0, v, -v)


def test_shader_functions_match_numpy(renderer: Renderer, room: str) -> None:
    environment = Environment(name=room, rotation_degrees=70.0, exposure=0.6)
    lit = run_frame(renderer, around(WHITE, environment), occlusion="none").bindings
    rng = np.random.default_rng(3)
    normal, smooth = hemisphere(1), hemisphere(2)
    normal[0] = twins.unit(normal[0] * [0.01, 0, 0.01] + [0, 1, 0])  # within a texel of the poles
    normal[1] = -normal[0]
    normal[:2, 0] = [[0, 1, 0], [0, -1, 0]]
    normal = normal.astype(np.float32).astype(float)
    view = facing(normal, 4)
    open_, albedo = (rng.uniform(0, 1, (SIZE, SIZE)).astype(np.float32).astype(float) for _ in range(2))
    m = rng.uniform(0.06, 1, (SIZE, SIZE)).astype(np.float32).astype(float)
    textures = {
        "normals": texture_from_array(renderer.device, np.dstack([normal, open_]), "rgba32float"),
        "smooth_normals": texture_from_array(renderer.device, np.dstack([smooth, albedo]), "rgba32float"),
        "views": texture_from_array(renderer.device, np.dstack([view, m]), "rgba32float"),
    }
    entering, mirror = probe(
        renderer.device, "environment_probe", (SIZE, SIZE), ["around", "mirror"], **lit, **textures
    )
    layers, record = prefilter(room).layers.astype(float), lit["environment"]
    exact = twins.ambient(layers, record, normal, open_, albedo[..., None])
    assert np.abs(entering[..., :3] - exact).max() < PANORAMA * exact.max()
    exact = twins.mirrored(layers, record, smooth, normal, view, m, open_)
    assert np.abs(mirror[..., :3] - exact).max() < PANORAMA * exact.max()


@pytest.mark.parametrize("rotation", [0.0, 90.0])
def test_irradiance_matches_the_sum_over_all_directions(
    renderer: Renderer, room: str, rotation: float
) -> None:
    """Compare each texel of a ball with the sum of panorama texels times cosines; the sun is a light."""
    scene = around(
        head_of(BALL), Environment(name=room, rotation_degrees=rotation, exposure=2.0), rho_s=0.0, mix=0.0
    )
    inputs = run_frame(renderer, scene, occlusion="none", shadow_size=1024)
    assert inputs.resources.suns == 1
    entered = entered_light(renderer, inputs)[..., :3]
    atlas = cached_atlas(BALL, 64)
    _, normals = surface(atlas, scene.head)
    radiance = 2.0 * np.asarray(_read(room))
    towards = texel_directions(64, 128).reshape(-1, 3)
    turn = np.radians(rotation)
    c, s = np.cos(turn), np.sin(turn)
    towards = towards @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    light = (radiance * texel_solid_angles(64, 128)[..., None]).reshape(-1, 3)
    picked = [(y, x) for y in (12, 24, 40, 52) for x in (5, 20, 33, 50)]
    exact = np.array([np.maximum(towards @ normals[at], 0) @ light for at in picked])
    made = np.array([entered[at] for at in picked])
    assert (
        np.abs(made - exact).max() < 0.01 * exact.max()
    )  # the lamp is 10 degrees wide, a sun has one direction


def _read(path: str) -> Any:
    from dermis.images.io import read_image

    return read_image(Path(path))


def middle(image: Floats) -> Floats:
    """Return the pixels that lie entirely on the ball."""
    return np.asarray(image[..., :3][image[..., 3] == 1])


@pytest.mark.parametrize("energy", ["none", "full"])
@pytest.mark.parametrize("rho_s", [0.0, 0.18, 1.0])
def test_white_ball_passes_the_furnace_test(renderer: Renderer, rho_s: float, energy: str) -> None:
    """All light leaves again; without an energy term the specular reflection is added on top."""
    scene = around(WHITE, Environment(name="uniform"), rho_s=rho_s, roughness=0.3, energy=energy)
    inputs = run_frame(renderer, scene, occlusion="none", size=(64, 64), atlas=128)
    seen = middle(download(renderer.device, inputs.resources.post.picture.exposed).astype(float))
    albedo, mean = surface_albedo(np.linspace(0.0, 1, 200), 0.3)
    expected = ENERGY_SCHEMES[energy].furnace_radiance(albedo, mean, rho_s)
    assert seen.min() > expected.min() - FURNACE and seen.max() < expected.max() + FURNACE
    if energy == "full" or rho_s == 0.0:
        assert seen.mean() == pytest.approx(1.0, abs=FURNACE)
        assert seen.max() < 1.01


def test_uniform_sky_lights_all_directions_equally(renderer: Renderer) -> None:
    """Render a matte plane under radiance 3 times its colour, at any rotation."""
    head = head_of(plane(100.0))
    environment = Environment(name="uniform", exposure=3.0, rotation_degrees=33.0)
    scene = around(head, environment, rho_s=0.0)
    inputs = run_frame(renderer, scene, occlusion="none", atlas=128)
    image = download(renderer.device, inputs.resources.post.picture.exposed).astype(float)
    assert np.allclose(middle(image), 3.0 * DEFAULT_COLOUR, rtol=PREFILTERED)


def test_an_environment_adds_to_lights(renderer: Renderer, close: float) -> None:
    """Without an environment its stages do not run, and its texture is a single texel."""
    head = head_of(plane(100.0))
    both = replace(scene_of(head, frontal()), environment=Environment(name="uniform"))
    one, other, sum_ = (
        download(
            renderer.device, run_frame(renderer, scene, occlusion="none").resources.post.picture.exposed
        )[..., :3]
        for scene in (scene_of(head, frontal()), around(head, Environment(name="uniform")), both)
    )
    assert np.abs(one + other - sum_).max() < close * sum_.max()
    plain = renderer.prepare(scene_of(head, frontal()), settings_of())
    assert plain.constants == plain.light_constants == ()
    lit = plain.bindings
    assert lit["panorama"].size[:2] == lit["occlusion_map"].size[:2] == (1, 1)


def test_alternating_environments_are_filtered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Data sets alternate between scenes with and without an environment."""
    filtered: list[str] = []

    def counted(name: str) -> Any:
        filtered.append(name)
        return prefilter(name)

    monkeypatch.setattr("dermis.frame.lights.environment.prefilter", counted)
    head, renderer = head_of(plane(100.0)), Renderer("cpu")
    for _ in range(3):
        for scene in (around(head, Environment(name="uniform")), scene_of(head, frontal())):
            run_frame(renderer, scene, occlusion="none")
    assert filtered == ["uniform"]


@pytest.mark.parametrize("model", ["kelemen", "phong"])
def test_reflections_follow_the_model_in_use(renderer: Renderer, model: str) -> None:
    scene = around(WHITE, Environment(name="uniform"), specular=model)
    record = run_frame(renderer, scene, occlusion="none").bindings["environment"]
    table = isotropic_lobe_table(model).reshape(-1, 4)
    assert np.abs(record["mirrors"] - table).max() < 1e-6


def test_exposure_scales_suns_too(renderer: Renderer, room: str, close: float) -> None:
    """Suns may exceed the limits of lights in files."""
    plain, bright = (
        download(
            renderer.device,
            run_frame(
                renderer, around(WHITE, Environment(name=room, exposure=e))
            ).resources.post.picture.exposed,
        )[..., :3]
        for e in (1.0, 1e6)
    )
    assert np.abs(bright / 1e6 - plain).max() < close * plain.max()


def test_suns_count_among_the_lights(renderer: Renderer, room: str) -> None:
    full = replace(scene_of(head_of(plane(50.0)), *[frontal()] * 64), environment=Environment(name=room))
    with pytest.raises(DermisError, match="65, with the environment's suns"):
        renderer.draw(full, settings_of(occlusion="none"))


SEEN = {"background": "environment", "background_blur": MIN_LAYER_ROUGHNESS}


@pytest.mark.parametrize("rotation", [60.0, -150.0])
def test_environment_is_drawn_behind_the_head(renderer: Renderer, room: str, rotation: float) -> None:
    """Compare along the ray of each pixel; rotated by 60 degrees, the window is on the right."""
    environment = Environment(name=room, rotation_degrees=rotation, exposure=0.5)
    camera = front_camera(WHITE, frame_mm=600.0)
    scene = replace(scene_of(WHITE, camera=camera), environment=environment)
    inputs = run_frame(renderer, scene, occlusion="none", exposure=2.0, **SEEN)
    image = download(renderer.device, inputs.resources.post.picture.exposed).astype(float)
    y, x = np.mgrid[:48, :48]
    ray = twins.unit(np.dstack([x - 23.5, 23.5 - y, np.full(x.shape, -24.0)]))  # 45 degrees to each side
    exact = 2 * twins.panorama_at(
        prefilter(room).layers[1].astype(float), inputs.bindings["environment"], ray
    )
    free = image[..., 3] == 0
    assert free.sum() > 1000
    assert np.abs(image[..., :3] - exact)[free].max() < PANORAMA * exact.max()
    if rotation == 60.0:
        assert image[24, 38, 2] > 2 * image[24, 9, 2]


def test_background_is_a_colour_by_default(renderer: Renderer, room: str) -> None:
    scene = around(WHITE, Environment(name=room))
    image = download(
        renderer.device, run_frame(renderer, scene, background=(0, 1, 0)).resources.post.picture.exposed
    )
    assert np.allclose(image[0, 0], [0, 1, 0, 0])


def test_poles_have_no_seams(renderer: Renderer, tmp_path: Path) -> None:
    """With half of the sky bright, the reflection across the zenith changes gradually."""
    radiance = np.where(texel_directions(64, 128)[..., :1] > 0, [1.0, 1.0, 1.0], [0.0, 0.0, 0.0])
    write_exr(tmp_path / "half.exr", radiance.astype(np.float32))
    lit = run_frame(
        renderer, around(WHITE, Environment(name=str(tmp_path / "half.exr"))), occlusion="none"
    ).bindings
    angle = np.radians(np.linspace(-3, 3, SIZE * SIZE)).reshape(SIZE, SIZE)
    normal = np.dstack([np.sin(angle), np.cos(angle), 0 * angle, 1 + 0 * angle])
    view = np.dstack([normal[..., :3], np.full((SIZE, SIZE), 0.05)])
    textures = {
        name: texture_from_array(renderer.device, values, "rgba32float")
        for name, values in {"normals": normal, "smooth_normals": normal, "views": view}.items()
    }
    _, mirror = probe(
        renderer.device, "environment_probe", (SIZE, SIZE), ["around", "mirror"], **lit, **textures
    )
    seen = mirror[..., 0].ravel()
    assert np.diff(seen).max() < 2 * np.median(np.diff(seen))
    assert seen[0] < 0.4 and seen[-1] > 0.6


def test_light_follows_the_rotation(renderer: Renderer, room: str) -> None:
    """The window is on the right of the picture; half a turn moves it to the other side."""
    left_right = []
    for degrees in (0.0, 180.0):
        scene = around(WHITE, Environment(name=room, rotation_degrees=degrees), rho_s=0.0)
        image = download(
            renderer.device, run_frame(renderer, scene, occlusion="none").resources.post.picture.exposed
        )
        left_right.append((image[24, 14, 2], image[24, 33, 2]))
    assert left_right[0][1] > 1.2 * left_right[0][0]
    assert left_right[1][0] > 1.2 * left_right[1][1]
