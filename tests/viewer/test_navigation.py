"""Camera and light navigation, and picking."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dermis.apps.viewer.navigation import (
    CameraEasing,
    camera_axes,
    dolly,
    drag_light,
    focus,
    interpolate_cameras,
    orbit,
    orbit_light,
    pan,
    pick,
)
from dermis.apps.viewer.state import ViewerState
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix
from dermis.scene import Camera, Environment, Scene
from dermis.scene.camera import CAMERA_PRESETS, camera_preset
from dermis.scene.lights import DirectionalLight, SpotLight

CAMERA = Camera(position=(0.0, 0.0, 1000.0), target=(0.0, 0.0, 0.0), frame_mm=300.0)


def distance(camera: Camera) -> float:
    return float(np.linalg.norm(np.subtract(camera.position, camera.target)))


def test_quarter_turn_shows_the_side() -> None:
    turned = orbit(CAMERA, math.pi / 2, 0.0)
    assert np.allclose(turned.position, (1000.0, 0.0, 0.0), atol=1e-9)
    assert turned.target == CAMERA.target


def test_orbit_keeps_the_distance_and_never_goes_over_the_top() -> None:
    camera = CAMERA
    for _ in range(50):
        camera = orbit(camera, 0.3, 0.2)
        assert distance(camera) == pytest.approx(1000.0)
    away = np.subtract(camera.position, camera.target) / 1000.0
    assert math.asin(away[1]) == pytest.approx(math.radians(85.0))
    assert np.isfinite(camera_axes(camera)).all()


def test_orbit_and_reverse_orbit_return() -> None:
    back = orbit(orbit(CAMERA, 0.7, 0.4), -0.7, -0.4)
    assert np.allclose(back.position, CAMERA.position, atol=1e-9)


def test_pan_moves_by_the_height_of_the_image() -> None:
    moved = pan(CAMERA, 0.0, 1.0)
    assert np.allclose(moved.target, (0.0, 300.0, 0.0)) and distance(moved) == pytest.approx(1000.0)


def test_dolly_scales_distance_and_frame_until_a_minimum() -> None:
    near = dolly(CAMERA, 0.5)
    assert (distance(near), near.frame_mm) == (pytest.approx(500.0), pytest.approx(150.0))
    close = CAMERA
    for _ in range(30):
        close = dolly(close, 0.8)
    assert distance(close) == pytest.approx(90.0) and close.frame_mm == pytest.approx(4.0)
    far = dolly(close, 2.0)
    assert far.frame_mm == pytest.approx(8.0) and distance(far) >= 90.0


def test_focus_keeps_direction_and_distance() -> None:
    there = focus(CAMERA, (10.0, 20.0, 30.0))
    assert there.target == (10.0, 20.0, 30.0)
    assert np.allclose(np.subtract(there.position, there.target), (0.0, 0.0, 1000.0))


@pytest.mark.parametrize("name", CAMERA_PRESETS)
def test_presets_look_at_the_head(name: str, head: Head) -> None:
    assert pick(Scene(head), camera_preset(name, head), 0.0, 0.0, 1.0) is not None


def test_picking_the_centre_hits_the_front_of_the_head(head: Head) -> None:
    place = pick(Scene(head), CAMERA, 0.0, 0.0, 1.0)
    p = head.mesh.positions - np.array(head.centre_mm)
    assert place is not None
    assert abs(place[0]) < 1e-6 and abs(place[1]) < 1e-6
    assert place[2] == pytest.approx(float(p[:, 2].max()), rel=0.03)


def test_picked_point_lies_on_the_ray_of_its_pixel(head: Head) -> None:
    x, y, aspect = 0.2, -0.3, 1.5
    place = pick(Scene(head), CAMERA, x, y, aspect)
    assert place is not None
    right, up, forward = camera_axes(CAMERA)
    ray = place - np.array(CAMERA.position)
    half = 0.5 * CAMERA.frame_mm / distance(CAMERA)
    assert ray @ right / (ray @ forward) == pytest.approx(aspect * x * half)
    assert ray @ up / (ray @ forward) == pytest.approx(y * half)


def test_picked_point_follows_the_pose(rigged_head: Head) -> None:
    """A camera that rotates with the head picks the same point."""
    degrees = 40.0
    turned = Scene(rigged_head, pose=Pose({"jawOpen": 0.8}, {"neck": (0.0, degrees, 0.0)}))
    open_jaw = pick(Scene(rigged_head, pose={"jawOpen": 0.8}), CAMERA, 0.1, -0.3, 1.0)
    rest_pose = pick(Scene(rigged_head), CAMERA, 0.1, -0.3, 1.0)
    found = pick(turned, orbit(CAMERA, math.radians(degrees), 0.0), 0.1, -0.3, 1.0)
    assert open_jaw is not None and rest_pose is not None and found is not None
    assert abs(open_jaw - rest_pose).max() > 1.0
    assert np.allclose(found, np.array(angles_matrix((0.0, degrees, 0.0))) @ open_jaw, atol=0.01)


def test_picking_beside_the_head_finds_nothing(head: Head) -> None:
    assert pick(Scene(head), CAMERA, 0.99, 0.99, 1.0) is None


def test_easing_does_not_depend_on_the_frame_rate() -> None:
    wanted = dolly(orbit(CAMERA, 0.4, 0.2), 0.6)
    slow, fast = CameraEasing(CAMERA), CameraEasing(CAMERA)
    slow.advance(wanted, 0.06)
    for _ in range(12):
        fast.advance(wanted, 0.005)
    off = np.abs(np.subtract(slow.camera.position, fast.camera.position)).max()
    assert off < 0.03 * np.linalg.norm(np.subtract(slow.camera.position, CAMERA.position))


def test_easing_arrives_and_stays() -> None:
    easing, wanted = CameraEasing(CAMERA), pan(orbit(CAMERA, 1.0, 0.3), 0.2, 0.1)
    for _ in range(40):
        easing.advance(wanted, 0.03)
    assert easing.camera is wanted


def test_easing_between_opposite_sides_avoids_the_head() -> None:
    behind = orbit(CAMERA, math.pi, 0.0)
    assert distance(interpolate_cameras(CAMERA, behind, 0.5)) == pytest.approx(1000.0)


def test_a_light_is_carried_around_its_target() -> None:
    light = SpotLight(position=(0.0, 0.0, 800.0))
    moved = orbit_light(light, CAMERA, math.pi / 2, 0.0)
    assert isinstance(moved, SpotLight)
    assert np.allclose(moved.position, (800.0, 0.0, 0.0)) and moved.irradiance == light.irradiance
    raised = orbit_light(light, CAMERA, 0.0, math.pi / 2)
    assert isinstance(raised, SpotLight)
    assert np.allclose(raised.position, (0.0, 800.0, 0.0))


def test_parallel_light_turns_its_direction() -> None:
    moved = orbit_light(DirectionalLight(direction=(0, 0, -2)), CAMERA, math.pi / 2, 0.0)
    assert isinstance(moved, DirectionalLight) and np.allclose(moved.direction, (-2.0, 0.0, 0.0))


def test_without_lights_the_environment_turns(state: ViewerState) -> None:
    around = state.with_light_preset("none").with_environment(
        Environment(name="uniform", rotation_degrees=170.0)
    )
    turned = drag_light(around, 0, math.radians(20.0), 0.0).scene.environment
    assert turned is not None and turned.rotation_degrees == pytest.approx(-170.0)
