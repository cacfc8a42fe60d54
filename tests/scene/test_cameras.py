"""Camera presets show the whole head, from the side in their name."""

from __future__ import annotations

import numpy as np
import pytest
from small_head import SIZE, write_head

from dermis.frame.features.shading.view import camera_views, world_space_pinhole
from dermis.mesh.head import Head
from dermis.scene import Camera, Settings
from dermis.scene.camera import CAMERA_PRESETS
from dermis.scene.heads import load_head


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Head:
    return load_head(write_head(tmp_path_factory.mktemp("head") / "head.obj"), subdivide=0)


def _seen(camera: Camera, head: Head, points: np.ndarray) -> np.ndarray:
    """Project points [mm from the head's centre] into the picture: x to the right, y up, -1 to 1."""
    (clip,) = camera_views(
        world_space_pinhole(camera, head, Settings(size=(64, 64))), head.mesh.outline, 1
    ).clips
    world = np.column_stack((points + head.centre_mm, np.ones(len(points))))
    x, y, _, w = clip @ world.T
    assert (w > 0).all()
    return np.column_stack((x / w, y / w))


def test_centre_of_a_small_head_is_its_bounding_box_centre(head: Head) -> None:
    np.testing.assert_allclose(head.centre_mm, 0, atol=1e-3)


@pytest.mark.parametrize("name", ["portrait", "three-quarter", "profile"])
def test_the_whole_head_is_in_the_image(head: Head, name: str) -> None:
    seen = _seen(CAMERA_PRESETS[name](head), head, head.mesh.positions - np.float32(head.centre_mm))
    assert np.abs(seen).max() < 0.95
    assert np.ptp(seen[:, 1]) > 1.2  # and fills most of it
    assert np.abs(_seen(CAMERA_PRESETS[name](head), head, np.zeros((1, 3)))).max() < 0.25


@pytest.mark.parametrize("name", CAMERA_PRESETS)
def test_up_is_up_and_the_camera_is_level(head: Head, name: str) -> None:
    camera = CAMERA_PRESETS[name](head)
    below, above = _seen(camera, head, np.array([[0.0, -20.0, 0.0], [0.0, 20.0, 0.0]]))
    assert above[1] > below[1]
    assert above[0] == pytest.approx(below[0], abs=1e-3)


@pytest.mark.parametrize(("name", "degrees"), [("portrait", 0), ("three-quarter", 40), ("profile", 90)])
def test_preset_azimuth_increases_to_the_left_of_the_head(head: Head, name: str, degrees: float) -> None:
    camera = CAMERA_PRESETS[name](head)
    x, y, z = np.subtract(camera.position, camera.target)
    assert y == pytest.approx(0, abs=1e-6)
    assert np.degrees(np.arctan2(x, z)) == pytest.approx(degrees, abs=1e-3)


def test_headshot_shows_the_face_in_a_three_quarter_view(head: Head) -> None:
    camera = CAMERA_PRESETS["headshot"](head)
    assert 190 <= camera.frame_mm <= 220
    x, y, z = np.subtract(camera.position, camera.target)
    assert 20 < np.degrees(np.arctan2(x, z)) < 35
    assert 0 < np.degrees(np.arctan2(y, np.hypot(x, z))) < 6
    brow, chin = _seen(camera, head, np.array([[0.0, 45.0, 85.0], [0.0, -85.0, 75.0]]))[:, 1]
    assert -1 < chin < brow < 1 and brow - chin > 1.1


def test_nose_points_to_the_left_of_a_profile_from_the_heads_left(head: Head) -> None:
    nose, back = _seen(
        CAMERA_PRESETS["profile"](head), head, np.array([[0.0, 0.0, SIZE[2] / 2], [0.0, 0.0, -SIZE[2] / 2]])
    )
    assert nose[0] < 0 < back[0]


def test_cheek_looks_at_the_surface_of_the_left_front(head: Head) -> None:
    camera = CAMERA_PRESETS["cheek"](head)
    assert camera.target[0] > 0 and camera.target[2] > 0
    assert camera.position[0] > camera.target[0] and camera.position[2] > camera.target[2]
    x, y, z = np.array(camera.target) / (np.array(SIZE) / 2)
    assert x**2 + y**2 + z**2 == pytest.approx(1, abs=0.06)
