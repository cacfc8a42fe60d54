"""Morph targets, bones and stencils of a rig."""

from __future__ import annotations

import numpy as np

from dermis.mesh.rig import MorphTargets, Rig, Skeleton, Stencils


def _moved(translation: tuple[float, float, float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = translation
    return matrix


def _rig(weight: float = 1.0) -> Rig:
    points = np.array([[0, 0, 0], [0, 2, 0], [0, 4, 0]], np.float32)
    targets = MorphTargets(
        ("up", "out"),
        np.array([0, 1, 3], np.int32),
        np.array([0, 1, 2], np.int32),
        np.array([[0, 1, 0], [1, 0, 0], [2, 0, 0]], np.float32),
    )
    skeleton = Skeleton(
        ("root", "tip"),
        np.array([-1, 0], np.int32),
        np.stack([np.eye(4), _moved((0, 2, 0))]),
        np.stack([np.eye(4), _moved((0, -2, 0))]),
        np.eye(4),
        np.array([[0, 1, 0, 0]] * 3, np.int32),
        np.array([[1, 0, 0, 0], [1 - weight / 2, weight / 2, 0, 0], [1 - weight, weight, 0, 0]], np.float32),
    )
    return Rig(points, targets, skeleton)


def test_targets_add_up() -> None:
    posed = _rig().pose(np.array([0.5, 2.0]))
    np.testing.assert_allclose(posed, [[0, 0.5, 0], [2, 2, 0], [4, 4, 0]])


def test_bones_at_rest_leave_points_where_they_are() -> None:
    rig = _rig()
    assert rig.skeleton is not None
    np.testing.assert_allclose(rig.pose(np.zeros(2), rig.skeleton.matrices()), rig.positions_mm, atol=1e-12)


def test_bone_rotates_its_followers() -> None:
    rig = _rig()
    assert rig.skeleton is not None
    local = rig.skeleton.local.copy()
    local[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # a quarter turn about z
    posed = rig.pose(np.zeros(2), rig.skeleton.matrices(local))
    np.testing.assert_allclose(posed[2], [-2, 2, 0], atol=1e-12)
    np.testing.assert_allclose(posed[0], [0, 0, 0], atol=1e-12)


def test_stencils_evaluate_weighted_means() -> None:
    stencils = Stencils(
        np.array([0, 1, 3], np.int32), np.array([2, 0, 1], np.int32), np.array([1, 0.25, 0.75], np.float32)
    )
    points = stencils.points(np.array([[0, 0, 0], [4, 0, 0], [1, 1, 1]], float))
    np.testing.assert_allclose(points, [[1, 1, 1], [3, 0, 0]])
