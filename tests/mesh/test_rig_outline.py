"""The outline of a rig in any pose compared with all of its points."""

from __future__ import annotations

import numpy as np
import pytest
from random_rig import random_rig

from dermis.mesh.outline import extreme_points
from dermis.mesh.rig import PoseArrays, Rig

RNG = np.random.default_rng(11)
ANYWHERE = RNG.normal(size=(300, 3))
ANYWHERE /= np.linalg.norm(ANYWHERE, axis=1, keepdims=True)


def _pose(rig: Rig, rng: np.random.Generator) -> PoseArrays:
    weights = (rng.random(len(rig.targets.names)) * (rng.random(len(rig.targets.names)) < 0.5)).astype(
        np.float32
    )
    if rig.skeleton is None:
        return rig.rest._replace(weights=weights)
    bones = [k for k in range(4) if rng.random() < 0.6]
    turns = [rig.skeleton.joint_rotation_matrix(bone, rng.uniform(-45, 45, 3).tolist()) for bone in bones]
    matrices = rig.skeleton.pose_matrices(bones, np.array(turns).reshape(-1, 4, 4))
    return PoseArrays(weights, matrices, rig.positions_mm)


def _missed_mm(rig: Rig, pose_arrays: PoseArrays) -> float:
    """Return the largest distance of any point beyond the outline, in any direction [mm]."""
    at_rest = Rig(pose_arrays.positions_mm, rig.targets, rig.skeleton)
    every = at_rest.pose(pose_arrays.weights.astype(float), pose_arrays.matrices.astype(float))
    few = rig.outline_mm(pose_arrays)
    assert few.shape == (len(few), 3) and len(few) < len(every) / 2
    gap = (ANYWHERE @ every.T).max(axis=1) - (ANYWHERE @ few.T).max(axis=1)
    assert gap.min() > -1e-3  # they are points of the head
    return float(gap.max())


@pytest.mark.parametrize("bones", [True, False])
def test_poses_stay_within_the_outline(bones: bool) -> None:
    rig = random_rig(seed=4)
    rig = rig if bones else Rig(rig.positions_mm, rig.targets)
    poses = [_pose(rig, np.random.default_rng(seed)) for seed in range(30)]
    assert max(_missed_mm(rig, pose_arrays) for pose_arrays in [rig.rest, *poses]) < 1.0


def test_other_people_have_outlines() -> None:
    rig = random_rig(seed=5)
    other = rig.positions_mm * np.float32([1.2, 0.9, 1.0]) + np.float32([0, 5, 3])
    for seed in range(5):
        pose_arrays = _pose(rig, np.random.default_rng(seed))._replace(positions_mm=other)
        assert _missed_mm(rig, pose_arrays) < 1.5
    other *= 1.5  # the same array with other numbers
    assert _missed_mm(rig, rig.rest._replace(positions_mm=other)) < 2.0
    assert rig.outline_mm(rig.rest)[:, 1].max() < rig.outline_mm(pose_arrays)[:, 1].max()


def test_outline_of_a_rig_is_computed_once() -> None:
    first, second = random_rig(seed=6), random_rig(seed=6)
    assert len(first.outline_mm(first.rest)) > 100
    np.testing.assert_array_equal(first._outline_points, second._outline_points)


def test_points_alone_have_an_outline() -> None:
    rig = Rig(random_rig().positions_mm)
    assert _missed_mm(rig, rig.rest) < 1.0
    assert len(extreme_points(rig.positions_mm)) <= 256
