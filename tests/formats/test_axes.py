"""Up and front axes of files."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from dermis.formats.axes import Axes, Axis, to_y_up

PAIRS = [(up, front) for up in get_args(Axis) for front in get_args(Axis) if up[-1] != front[-1]]


def direction(axis: str) -> np.ndarray:
    return np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1)


@pytest.mark.parametrize(("up", "front"), PAIRS)
def test_up_becomes_y_and_the_front_z_without_a_reflection(up: Axis, front: Axis) -> None:
    axes = Axes(up, front)
    turned = to_y_up(np.array([direction(up), direction(front)]), axes)
    np.testing.assert_array_equal(turned, [[0, 1, 0], [0, 0, 1]])
    assert np.linalg.det(to_y_up(np.eye(3), axes)) == pytest.approx(1.0)


def test_chosen_axes_override_those_of_the_file() -> None:
    file = Axes("z", "x")
    assert Axes().fill_unknown_from(file) == Axes("z").fill_unknown_from(file) == file
    assert Axes(front="y").fill_unknown_from(file) == Axes("z", "y")
    assert Axes("y").fill_unknown_from(file) == Axes("y")
    assert Axes("y").front_or_default == "z"
    assert Axes("y").fill_unknown_from(Axes(front="-z")) == Axes("y", "-z")
    assert Axes("-y").fill_unknown_from(Axes(front="-z")) == Axes("-y")


def test_default_front_is_minus_y_with_z_up_and_plus_z_otherwise() -> None:
    assert [Axes(up).front_or_default for up in ("y", "-y", "x", "z", "-z")] == ["z", "z", "z", "-y", "-y"]
