"""Poses compared with formulas in double precision, and invalid poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_rig import random_rig
from scipy.spatial.transform import Rotation

from dermis.base.errors import DermisError
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import uv_sphere
from dermis.mesh.rig import Rig
from dermis.scene.model import Scene

RIG = random_rig()
SKELETON = RIG.skeleton
assert SKELETON is not None


def _about(origin: np.ndarray, degrees: tuple[float, float, float]) -> np.ndarray:
    x, y, z = degrees
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("zxy", [z, x, y], degrees=True).as_matrix()
    matrix[:3, 3] = origin - matrix[:3, :3] @ origin
    return matrix


def _origins() -> np.ndarray:
    world = [SKELETON.local[0]]
    for bone in range(1, 4):
        world.append(world[SKELETON.parent[bone]] @ SKELETON.local[bone])
    return (SKELETON.to_head @ np.array(world))[:, :3, 3]


def test_empty_pose_is_the_rest_pose() -> None:
    pose_arrays = Pose().to_arrays(RIG)
    np.testing.assert_array_equal(pose_arrays.weights, np.zeros(8))
    np.testing.assert_allclose(pose_arrays.matrices, np.tile(np.eye(3, 4), (4, 1, 1)), atol=1e-4)
    assert pose_arrays.positions_mm is RIG.positions_mm
    assert [one.dtype for one in pose_arrays] == [np.float32] * 3


def test_weights_are_stored_by_target() -> None:
    pose_arrays = Pose({"target6": 0.25, "target1": -2}).to_arrays(RIG)
    assert pose_arrays.weights.tolist() == [0, -2, 0, 0, 0, 0, 0.25, 0]


def test_weights_count_from_those_at_rest() -> None:
    targets = replace(RIG.targets, rest=np.array([0.5, 0, 0, 0, 0, 0, 0, 0.25], np.float32))
    pose_arrays = Pose({"target0": 0.0, "target1": 1.0}).to_arrays(Rig(RIG.positions_mm, targets))
    assert pose_arrays.weights.tolist() == [-0.5, 1, 0, 0, 0, 0, 0, 0]
    assert pose_arrays.matrices.shape == (0, 3, 4)


def test_angles_rotate_about_head_axes_at_the_bone() -> None:
    neck, jaw = (10.0, -40.0, 25.0), (20.0, 0.0, 0.0)
    matrices = Pose(bones={"jaw": jaw, "neck": neck}).to_arrays(RIG).matrices
    origins = _origins()
    turned = _about(origins[1], neck)
    expected = [np.eye(4), turned, turned, turned @ _about(origins[3], jaw)]
    np.testing.assert_allclose(matrices, np.array(expected)[:, :3], atol=2e-4)


def test_nod_does_not_depend_on_bone_orientation() -> None:
    pose_arrays = Pose(bones={"head": (30.0, 0.0, 0.0)}).to_arrays(RIG)
    nose = np.array([0.0, -70.0, 100.0])
    moved = pose_arrays.matrices[2, :, :3] @ nose + pose_arrays.matrices[2, :, 3]
    assert moved[0] == pytest.approx(0, abs=1e-3) and moved[1] < nose[1] - 40  # down, not to a side
    turned = Pose(bones={"head": (0.0, 30.0, 0.0)}).to_arrays(RIG).matrices[2]
    assert (turned[:, :3] @ nose + turned[:, 3])[0] > 40  # to the head's own left


@pytest.mark.parametrize("bones", [("neck", "jaw"), ("root", "neck", "head", "jaw"), ("head",)])
def test_matrices_are_relative_to_rest(bones: tuple[str, ...]) -> None:
    rng = np.random.default_rng(2)
    local = SKELETON.local.copy()
    for name in bones:
        change = np.eye(4)
        change[:3, :3] = Rotation.random(random_state=7).as_matrix() * rng.uniform(0.8, 1.2)
        change[:3, 3] = rng.normal(scale=0.01, size=3)
        local[SKELETON.index_by_name[name]] = local[SKELETON.index_by_name[name]] @ change
    pose = Pose(bones={name: local[SKELETON.index_by_name[name]] for name in bones})
    np.testing.assert_allclose(pose.to_arrays(RIG).matrices, SKELETON.matrices(local), atol=2e-4)
    listed = Pose(bones={name: local[SKELETON.index_by_name[name]].tolist() for name in bones})
    np.testing.assert_array_equal(listed.to_arrays(RIG).matrices, pose.to_arrays(RIG).matrices)


@pytest.mark.parametrize("moved", [5, 30])
def test_many_bones_match_few_bones(moved: int) -> None:
    """Check that both algorithms for moved bones agree."""
    rng = np.random.default_rng(3)
    parent = np.array([-1, -1, *(rng.integers(0, k) for k in range(2, 30))], np.int32)
    local = np.tile(np.eye(4), (30, 1, 1))
    local[:, :3, :3] = Rotation.random(30, random_state=1).as_matrix()
    local[:, :3, 3] = rng.normal(scale=0.02, size=(30, 3))
    names = tuple(f"bone{k}" for k in range(30))
    skeleton = replace(SKELETON, names=names, parent=parent, local=local)
    world = local.copy()
    for bone in range(30):
        world[bone] = world[parent[bone]] @ local[bone] if parent[bone] >= 0 else local[bone]
    bound = np.linalg.inv(world)
    for inverse_bind, tolerance in ((bound, 1e-3), (bound @ _about(np.ones(3), (3, 4, 5)), 1e-2)):
        skeleton = replace(skeleton, inverse_bind=inverse_bind)
        posed = local.copy()
        chosen = rng.permutation(30)[:moved]
        posed[chosen, :3, :3] = Rotation.random(moved, random_state=2).as_matrix()
        pose = Pose(bones={names[k]: posed[k] for k in chosen})
        pose_arrays = pose.to_arrays(Rig(RIG.positions_mm, skeleton=skeleton))
        np.testing.assert_allclose(pose_arrays.matrices, skeleton.matrices(posed), atol=tolerance)


def test_bones_bound_elsewhere_than_they_rest() -> None:
    shifted = replace(
        SKELETON,
        inverse_bind=np.linalg.inv(_about(np.array([0.0, 0.1, 0]), (0, 20, 0))) @ SKELETON.inverse_bind,
    )
    rig = Rig(RIG.positions_mm, RIG.targets, shifted)
    local = SKELETON.local.copy()
    local[1] = local[1] @ _about(np.zeros(3), (0, 0, 30))
    pose_arrays = Pose(bones={"neck": local[1]}).to_arrays(rig)
    np.testing.assert_allclose(pose_arrays.matrices, shifted.matrices(local), atol=5e-4)


def test_given_positions_are_used_unchanged() -> None:
    places = RIG.positions_mm + np.float32(1)
    assert Pose(positions_mm=places).to_arrays(RIG).positions_mm is places
    listed = Pose(positions_mm=places.astype(float).tolist()).to_arrays(RIG).positions_mm
    np.testing.assert_array_equal(listed, places)


NAN = float("nan")
FLAT = np.diag([1.0, 1, 0, 1])


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (Pose({"Target3": 1}), r"pose: weights: .* morph target .* no 'Target3'. Nearest: target3,"),
        (Pose({"zzzz": 1}), r"It has target0, target1, .* target7\."),
        (Pose({"target3": NAN}), r"pose: weights\.target3: expected a number from -100 to 100, but got nan"),
        (Pose({"target3": float("inf")}), "got inf"),
        (Pose({"target3": 100.5}), "got 100.5"),
        (Pose({"target0": 1, "target3": "much"}), r"weights\.target3: .*got 'much'"),
        (Pose({"target3": [1, 2]}), r"weights\.target3: .*got \[1, 2\]"),
        (Pose(bones={"Hed": (0, 0, 0)}), r"pose: bones: .* a bone of the head, .* no 'Hed'. Nearest: head"),
        (Pose(bones={"head": (0, NAN, 0)}), r"pose: bones\.head: expected three angles"),
        (Pose(bones={"head": (0, 0)}), r"bones\.head: expected three angles"),
        (Pose(bones={"head": 7}), r"bones\.head: expected three angles"),
        (Pose(bones={"head": ("a", "b", "c")}), r"bones\.head: expected three angles"),
        (Pose(bones={"head": np.eye(4)[:, :3]}), r"bones\.head: expected three angles"),
        (Pose(bones={"head": np.where(np.eye(4) > 0, NAN, 0)}), r"bones\.head: expected three angles"),
        (Pose(bones={"neck": np.eye(4), "head": FLAT}), r"bones\.head: .* can be inverted"),
        (Pose(positions_mm=np.zeros((5, 3))), r"positions_mm: .* array of \(3000, 3\), but got \(5, 3\)"),
        (Pose(positions_mm="here"), r"positions_mm: expected an array"),
        (Pose(positions_mm=np.full((3000, 3), NAN)), r"3000 are NaN, infinite or farther, first 0"),
    ],
)  # fmt: skip
def test_invalid_poses_are_refused(pose: Pose, words: str) -> None:
    with pytest.raises(DermisError, match=words):
        pose.to_arrays(RIG)


def test_head_without_targets_or_bones_is_named() -> None:
    for pose, kind in ((Pose({"a": 1}), "morph target"), (Pose(bones={"b": (0, 0, 0)}), "bone")):
        with pytest.raises(DermisError, match=f"a {kind} of the head, but got '.' and it has none"):
            pose.to_arrays(Rig(RIG.positions_mm))


def test_a_scene_checks_its_pose_and_takes_a_mapping() -> None:
    ball = uv_sphere(100.0, 16, 8)
    points = np.zeros((ball.point.max() + 1, 3), np.float32)
    points[ball.point] = ball.positions
    targets = replace(random_rig(targets=1).targets, names=("smile",))
    kept = targets.point < len(points)
    targets = replace(
        targets, first=np.array([0, kept.sum()]), point=targets.point[kept], delta_mm=targets.delta_mm[kept]
    )
    head = Head("ball", ball, Maps(), rig=Rig(points, targets))
    assert head.targets == ("smile",) and head.bones == () and head.positions_mm is points
    scene = Scene(head, pose={"smile": 0.5})
    assert isinstance(scene.pose, Pose) and scene.pose_arrays is not None
    assert scene.pose_arrays.weights.tolist() == [0.5]
    assert Scene(head).pose_arrays is None
    assert replace(scene, pose=Pose({"smile": 1.0})).pose_arrays.weights.tolist() == [1.0]
    with pytest.raises(DermisError, match="Nearest: smile"):
        Scene(head, pose={"smyle": 0.5})
    with pytest.raises(DermisError, match="a Pose or a mapping"):
        Scene(head, pose=0.5)


def test_head_without_rig_accepts_positions() -> None:
    head = Head("ball", uv_sphere(100.0, 16, 8), Maps())
    scene = Scene(head, pose=Pose(positions_mm=2 * head.positions_mm))
    assert scene.pose_arrays is not None
    np.testing.assert_array_equal(scene.pose_arrays.positions_mm[head.mesh.point], 2 * head.mesh.positions)
