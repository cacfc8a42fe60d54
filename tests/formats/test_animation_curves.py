"""Interpolation of animation keys against the formulas of the specification."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from dermis.formats.gltf.animations import AnimationCurve

RNG = np.random.default_rng(8)
TIMES = np.array([0.5, 1.0, 2.5, 2.75])
VALUES = RNG.normal(size=(4, 2, 3))


def test_step_keys_hold_until_the_next_key() -> None:
    curve = AnimationCurve(TIMES, VALUES, "STEP")
    for seconds, key in ((-1.0, 0), (0.5, 0), (0.999, 0), (1.0, 1), (2.6, 2), (2.75, 3), (9.0, 3)):
        np.testing.assert_array_equal(curve.sample(seconds), VALUES[key])


def test_linear_keys_are_interpolated() -> None:
    curve = AnimationCurve(TIMES, VALUES)
    expected = VALUES[1] + (1.75 - 1.0) / 1.5 * (VALUES[2] - VALUES[1])
    np.testing.assert_allclose(curve.sample(1.75), expected)
    np.testing.assert_array_equal(curve.sample(0.0), VALUES[0])
    np.testing.assert_array_equal(curve.sample(3.0), VALUES[3])


def test_rotations_interpolate_along_the_shorter_arc() -> None:
    turns = Rotation.random(4, random_state=2)
    quaternions = turns.as_quat() * [[1], [-1], [2], [1]]  # another sign, and of another length
    curve = AnimationCurve(TIMES, quaternions[:, None], is_rotation=True)
    arcs = Slerp(TIMES, turns)
    for seconds in (0.5, 0.6, 1.0, 2.2, 2.75):
        turned = curve.sample(seconds)[0]
        assert np.linalg.norm(turned) == pytest.approx(1.0)
        assert abs(turned @ arcs(seconds).as_quat()) == pytest.approx(1.0)


def _spline(before, after, s: float, step: float):
    """Evaluate glTF 2.0, appendix C.5, for in-tangent, value and out-tangent of two keys."""
    (_, v0, b0), (a1, v1, _) = before, after
    return (
        (2 * s**3 - 3 * s**2 + 1) * v0
        + step * (s**3 - 2 * s**2 + s) * b0
        + (-2 * s**3 + 3 * s**2) * v1
        + step * (s**3 - s**2) * a1
    )


@pytest.mark.parametrize("turns", [False, True])
def test_cubic_splines_are_evaluated(turns: bool) -> None:
    keys = RNG.normal(size=(4, 3, 2, 4))
    curve = AnimationCurve(TIMES, keys, "CUBICSPLINE", turns)
    for seconds in (1.0, 1.3, 2.4):
        expected = _spline(keys[1], keys[2], (seconds - 1.0) / 1.5, 1.5)
        if turns:
            expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
        np.testing.assert_allclose(curve.sample(seconds), expected, atol=1e-12)
    ends = keys[[0, 3], 1]
    ends = ends / np.linalg.norm(ends, axis=-1, keepdims=True) if turns else ends
    np.testing.assert_allclose([curve.sample(0.0), curve.sample(3.0)], ends)


def test_spline_follows_the_tangents_of_its_keys() -> None:
    keys = RNG.normal(size=(4, 3, 1, 2))
    curve = AnimationCurve(TIMES, keys, "CUBICSPLINE")
    slope = (curve.sample(1.0 + 1e-6) - curve.sample(1.0)) / 1e-6
    np.testing.assert_allclose(slope, keys[1, 2], atol=1e-4)
    slope = (curve.sample(2.5) - curve.sample(2.5 - 1e-6)) / 1e-6
    np.testing.assert_allclose(slope, keys[2, 0], atol=1e-4)


def test_keys_at_equal_times_are_accepted() -> None:
    curve = AnimationCurve(np.array([0.0, 1.0, 1.0, 2.0]), VALUES)
    np.testing.assert_array_equal(curve.sample(1.0), VALUES[2])
