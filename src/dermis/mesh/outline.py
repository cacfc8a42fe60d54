"""What lies farthest out of a shape: enough to know its extent along any direction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.base.summary import Summarised


@dataclass(frozen=True, eq=False, repr=False)
class Outline(Summarised):
    """Places of a shape beyond which, seen from wherever, none of it lies.

    places_mm : (n, 3)
    slack_mm : how far out some of it may lie all the same; depth ranges leave so much room
    """

    places_mm: NDArray[np.floating]
    slack_mm: float = 0.0

    @cached_property
    def columns(self) -> NDArray[np.float32]:
        """(4, n) the places as columns, each with a 1 below, for matrices from its left [mm].

        As exact as a mesh's positions, and what comes of it in each frame takes half the memory.
        """
        return np.vstack([self.places_mm.T, np.ones(len(self.places_mm))]).astype(np.float32)

    @cached_property
    def middle_mm(self) -> tuple[float, float, float]:
        """Halfway between the least and the largest coordinates [mm]."""
        x, y, z = 0.5 * (self.places_mm.min(axis=0) + self.places_mm.max(axis=0))
        return float(x), float(y), float(z)


def hull(positions: NDArray[np.floating]) -> Outline:
    """The corners of the convex hull of (n, 3) positions [mm]."""
    points = positions.astype(np.float64)
    return Outline(points[hull_points(points)])


def hull_points(positions: NDArray[np.floating]) -> NDArray[np.intp]:
    """Numbers of the positions (n, 3) that are corners of the convex hull of all."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.sort(ConvexHull(positions.astype(np.float64)).vertices).astype(np.intp)
    except QhullError:  # it is flat
        return np.arange(len(positions))
