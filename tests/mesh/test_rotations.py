"""Quaternions, angles and matrices compared with each other and with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from dermis.mesh.rotations import angles_matrix, matrix_angles, matrix_quaternion, quaternion_matrix, slerp

Q = Rotation.random(200, random_state=3).as_quat()


def test_quaternions_of_any_length_give_rotations() -> None:
    matrices = quaternion_matrix(3.0 * Q)
    np.testing.assert_allclose(matrices[:, :3, :3], Rotation.from_quat(Q).as_matrix(), atol=1e-14)
    np.testing.assert_array_equal(quaternion_matrix(np.zeros(4)), np.eye(4))


def test_rotation_to_quaternion_round_trip() -> None:
    halves = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0.6, 0.8, 0, 1e-9]])
    for q in (*Q, *halves):
        back = matrix_quaternion(quaternion_matrix(q)[:3, :3])
        assert abs(abs(back @ q) / np.linalg.norm(q) - 1) < 1e-12 and back[3] >= 0


def test_angles_rotate_about_z_then_x_then_y() -> None:
    for degrees in ((10.0, 20.0, 30.0), (-80.0, 170.0, -120.0)):
        x, y, z = degrees
        expected = Rotation.from_euler("zxy", [z, x, y], degrees=True).as_matrix()
        np.testing.assert_allclose(angles_matrix(degrees), expected, atol=1e-14)
        assert matrix_angles(np.array(angles_matrix(degrees))) == pytest.approx(degrees)


@pytest.mark.parametrize("x", [90.0, -90.0])
def test_gimbal_lock_gives_valid_angles(x: float) -> None:
    matrix = np.array(angles_matrix((x, 30.0, 20.0)))
    np.testing.assert_allclose(angles_matrix(matrix_angles(matrix)), matrix, atol=1e-7)


def test_slerp_goes_the_shorter_way_at_a_steady_pace() -> None:
    for a, b in zip(Q[:50], Q[50:100], strict=True):
        way = Slerp([0, 1], Rotation.from_quat([a, b]))
        for s in (0.0, 0.3, 1.0):
            turned = slerp(a, b, s)
            assert abs(turned @ way(s).as_quat()) == pytest.approx(1.0)
    np.testing.assert_allclose(slerp(Q[0], -Q[0], 0.4), Q[0], atol=1e-12)
