"""Parameters that go together: a Gaussian copula, which leaves the distribution of each as it is."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from dermis.scene.plain import Plain

_MOST_NAMES = 50
_Coefficient = Annotated[float, Field(ge=-1, le=1)]


class Correlated(Plain):
    """Parameters by name, and the correlation of the normal numbers that they are drawn by.

    A greater number gives a greater value, and of a choice a later one.
    """

    of: tuple[str, ...]
    """Names of parameters, such as ["camera.yaw_deg", "head.yaw_deg"]; those of a person first."""
    correlation: _Coefficient | tuple[tuple[_Coefficient, ...], ...]
    """Of all pairs alike, or the matrix: rows of as many numbers as there are names."""

    @model_validator(mode="after")
    def _possible(self) -> Correlated:
        if not 2 <= len(set(self.of)) == len(self.of) <= _MOST_NAMES:
            raise ValueError(f"2 to {_MOST_NAMES} names, each once")
        if isinstance(self.correlation, tuple) and {len(self.of), *map(len, self.correlation)} != {
            len(self.correlation)
        }:
            raise ValueError(f"a correlation of {len(self.of)} rows of {len(self.of)} numbers")
        matrix = self.matrix
        if not (np.array_equal(matrix, matrix.T) and (np.diag(matrix) == 1).all()):
            raise ValueError("a correlation that is symmetric, with 1 on its diagonal")
        if np.linalg.eigvalsh(matrix)[0] < 1e-6:
            raise ValueError("a correlation that is positive definite: these cannot all be at once")
        return self

    @property
    def matrix(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """(n, n) the correlations of all."""
        if isinstance(self.correlation, tuple):
            return np.array(self.correlation, np.float64)
        count = len(self.of)
        return np.full((count, count), self.correlation) + (1.0 - self.correlation) * np.eye(count)

    def rows(self) -> dict[str, dict[str, float]]:
        """By name the factors of the independent normal numbers of each that make its own."""
        lower = np.linalg.cholesky(self.matrix)
        return {
            name: {other: float(lower[k, j]) for j, other in enumerate(self.of[: k + 1])}
            for k, name in enumerate(self.of)
        }
