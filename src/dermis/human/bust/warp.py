"""From the symmetric head to one whose halves differ a little, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.human.bust.fields import Doubles, bump
from dermis.human.bust.parameters import BustParameters
from dermis.tables import numbers, read_rows

SHIFTS = numbers(read_rows(__package__, "shifts"), "x y z rx ry rz dx dy dz")
_STEPS = 6  # each brings the way back at least four times closer


@dataclass(frozen=True)
class Warp:
    """Breadth and asymmetry: what happens to the symmetric head last.

    width : breadth [-]
    centres, radii, shifts : (k, 3) soft places and how far each moves [mm]
    """

    width: float
    centres: Doubles
    radii: Doubles
    shifts: Doubles

    def apply(self, points: Doubles) -> Doubles:
        """Where points (n, 3) of the symmetric head come to lie [mm]."""
        return points * (self.width, 1, 1) + self._shift(points)

    def undo(self, points: Doubles) -> Doubles:
        """The points (n, 3) of the symmetric head that come to lie at these [mm]."""
        back = np.array(points, dtype=np.float64)
        if not np.any(self.shifts):
            return back / (self.width, 1, 1)
        for _ in range(_STEPS):
            back = (points - self._shift(back)) / (self.width, 1, 1)
        return back

    def normals(self, points: Doubles, normals: Doubles) -> Doubles:
        """Unit normals (n, 3) after the warp; points and normals (n, 3) before it."""
        h = 0.1
        columns = [
            (self.apply(points + h * axis) - self.apply(points - h * axis)) / (2 * h) for axis in np.eye(3)
        ]
        a, b, c = columns
        # cofactors of the Jacobian turn normals
        turned = sum(normals[:, [k]] * np.cross(u, v) for k, (u, v) in enumerate(((b, c), (c, a), (a, b))))
        return np.asarray(turned / np.linalg.norm(turned, axis=1, keepdims=True))

    def _shift(self, points: Doubles) -> Doubles:
        moved = np.zeros_like(points, dtype=np.float64)
        for centre, radii, shift in zip(self.centres, self.radii, self.shifts, strict=True):
            moved += bump(points, centre, radii)[:, None] * shift
        return moved


def make_warp(parameters: BustParameters) -> Warp:
    """The warp of these parameters; the same seed gives the same asymmetry."""
    paired = SHIFTS[:, 0] > 0
    places = np.vstack((SHIFTS, SHIFTS[paired] * (-1, *[1] * 8)))
    drawn = np.random.default_rng(parameters.seed).normal(size=(len(places), 3)).clip(-2, 2)
    shifts = parameters.asymmetry * places[:, 6:] * drawn
    return Warp(parameters.width, places[:, :3], places[:, 3:6], shifts)
