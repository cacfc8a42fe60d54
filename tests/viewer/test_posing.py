"""Edits of poses, and the posed surface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dermis.apps.viewer.posing import (
    bone_angles,
    filter_names,
    posed_positions,
    poses_equal,
    reset_pose,
    target_weight,
    with_bone_angles,
    with_target_weight,
)
from dermis.apps.viewer.state import UndoHistory, ViewerState, load_state, save_state, states_equal
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose, merge_poses
from dermis.mesh.rig import Rig
from dermis.mesh.rotations import angles_matrix
from dermis.scene import Scene
from dermis.scene.heads import load_head


def test_slider_changes_its_weight_only(rigged_head: Head) -> None:
    scene = Scene(rigged_head, pose=Pose({"jawOpen": 0.2}, {"head": (5.0, 0.0, 0.0)}))
    found = with_target_weight(scene, "browInnerUp", 0.75)
    assert found is not None
    assert dict(found.weights) == {"jawOpen": 0.2, "browInnerUp": 0.75} and set(found.bones) == {"head"}
    assert target_weight(scene, "jawOpen") == 0.2 and target_weight(scene, "browInnerUp") == 0.0


def test_reset_target_is_at_rest(rigged_head: Head) -> None:
    moved = Scene(rigged_head, pose={"jawOpen": 0.2})
    assert with_target_weight(moved, "jawOpen", 0.0) is None
    turned = Scene(rigged_head, pose=Pose(bones={"neck": (1.0, 2.0, 3.0)}))
    assert with_bone_angles(turned, "neck", (0.0, 0.0, 0.0)) is None
    assert reset_pose(turned) is None


def test_rest_weight_is_shown(rigged_head: Head) -> None:
    targets = replace(rigged_head.control_rig.targets, rest=np.array([0.5, 0, 0, 0], np.float32))
    rig = Rig(rigged_head.positions_mm, targets)
    scene = Scene(replace(rigged_head, rig=rig))
    assert target_weight(scene, "jawOpen") == 0.5
    closed = with_target_weight(scene, "jawOpen", 0.0)
    assert closed is not None and dict(closed.weights) == {"jawOpen": 0.0}


def test_the_person_stays_at_rest(rigged_head: Head) -> None:
    person = 1.1 * rigged_head.positions_mm
    scene = Scene(rigged_head, pose=Pose({"jawOpen": 1.0}, positions_mm=person))
    rest = reset_pose(scene)
    assert rest is not None and rest.positions_mm is person and not rest.weights


def test_angles_match_the_rotation_matrix(rigged_head: Head) -> None:
    skeleton = rigged_head.control_rig.skeleton
    assert skeleton is not None
    local = skeleton.local[1].copy()
    local[:3, :3] = 1.3 * np.array(angles_matrix((10.0, -20.0, 30.0)))
    scene = Scene(rigged_head, pose=Pose(bones={"head": local}))
    assert bone_angles(scene, "head") == pytest.approx((10.0, -20.0, 30.0))
    assert bone_angles(scene, "neck") == (0.0, 0.0, 0.0)


def test_moves_keep_unnamed_targets(rigged_head: Head) -> None:
    before = Pose({"jawOpen": 0.1, "browInnerUp": 0.4}, {"neck": (1.0, 0.0, 0.0)})
    found = merge_poses(Pose({"jawOpen": 0.9}, {"head": (0.0, 5.0, 0.0)}), before)
    assert dict(found.weights) == {"jawOpen": 0.9, "browInnerUp": 0.4}
    assert set(found.bones) == {"neck", "head"} and found.positions_mm is None


def test_poses_are_compared_by_value() -> None:
    assert poses_equal(None, Pose()) and poses_equal({"a": 0.5}, Pose({"a": 0.5}))
    assert poses_equal(Pose(bones={"a": (1.0, 2.0, 3.0)}), Pose(bones={"a": np.array([1.0, 2.0, 3.0])}))
    assert not poses_equal(Pose({"a": 0.5}), Pose({"a": 0.4}))
    assert not poses_equal(Pose(bones={"a": (1.0, 2.0, 3.0)}), Pose(bones={"a": np.eye(4)}))
    places = np.zeros((3, 3), np.float32)
    assert not poses_equal(Pose(positions_mm=places), Pose(positions_mm=places.copy()))


def test_names_are_found_by_substring() -> None:
    names = ("jawOpen", "mouthSmileLeft", "mouthSmileRight")
    assert filter_names(names, " SMILE ") == ["mouthSmileLeft", "mouthSmileRight"]
    assert filter_names(names, "") == list(names) and filter_names(names, "ear") == []


@pytest.mark.parametrize("levels", [0, 1])
def test_posed_surface_is_the_rotated_head(rigged_file: Path, levels: int) -> None:
    head = load_head(rigged_file, subdivide=levels)
    pose = Pose(bones={"neck": (0.0, 90.0, 0.0)})
    turned, rest = posed_positions(Scene(head, pose=pose)), head.mesh.positions
    np.testing.assert_allclose(turned, np.column_stack([rest[:, 2], rest[:, 1], -rest[:, 0]]), atol=1e-3)
    assert posed_positions(Scene(head)) is rest


def test_pose_is_an_undo_step(rigged: ViewerState) -> None:
    history = UndoHistory(rigged)
    history.change(rigged.with_pose(Pose({"jawOpen": 0.5})))
    assert history.can_undo
    history.change(history.state.with_pose(Pose({"jawOpen": 0.5})))
    history.undo()
    assert history.state is rigged


def test_saved_pose_is_restored(rigged: ViewerState, tmp_path: Path) -> None:
    skeleton = rigged.scene.head.control_rig.skeleton
    assert skeleton is not None
    pose = Pose({"jawOpen": 1 / 3}, {"neck": (1.0, -2.0, 0.1), "head": skeleton.local[1]})
    moved = replace(rigged.with_pose(pose), light_preset="")
    save_state(tmp_path / "scene.toml", moved)
    assert states_equal(load_state(tmp_path / "scene.toml", moved), moved)
    assert not states_equal(load_state(tmp_path / "scene.toml", moved), rigged)
