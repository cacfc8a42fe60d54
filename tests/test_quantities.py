"""Validation of numbers from callers and files."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.base.quantities import checked_array


def test_array_of_the_shape_is_accepted() -> None:
    assert np.array_equal(checked_array("place", [[1, 2, 3]], (0, 3), -5, 5), [[1, 2, 3]])


@pytest.mark.parametrize("values", [[["1"]], [[True]], [1, [2, 3]], "123", [[6.0]], [[float("nan")]]])
def test_invalid_arrays_are_refused(values: object) -> None:
    with pytest.raises(DermisError, match=r"place: expected n x 1 numbers from -5 to 5, but"):
        checked_array("place", values, (0, 1), -5, 5)


def test_endless_lists_are_refused() -> None:
    nested: list[Any] = []
    for _ in range(5000):
        nested = [nested]
    nested.append(nested)
    with pytest.raises(DermisError, match="3 numbers"):
        checked_array("place", nested, (3,), -5, 5)
