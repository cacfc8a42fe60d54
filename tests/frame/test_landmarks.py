"""Landmarks, head pose and gaze agree with the picture for people who move and turn."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from observed import around, labelled, marks
from setups import head_of

from dermis.base.errors import DermisError
from dermis.frame.observation import Observation
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

ALIKE_MM = 0.05
"""By which a symmetric person's landmarks differ from their mirrored opposites: steps of the tables."""


@pytest.mark.parametrize("who", ["mean", "drawn"])
def test_nose_tip_is_nearest_to_the_camera(seen: dict[str, Observation], who: str) -> None:
    depth, nose = seen[who].outputs["depth"], labelled(seen[who], "nose")
    nearest = np.argwhere(nose & (depth == depth[nose].min()))[0][::-1]
    tip = marks(seen["mean"]).positions_mm[30]
    assert tip[2] == marks(seen["mean"]).positions_mm[:, 2].max()
    if who == "mean":
        assert np.linalg.norm(nearest - marks(seen[who]).pixels[30]) < 4


def test_all_landmarks_are_projected_by_the_camera(seen: dict[str, Observation]) -> None:
    for one in seen.values():
        for found in one.landmarks.values():
            x = found.positions_mm @ one.camera.R.T + one.camera.t
            pixels = x @ one.camera.K.T
            assert np.abs(pixels[:, :2] / pixels[:, 2:] - found.pixels).max() < 1e-3


def test_landmarks_of_a_symmetric_person_are_symmetric(seen: dict[str, Observation]) -> None:
    places = marks(seen["mean"]).positions_mm
    jaw = list(zip(range(8), range(16, 8, -1), strict=True))
    for right, left in [*jaw, (36, 45), (39, 42), (37, 44), (41, 46), (31, 35), (48, 54), (59, 55), (17, 26)]:
        assert np.abs(places[right] * [-1, 1, 1] - places[left]).max() < ALIKE_MM, (right, left)
    assert np.abs(places[[8, 27, 28, 29, 30, 33, 51, 57, 62, 66], 0]).max() < ALIKE_MM


@pytest.mark.parametrize("who", ["mean", "drawn"])
def test_landmark_order_is_that_of_ibug(seen: dict[str, Observation], who: str) -> None:
    x, y = marks(seen[who]).pixels.T
    assert (np.diff(x[17:27]) > 0).all() and (np.diff(y[27:31]) > 0).all()  # brows, bridge
    assert x[36] < x[39] < x[42] < x[45] and (np.diff(x[48:55]) > 0).all() and (np.diff(x[54:60]) < 0).all()
    assert y[:9].argmax() == 8 and x[0] < x[8] < x[16] and x[68] < x[69]
    assert (y[37:39] < y[40:42][::-1]).all() and (y[61:64] <= y[65:68][::-1] + 1).all()


def test_occluded_landmarks_are_not_visible(seen: dict[str, Observation]) -> None:
    front, side, shut = (marks(seen[name]).visible for name in ("mean", "side", "shut"))
    assert front[17:].all()
    assert not side[[36, 37, 38, 41, 68, 17, 18, 19, 0, 1, 2]].any()  # the far side
    assert side[[26, 45, 54, 30, 27, 15, 14]].all()
    assert shut[68] and not shut[69]  # the pupil under the lid


def test_head_pose_follows_its_bone(seen: dict[str, Observation]) -> None:
    rest, turned = seen["mean"], seen["turned"]
    assert rest.head_pose == pytest.approx(np.column_stack([rest.camera.R, rest.camera.t]), abs=1e-6)
    places = marks(rest).positions_mm[[27, 28, 36, 45]].astype(float)  # rigid parts of the head
    moved = marks(turned).positions_mm[[27, 28, 36, 45]] @ turned.camera.R.T + turned.camera.t
    carried = places @ turned.head_pose[:, :3].T + turned.head_pose[:, 3]
    assert np.abs(carried - moved).max() < 0.5
    assert turned.head_pose[:, :3] @ turned.head_pose[:, :3].T == pytest.approx(np.eye(3), abs=1e-5)


def test_gaze_is_along_the_axes_of_the_eyes(seen: dict[str, Observation]) -> None:
    gaze = seen["mean"].gaze
    assert gaze is not None and gaze == pytest.approx(np.tile([0.0, 0.0, -1.0], (2, 1)), abs=0.02)
    turned = seen["turned"].gaze
    assert turned is not None
    assert turned[0] == pytest.approx(seen["turned"].head_pose[:, :3] @ [0, 0, 1], abs=0.02)
    assert turned[0, 0] > 0.3 and turned[0, 1] > 0.1  # to the picture's right, and down


@pytest.fixture
def ball() -> Iterator[Head]:
    yield head_of(uv_sphere(60.0, 12, 8), colour=np.full((4, 4, 3), 0.5))


def test_a_table_by_vertex_works_for_any_mesh(renderer: Renderer, ball: Head, tmp_path: Path) -> None:
    table = tmp_path / "mine.csv"
    table.write_text("# mine\nname,vertex\nfirst,0\nother,7\n")
    scene = Scene(ball, camera=around(ball))
    (one,) = renderer.observe([scene], Settings(size=32, atlas=64), landmarks=(str(table),))
    found = one.landmarks[str(table)]
    assert found.names == ("first", "other")
    assert found.positions_mm == pytest.approx(ball.positions_mm[[0, 7]] - ball.centre_mm, abs=1e-3)
    assert one.gaze is None and one.outputs == {}


def test_invalid_tables_are_refused(renderer: Renderer, ball: Head, tmp_path: Path) -> None:
    scene = Scene(ball, camera=around(ball))
    with pytest.raises(DermisError, match="topology of its own"):
        next(renderer.observe([scene], landmarks=("ibug-68",)))
    with pytest.raises(DermisError, match="ibug-68, face-synthetics-70, mediapipe"):
        renderer.observe([scene], landmarks=("ibug",))
    table = tmp_path / "mine.csv"
    for text in ("name,vertex\n", "name,place\na,1\n", "name,vertex\na,100000\n", "name,vertex\na,b\n"):
        table.write_text(text)
        with pytest.raises(DermisError, match=r"mine\.csv"):
            next(renderer.observe([scene], landmarks=(str(table),)))
