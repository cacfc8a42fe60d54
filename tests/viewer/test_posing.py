"""Poses made of others, and the surface that follows them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.viewer.posing import (
    angles_of,
    at_rest,
    matching,
    posed_positions,
    same_pose,
    weight_of,
    with_angles,
    with_weight,
)
from dermis.apps.viewer.state import History, ViewerState, load_state, same, save_state
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose, laid_over
from dermis.mesh.rig import Rig
from dermis.mesh.rotations import angles_matrix
from dermis.scene import Scene
from dermis.scene.heads import load_head


def test_a_slider_changes_its_own_weight(rigged_head: Head) -> None:
    scene = Scene(rigged_head, pose=Pose({"jawOpen": 0.2}, {"head": (5.0, 0.0, 0.0)}))
    found = with_weight(scene, "browInnerUp", 0.75)
    assert found is not None
    assert dict(found.weights) == {"jawOpen": 0.2, "browInnerUp": 0.75} and set(found.bones) == {"head"}
    assert weight_of(scene, "jawOpen") == 0.2 and weight_of(scene, "browInnerUp") == 0.0


def test_what_is_put_back_is_at_rest(rigged_head: Head) -> None:
    moved = Scene(rigged_head, pose={"jawOpen": 0.2})
    assert with_weight(moved, "jawOpen", 0.0) is None
    turned = Scene(rigged_head, pose=Pose(bones={"neck": (1.0, 2.0, 3.0)}))
    assert with_angles(turned, "neck", (0.0, 0.0, 0.0)) is None
    assert at_rest(turned) is None


def test_a_head_that_rests_with_a_weight_shows_it(rigged_head: Head) -> None:
    targets = replace(rigged_head.control.targets, rest=np.array([0.5, 0, 0, 0], np.float32))
    rig = Rig(rigged_head.positions_mm, targets)
    scene = Scene(replace(rigged_head, rig=rig))
    assert weight_of(scene, "jawOpen") == 0.5
    closed = with_weight(scene, "jawOpen", 0.0)
    assert closed is not None and dict(closed.weights) == {"jawOpen": 0.0}


def test_the_person_stays_at_rest(rigged_head: Head) -> None:
    person = 1.1 * rigged_head.positions_mm
    scene = Scene(rigged_head, pose=Pose({"jawOpen": 1.0}, positions_mm=person))
    rest = at_rest(scene)
    assert rest is not None and rest.positions_mm is person and not rest.weights


def test_angles_of_a_matrix_are_its_turn(rigged_head: Head) -> None:
    skeleton = rigged_head.control.skeleton
    assert skeleton is not None
    local = skeleton.local[1].copy()
    local[:3, :3] = 1.3 * np.array(angles_matrix((10.0, -20.0, 30.0)))
    scene = Scene(rigged_head, pose=Pose(bones={"head": local}))
    assert angles_of(scene, "head") == pytest.approx((10.0, -20.0, 30.0))
    assert angles_of(scene, "neck") == (0.0, 0.0, 0.0)


def test_moves_leave_what_they_do_not_name(rigged_head: Head) -> None:
    before = Pose({"jawOpen": 0.1, "browInnerUp": 0.4}, {"neck": (1.0, 0.0, 0.0)})
    found = laid_over(Pose({"jawOpen": 0.9}, {"head": (0.0, 5.0, 0.0)}), before)
    assert dict(found.weights) == {"jawOpen": 0.9, "browInnerUp": 0.4}
    assert set(found.bones) == {"neck", "head"} and found.positions_mm is None


def test_poses_are_compared_by_what_they_say() -> None:
    assert same_pose(None, Pose()) and same_pose({"a": 0.5}, Pose({"a": 0.5}))
    assert same_pose(Pose(bones={"a": (1.0, 2.0, 3.0)}), Pose(bones={"a": np.array([1.0, 2.0, 3.0])}))
    assert not same_pose(Pose({"a": 0.5}), Pose({"a": 0.4}))
    assert not same_pose(Pose(bones={"a": (1.0, 2.0, 3.0)}), Pose(bones={"a": np.eye(4)}))
    places = np.zeros((3, 3), np.float32)
    assert not same_pose(Pose(positions_mm=places), Pose(positions_mm=places.copy()))


def test_names_are_found_by_some_letters() -> None:
    names = ("jawOpen", "mouthSmileLeft", "mouthSmileRight")
    assert matching(names, " SMILE ") == ["mouthSmileLeft", "mouthSmileRight"]
    assert matching(names, "") == list(names) and matching(names, "ear") == []


@pytest.mark.parametrize("levels", [0, 1])
def test_the_posed_surface_is_the_head_turned(rigged_file: Path, levels: int) -> None:
    head = load_head(rigged_file, subdivide=levels)
    pose = Pose(bones={"neck": (0.0, 90.0, 0.0)})
    turned, rest = posed_positions(Scene(head, pose=pose)), head.mesh.positions
    np.testing.assert_allclose(turned, np.column_stack([rest[:, 2], rest[:, 1], -rest[:, 0]]), atol=1e-3)
    assert posed_positions(Scene(head)) is rest


def test_a_pose_is_a_step_of_the_history(rigged: ViewerState) -> None:
    history = History(rigged)
    history.change(rigged.with_pose(Pose({"jawOpen": 0.5})))
    assert history.can_undo
    history.change(history.state.with_pose(Pose({"jawOpen": 0.5})))
    history.undo()
    assert history.state is rigged


def test_a_saved_pose_comes_back(rigged: ViewerState, tmp_path: Path) -> None:
    skeleton = rigged.scene.head.control.skeleton
    assert skeleton is not None
    pose = Pose({"jawOpen": 1 / 3}, {"neck": (1.0, -2.0, 0.1), "head": skeleton.local[1]})
    moved = replace(rigged.with_pose(pose), rig="")
    save_state(tmp_path / "scene.toml", moved)
    assert same(load_state(tmp_path / "scene.toml", moved), moved)
    assert not same(load_state(tmp_path / "scene.toml", moved), rigged)
