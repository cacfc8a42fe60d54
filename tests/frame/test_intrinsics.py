"""OpenCV cameras: points project by K, R and t, and crops are parts of pictures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import head_of

import dermis
from dermis.apps.truths.scene_description import check_camera
from dermis.apps.viewer.navigation import pick
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import surface_points
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere
from dermis.scene.settings import Settings

SIZE = (96, 64)
K = np.array([[210.0, 0.0, 61.3], [0.0, 260.0, 20.6], [0.0, 0.0, 1.0]])  # fx != fy, far off the middle


def rotation(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return the rotation of a camera that looks along -Z and is slightly turned."""
    made = np.diag([1.0, -1.0, -1.0])
    for axis, angle in enumerate(np.radians(degrees)):
        turn = np.eye(3)
        one, other = [k for k in range(3) if k != axis]
        turn[one, one] = turn[other, other] = math.cos(angle)
        turn[one, other], turn[other, one] = -math.sin(angle), math.sin(angle)
        made = turn @ made
    return made


R, T = rotation((8.0, -14.0, 5.0)), np.array([12.0, 40.0, 640.0])


@pytest.fixture(scope="module")
def head() -> Head:
    ball = uv_sphere(60.0, 48, 24)
    return head_of(
        replace(ball, positions=ball.positions * np.float32([0.9, 1.2, 1.0]) + np.float32([3, -7, 5]))
    )


def test_points_project_as_the_matrices_state(renderer: Renderer, head: Head) -> None:
    camera = dermis.Camera.from_opencv(K, R, T, SIZE)
    scene = dermis.Scene(head, camera=camera)
    points = surface_points(renderer, scene, Settings(size=SIZE, atlas=64))
    mesh = head.mesh
    corners = mesh.positions[mesh.triangles[points.triangle]].astype(float) - head.centre_mm
    places = (points.barycentric[..., None] * corners).sum(axis=1)
    seen = (places @ R.T + T) @ K.T
    rows, columns = np.nonzero(points.mask)
    assert 500 < len(rows) < 0.9 * SIZE[0] * SIZE[1]
    np.testing.assert_allclose(seen[:, 0] / seen[:, 2], columns, atol=0.02)
    np.testing.assert_allclose(seen[:, 1] / seen[:, 2], rows, atol=0.02)


def test_a_click_in_the_viewer_finds_the_same_points(head: Head) -> None:
    scene = dermis.Scene(head, camera=dermis.Camera.from_opencv(K, R, T, SIZE))
    for column, row in ((61, 20), (75, 12), (55, 30)):
        x, y = 2 * (column + 0.5) / SIZE[0] - 1, 1 - 2 * (row + 0.5) / SIZE[1]
        place = pick(scene, scene.camera, x, y, SIZE[0] / SIZE[1])
        assert place is not None
        seen = K @ (R @ place + T)
        np.testing.assert_allclose(seen[:2] / seen[2], (column, row), atol=1e-6)


def test_intrinsics_survive_a_round_trip() -> None:
    camera = dermis.Camera.from_opencv(K, R, T[:, None], SIZE)
    for back, given in zip(camera.to_opencv(SIZE), (K, R, T), strict=True):
        np.testing.assert_allclose(back, given, atol=1e-9)
    behind = dermis.Camera.from_opencv(K, R, -T, SIZE)  # looks away from the head
    np.testing.assert_allclose(behind.to_opencv(SIZE).t, -T, atol=1e-9)


def test_default_principal_point_is_the_centre() -> None:
    camera = dermis.Camera(position=(0, 0, 1000), frame_mm=200)
    k, turned, moved = camera.to_opencv((400, 300))
    np.testing.assert_allclose(k, [[1500, 0, 199.5], [0, 1500, 149.5], [0, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(turned, np.diag([1, -1, -1]), atol=1e-12)
    np.testing.assert_allclose(moved, (0, 0, 1000), atol=1e-9)


@pytest.mark.parametrize("technique", ["none", "screen-space", "texture-space"])
def test_a_crop_is_a_part_of_the_whole_picture(renderer: Renderer, head: Head, technique: str) -> None:
    """Hair, screen-space blurs and the background use the principal point."""
    size, (left, top), part = (96, 96), (20, 9), (48, 40)
    k = np.array([[150.0, 0.0, 47.5], [0.0, 150.0, 47.5], [0.0, 0.0, 1.0]])
    moved = k - [[0, 0, left], [0, 0, top], [0, 0, 0]]
    around = dermis.Environment(name="uniform")
    settings = {"atlas": 128, "technique": technique, "samples": 2, "background": "environment"}
    images = []
    for matrix, wanted in ((k, size), (moved, part)):
        camera = dermis.Camera.from_opencv(matrix, R, (0, 0, 300), wanted)
        scene = dermis.Scene(head, lights=dermis.studio(), camera=camera, environment=around)
        images.append(renderer.render(scene, size=wanted, **settings))
    whole = images[0][top : top + part[1], left : left + part[0]]
    inner = slice(6, -6)  # a blur in the picture lacks what lies beyond its edges
    np.testing.assert_allclose(images[1][inner, inner], whole[inner, inner], rtol=2e-3, atol=2e-3)


def test_strands_are_cropped_too(renderer: Renderer) -> None:
    human = dermis.load_head("human")
    eye = {"position": (30, 22, 500), "target": (30, 22, 80)}
    whole = dermis.Camera(**eye, frame_mm=60)
    lower = whole.replace(frame_mm=30, principal_point=(0.5, 0.0))  # the lower half of its height
    both = [
        renderer.render(dermis.Scene(human, camera=camera), size=size, atlas=256, technique="none")
        for camera, size in ((whole, (64, 64)), (lower, (64, 32)))
    ]
    difference = np.abs(both[0][32:] - both[1])
    assert np.percentile(difference, 99) < 0.01 and both[1].std() > 0.02
    bald = renderer.render(
        dermis.Scene(replace(human, strands=None), camera=lower), size=(64, 32), atlas=256, technique="none"
    )
    assert np.abs(bald - both[1]).max() > 0.05  # there are hairs in the picture


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"K": [[200, 9, 48], [0, 200, 32], [0, 0, 1]]},
            "K: expected pixels with right .* skew is 9",
        ),
        ({"K": np.diag([1.0, -1.0, 1.0])}, "K: expected fx, fy above 0"),
        ({"K": np.eye(4)}, r"K: expected numbers of shape \(3, 3\) .*, but got shape \(4, 4\)"),
        ({"K": "camera.yml"}, "K: expected numbers"),
        ({"R": 2 * R}, "R: expected a rotation matrix"),
        ({"R": np.diag([1.0, 1.0, -1.0])}, "R: .*its determinant is -1"),
        ({"R": (0.1, 0.2, 0.3)}, r"R: expected numbers of shape \(3, 3\)"),
        ({"t": (0, 0)}, "t: expected numbers"),
        ({"t": (0, 0, np.nan)}, "t: expected numbers"),
    ],
)
def test_invalid_cameras_are_refused(given: dict, said: str) -> None:
    with pytest.raises(DermisError, match=said):
        dermis.Camera.from_opencv(**{"K": K, "R": R, "t": T, "size": SIZE} | given)


def test_other_renderers_refuse_intrinsics() -> None:
    check_camera(dermis.Camera((0, 0, 900)), "Mitsuba")
    with pytest.raises(DermisError, match="in the middle and square pixels, for Mitsuba"):
        check_camera(dermis.Camera.from_opencv(K, R, T, SIZE), "Mitsuba")
