"""Modelled eyes: the view through the cornea, their poses, and the lids that close over them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import frontal, head_of, probe, run_frame, scene_of, settings_of

from dermis import Human
from dermis.base.errors import DermisError
from dermis.frame.features.surface.painting.painted_head import paint_eye
from dermis.frame.renderer import Renderer
from dermis.gpu.textures import texture_from_array
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import (
    CORNEA_MM,
    IRIS_MM,
    LIMBUS_MM,
    UV_RADIUS_FALLOFF_RADIANS,
    UV_RADIUS_OF_BACK,
    apex_mm,
    cornea_centre_mm,
    iris_plane_mm,
)
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import plane
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.gaze import looking_at
from dermis.scene.lights import DirectionalLight, RectangleLight
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIZE = 32
ETA = 1.336
MM = 1e-3
"""Off the traced ray at most: single precision [mm]."""


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head()


def traced(places: Floats, ways: Floats) -> Floats:
    """Return (n, 2) hits of rays through the cornea with the plane of the iris, by Snell's law [mm]."""
    found = []
    for p, d in zip(places.reshape(-1, 3), ways.reshape(-1, 3), strict=True):
        n = (p - [0, 0, cornea_centre_mm()]) / CORNEA_MM
        outside = np.arccos(np.clip(-d @ n, -1, 1))
        inside = np.arcsin(np.sin(outside) / ETA)
        beside = d + np.cos(outside) * n
        length = np.linalg.norm(beside)
        beside = beside / length if length > 1e-12 else beside
        t = np.sin(inside) * beside - np.cos(inside) * n
        found.append((p + t * (iris_plane_mm() - p[2]) / t[2])[:2])
    return np.array(found).reshape(*places.shape[:2], 2)


def test_refracted_iris_matches_a_traced_ray(renderer: Renderer) -> None:
    rng = np.random.default_rng(1)
    turn, off = rng.uniform(0, 2 * np.pi, (SIZE, SIZE)), 5.5 * np.sqrt(rng.random((SIZE, SIZE)))
    x, y = off * np.cos(turn), off * np.sin(turn)
    places = np.stack([x, y, cornea_centre_mm() + np.sqrt(CORNEA_MM**2 - off**2)], axis=-1)
    ways = rng.normal(0, 0.35, (SIZE, SIZE, 3)) - [0, 0, 1]
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    places, ways = (one.astype(np.float32).astype(float) for one in (places, ways))
    seen = on_iris(renderer, places, ways)
    assert np.abs(seen - traced(places, ways)).max() < MM


def test_the_cornea_magnifies(renderer: Renderer) -> None:
    """An iris of 12 mm looks like one of 13 mm from the front."""
    p = np.zeros((SIZE, SIZE, 3))
    p[..., 0] = 2.0
    p[..., 2] = cornea_centre_mm() + np.sqrt(CORNEA_MM**2 - 4)
    straight = np.tile(np.array([0.0, 0.0, -1.0]), (SIZE, SIZE, 1))
    seen = on_iris(renderer, p, straight)
    assert 1.7 < seen[0, 0, 0] < 1.9


def test_the_cornea_dims_the_iris(renderer: Renderer) -> None:
    """A disc in water has 1/n^2 of its radiance in air, and the cornea focuses the light."""
    off = 0.05
    p = np.zeros((SIZE, SIZE, 3))
    p[..., 0], p[..., 2] = off, cornea_centre_mm() + np.sqrt(CORNEA_MM**2 - off**2)
    straight = np.tile(np.array([0.0, 0.0, -1.0]), (SIZE, SIZE, 1))
    drawn_to = traced(p[:1, :1], straight[:1, :1])[0, 0, 0] / off
    shown = probed(renderer, p, straight)[0][0, 0, 2]
    assert shown == pytest.approx(1 / (ETA * drawn_to) ** 2, rel=1e-3)


def on_iris(renderer: Renderer, places: Floats, ways: Floats) -> Floats:
    """Return (n, n, 2) hits with the plane of the iris by the shader."""
    return probed(renderer, places, ways)[0][..., :2]


def traced_light(to_light: Floats, side: int) -> Floats:
    """Return the irradiance (side, side) of the iris by parallel light, by counting refracted rays."""
    grid = (np.arange(700) + 0.5) / 350 * LIMBUS_MM - LIMBUS_MM
    x, y = (one[np.hypot(*np.meshgrid(grid, grid)) < LIMBUS_MM] for one in np.meshgrid(grid, grid))
    places = np.stack([x, y, cornea_centre_mm() + np.sqrt(CORNEA_MM**2 - x**2 - y**2)], axis=-1)
    normal = (places - [0, 0, cornea_centre_mm()]) / CORNEA_MM
    cosine = normal @ to_light
    beside = cosine[:, None] * normal - to_light
    inside = beside / ETA - np.sqrt(1 - (beside**2).sum(axis=1) / ETA**2)[:, None] * normal
    at = places + ((iris_plane_mm() - places[:, 2]) / inside[:, 2])[:, None] * inside
    flux = np.maximum(cosine, 0) / normal[:, 2] * (LIMBUS_MM / 350) ** 2
    edges = np.linspace(-IRIS_MM, IRIS_MM, side + 1)
    counted = np.histogram2d(at[:, 1], at[:, 0], bins=(edges, edges), weights=flux)[0]
    return np.asarray(counted * (side / (2 * IRIS_MM)) ** 2)


@pytest.mark.parametrize(("degrees", "mean_error"), [(5.0, 0.02), (35.0, 0.02), (55.0, 0.04)])
def test_iris_receives_the_light_of_traced_rays(
    renderer: Renderer, degrees: float, mean_error: float
) -> None:
    """The cornea focuses light, and more on the side opposite to the light."""
    side = 16
    turn = np.radians(degrees)
    to_light = np.array([np.sin(turn), 0.0, np.cos(turn)])
    middle = (np.arange(side) + 0.5) / side * 2 * IRIS_MM - IRIS_MM
    x, y = np.meshgrid(middle, middle)
    places = np.zeros((SIZE, SIZE, 3))
    places[:side, :side] = np.stack([x, y, 0 * x], axis=-1)
    light = probed(renderer, places, np.tile(to_light, (SIZE, SIZE, 1)))[1][:side, :side, 0]
    expected, within = traced_light(to_light, side), np.hypot(x, y) < 5.0
    assert np.abs(light - expected)[within].mean() < mean_error
    assert light[within].sum() == pytest.approx(expected[within].sum(), rel=0.02)
    assert np.abs(np.cos(turn) - expected)[within].mean() > 3 * mean_error


def test_iris_receives_the_sky_of_traced_rays(renderer: Renderer) -> None:
    """A uniform sky up to 75 degrees from the axis, by traced light that the cornea does not reflect."""
    side, degrees = 16, np.arange(3.75, 75, 7.5)
    middle = (np.arange(side) + 0.5) / side * 2 * IRIS_MM - IRIS_MM
    x, y = np.meshgrid(middle, middle)
    places = np.zeros((SIZE, SIZE, 3))
    places[:side, :side] = np.stack([x, y, 0 * x], axis=-1)
    sky = probed(renderer, places, np.tile(np.array([0.0, 0.0, 1.0]), (SIZE, SIZE, 1)))[1][:side, :side, 1]
    within, total = np.hypot(x, y) < 4.0, 0.0
    for turn in np.radians(degrees):
        by_light = traced_light(np.array([np.sin(turn), 0.0, np.cos(turn)]), side)
        total += by_light[within].mean() * 2 * np.sin(turn) * np.radians(7.5)
    # the cornea reflects more of the steep light than a flat surface does
    assert sky[within].mean() == pytest.approx(total, rel=0.05)


def test_pictures_of_eyes_are_lit_as_the_iris_is(renderer: Renderer) -> None:
    """As a diffuse surface, the picture is lit by two opposite lights in the ratio of traced rays.

    The ratio does not depend on the colour of the iris.
    """
    side, across = 512, (np.arange(512) + 0.5) / 512 - 0.5
    normals = paint_eye(renderer.device, EyeLook(), side).normal[side // 2].astype(np.float64)
    limit = 1 - np.exp(-np.pi / UV_RADIUS_FALLOFF_RADIANS)
    angle = -UV_RADIUS_FALLOFF_RADIANS * np.log(1 - np.minimum(across / UV_RADIUS_OF_BACK, 1) * limit)
    seen = (across > 0.01) & (angle < 0.42)
    sine, height = np.sin(angle[seen]), cornea_centre_mm()
    along = height * np.cos(angle[seen]) + np.sqrt(CORNEA_MM**2 - (height * sine) ** 2)
    p = along[:, None] * np.stack([sine, 0 * sine, np.cos(angle[seen])], axis=-1)
    film = (p - [0, 0, height]) / CORNEA_MM
    right = np.stack([film[:, 2], 0 * sine, -film[:, 0]], axis=-1)
    normal = normals[seen][:, :1] * right + normals[seen][:, 2:] * film
    x = traced(p[None], np.tile([0.0, 0.0, -1.0], (1, len(p), 1)))[0, :, 0]
    bins, turn = 24, 0.6
    middle = (np.arange(bins) + 0.5) / bins * 2 * IRIS_MM - IRIS_MM
    lights = [np.array([sign * np.sin(turn), 0, np.cos(turn)]) for sign in (1, -1)]
    rows = slice(bins // 2 - 1, bins // 2 + 1)
    expected = [np.interp(x, middle, traced_light(one, bins)[rows].mean(axis=0)) for one in lights]
    found = [normal @ one for one in lights]
    np.testing.assert_allclose(found[0] / found[1], expected[0] / expected[1], atol=0.08)


def probed(renderer: Renderer, places: Floats, ways: Floats) -> tuple[Floats, Floats]:
    """Return (n, n, 4) results of the shader: the visible part of the sky, and the light received."""
    lit = run_frame(renderer, scene_of(head_of(plane(50.0)), frontal())).bindings
    bound = {
        name: texture_from_array(renderer.device, np.dstack([one, np.ones((SIZE, SIZE))]), "rgba32float")
        for name, one in (("places", places), ("ways", ways))
    }
    seen, received = probe(renderer.device, "eye_probe", (SIZE, SIZE), ["seen", "iris_light"], **lit, **bound)
    return np.asarray(seen, np.float64), np.asarray(received, np.float64)


def axes(head: Head, pose: Pose) -> Floats:
    """Return (2, 3) directions in which the eyes look."""
    assert head.eyes is not None
    frames = head.eyes.eye_matrices(head.control_rig, pose.to_arrays(head.control_rig))
    return np.asarray([frame[2, :3] / np.linalg.norm(frame[2, :3]) for frame in frames])


def test_both_eyes_look_forward_at_rest(head: Head) -> None:
    np.testing.assert_allclose(axes(head, Pose()), [[0, 0, 1], [0, 0, 1]], atol=1e-6)


def test_gaze_targets_rotate_the_eyes(head: Head) -> None:
    left, right = axes(head, Pose({"eyeLookOutLeft": 1, "eyeLookInRight": 1}))  # both to the head's left
    assert left[0] > 0.4 and right[0] > 0.4 and abs(left[1]) < 1e-6
    up, still = axes(head, Pose({"eyeLookUpLeft": 0.5}))
    assert up[1] > 0.1 and still[1] == pytest.approx(0, abs=1e-6)


def test_given_rotation_adds_to_the_gaze(head: Head) -> None:
    both = axes(head, Pose({"eyeLookOutLeft": 1}, {"eye.L": (0, -28, 0)}))
    np.testing.assert_allclose(both[0], [0, 0, 1], atol=1e-6)


def test_apex_lies_on_the_axis_of_the_eye_frame(head: Head) -> None:
    pose = Pose({"eyeLookOutLeft": 0.7}, {"head": (5, 20, 10)})
    assert head.eyes is not None
    pose_arrays = pose.to_arrays(head.control_rig)
    frames = head.eyes.eye_matrices(head.control_rig, pose_arrays)
    apexes = head.control_rig.pose_points(head.eyes.apex, pose_arrays)
    for frame, apex in zip(frames, apexes, strict=True):
        np.testing.assert_allclose((frame @ np.append(apex, 1))[:3], [0, 0, apex_mm()], atol=0.1)


@pytest.mark.parametrize("place", [(0, 0, 600), (120, 40, 500), (-80, -60, 400)])
def test_both_eyes_converge(head: Head, place: tuple[float, float, float]) -> None:
    """The eyes converge with the head turned too."""
    pose = looking_at(head, place, Pose(bones={"head": (0, 8, 0)}))
    assert head.eyes is not None
    at = np.append(np.add(place, head.centre_mm), 1.0)
    for frame in head.eyes.eye_matrices(head.control_rig, pose.to_arrays(head.control_rig)):
        x, y, z = (frame @ at)[:3]
        assert np.degrees(np.arctan2(np.hypot(x, y), z)) < 1.0


def test_gaze_needs_eyes_and_a_target_point(head: Head) -> None:
    with pytest.raises(DermisError, match="eyes that turn"):
        looking_at(replace(head, eyes=None), (0, 0, 500))
    with pytest.raises(DermisError, match="3 numbers"):
        looking_at(head, (0, float("nan"), 500))


def eye_pixels(renderer: Renderer, person: Human, weight: float) -> int:
    """Return the number of pixels that show an eye."""
    head = person.head()
    materials = tuple(
        replace(one, colour=(0.0, 1.0, 0.0) if "eye" in one.name else (0.0, 0.0, 0.0))
        for one in head.mesh.materials
    )
    plain = replace(head, mesh=replace(head.mesh, materials=materials), eyes=None)
    middle = tuple(float(c) for c in np.array([0.0, 0.0, 0.0]) - head.centre_mm)
    camera = Camera(position=(middle[0], middle[1], middle[2] + 600), target=middle, frame_mm=110.0)
    lamp = DirectionalLight(direction=(0, 0, -1), irradiance=(3, 3, 3), shadows=False)
    pose = {"eyeBlinkLeft": weight, "eyeBlinkRight": weight}
    settings = settings_of(size=(256, 128), atlas=256, parts="diffuse", samples=4)
    shown = renderer.draw(Scene(plain, lights=(lamp,), camera=camera, pose=pose), settings).linear()
    return int((shown[..., 1] > 2 * shown[..., 0] + 0.05).sum())


@pytest.mark.parametrize("seed", [None, 0, 5, 9])
def test_closed_lids_leave_no_gap(renderer: Renderer, seed: int | None) -> None:
    person = Human() if seed is None else Human.sampled(seed)
    assert eye_pixels(renderer, person, 0.0) > 150
    assert eye_pixels(renderer, person, 1.0) == 0


@pytest.mark.parametrize("white", [False, True])
def test_uniform_light_bounds_the_radiance(renderer: Renderer, head: Head, white: bool) -> None:
    """In uniform light eyes, brows and lashes are no brighter than it; thin parts are left out."""
    middle = tuple(float(c) for c in -np.array(head.centre_mm))
    skin = Maps(colour=np.ones((4, 4, 3), np.float32)) if white else head.maps
    camera = Camera(position=(middle[0], middle[1], middle[2] + 600), target=middle, frame_mm=120.0)
    scene = Scene(replace(head, maps=skin), lights=(), camera=camera, environment=Environment(name="uniform"))
    shown = renderer.draw(scene, settings_of(size=(160, 80), atlas=256, transmission="none")).linear()
    assert shown.max() < 1.02


def test_eye_appearance_changes_the_iris_only(renderer: Renderer, head: Head) -> None:
    assert head.eyes is not None
    middle = tuple(float(c) for c in -np.array(head.centre_mm))
    camera = Camera(position=(middle[0], middle[1], middle[2] + 600), target=middle, frame_mm=110.0)
    lamp = DirectionalLight(direction=(0, 0, -1), irradiance=(3, 3, 3))
    shown = []
    for eumelanin in (0.05, 0.95):
        one = replace(head, eyes=head.eyes.with_look(EyeLook(eumelanin)))
        shown.append(
            renderer.draw(
                Scene(one, lights=(lamp,), camera=camera), settings_of(size=(220, 110), atlas=256)
            ).linear()
        )
    changed = np.abs(shown[0] - shown[1]).max(axis=-1) > 1e-3
    assert 0.005 < changed.mean() < 0.08
    blue, brown = (one[changed].mean(axis=0) for one in shown)
    assert blue[2] / blue[0] > 1.3 * brown[2] / brown[0]


@pytest.mark.parametrize(
    "wrong", [{"eumelanin": 1.2}, {"pupil_mm": 0.5}, {"seed": 0.5}, {"redness": float("nan")}]
)
def test_invalid_eye_appearance_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(DermisError, match=f"eyes: {next(iter(wrong))}"):
        EyeLook(**wrong)  # type: ignore[arg-type]


def catchlight(renderer: Renderer, head: Head, light: RectangleLight) -> Floats:
    """Return the specular radiance (n, n) of 12 mm around the left cornea."""
    assert head.eyes is not None
    x, y, z = head.control_rig.positions_mm[head.eyes.apex[0]] - np.array(head.centre_mm)
    camera = Camera(position=(x, y, z + 500.0), target=(x, y, z), frame_mm=12.0)
    settings = settings_of(size=(120, 120), atlas=64, parts="specular", technique="none", strands=False)
    drawn = renderer.draw(Scene(head, lights=(light,), camera=camera), settings).linear()
    return np.asarray(drawn.mean(axis=-1), np.float64)


def test_tears_mirror_a_softbox_with_sharp_edges(renderer: Renderer, head: Head) -> None:
    """The picture of a square in a convex mirror: its size, its radiance, and the width of its edge."""
    side, distance = 400.0, 1000.0
    light = RectangleLight(
        (0.0, 0.0, distance), irradiance=(3, 3, 3), width_mm=side, height_mm=side, shadows=False
    )
    seen = catchlight(renderer, head, light)[20:100, 20:100]
    radiance = 3.0 * distance**2 / side**2
    bright = np.median(seen[seen > 0.5 * seen.max()])
    assert 0.018 < bright / radiance < 0.035  # reflectance of water and cornea at normal incidence
    # a mirror of focal length R / 2 shows a distant light of angle w with a side of w R / 2
    expected_mm = side / (distance - 20.0) * CORNEA_MM / 2.0
    assert np.sqrt((seen > 0.5 * bright).sum()) * 0.1 == pytest.approx(expected_mm, rel=0.1)
    between = ((seen > 0.1 * bright) & (seen < 0.9 * bright)).sum()
    assert between < 0.9 * (seen > 0.5 * bright).sum()
