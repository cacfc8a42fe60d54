"""Values between keys of an animation: steps, lines, arcs and cubic splines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.turns import slerp

Doubles = NDArray[np.float64]
Interpolation = Literal["STEP", "LINEAR", "CUBICSPLINE"]
_TANGENT_IN, _VALUE, _TANGENT_OUT = range(3)


@dataclass(frozen=True, eq=False)
class Curve:
    """Values that change over time, several with the same keys side by side.

    times_s : (k,) of the keys, growing
    values : (k, m, n); of a cubic spline (k, 3, m, n): tangent in, value, tangent out
    turns : whether the values are quaternions (n = 4), which go round on arcs

    Source: glTF 2.0, appendix C.
    """

    times_s: Doubles
    values: Doubles
    kind: Interpolation = "LINEAR"
    turns: bool = False

    def at(self, seconds: float) -> Doubles:
        """(m, n) the values at a time; before the first key and after the last theirs."""
        index = int(np.searchsorted(self.times_s, seconds, side="right")) - 1
        keys = self.values[:, _VALUE] if self.kind == "CUBICSPLINE" else self.values
        if index < 0 or index + 1 >= len(self.times_s):
            return self._unit(keys[max(index, 0)])
        if self.kind == "STEP":
            return self._unit(keys[index])
        step = float(self.times_s[index + 1] - self.times_s[index])
        share = (seconds - float(self.times_s[index])) / step
        if self.kind == "CUBICSPLINE":
            return self._unit(self._spline(index, share, step))
        if self.turns:
            return slerp(self._unit(keys[index]), self._unit(keys[index + 1]), share)
        return np.asarray((1 - share) * keys[index] + share * keys[index + 1])

    def _spline(self, index: int, s: float, step: float) -> Doubles:
        here, there = self.values[index], self.values[index + 1]
        mixed = (2 * s**3 - 3 * s**2 + 1) * here[_VALUE] + (3 * s**2 - 2 * s**3) * there[_VALUE]
        mixed += step * (s**3 - 2 * s**2 + s) * here[_TANGENT_OUT]
        mixed += step * (s**3 - s**2) * there[_TANGENT_IN]
        return np.asarray(mixed)

    def _unit(self, values: Doubles) -> Doubles:
        return values / np.linalg.norm(values, axis=-1, keepdims=True) if self.turns else values
