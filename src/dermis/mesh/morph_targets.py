"""Morph targets: named displacements of the points of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Floats, Intp, Ints
from dermis.base.summary import ShortRepr


@dataclass(frozen=True, eq=False, repr=False)
class MorphTargets(ShortRepr):
    """Displacements of points by t morph targets, without zeros, stored target after target.

    names : (t,) names of the targets
    first : (t + 1,) index of the first displacement of each target; the last element is n
    point : (n,) index of the point of each displacement
    delta_mm : (n, 3) displacement at weight 1
    rest : (t,) weights in the rest pose; None if all are 0
    """

    names: tuple[str, ...]
    first: Ints
    point: Ints
    delta_mm: Floats
    rest: Floats | None = None

    @cached_property
    def index_by_name(self) -> dict[str, int]:
        """Return a dictionary from the name of each target to its index."""
        return {name: index for index, name in enumerate(self.names)}

    @cached_property
    def point_order(self) -> Intp:
        """Return the permutation (n,) that sorts the displacements by point, then by target."""
        return np.argsort(self.point, kind="stable")

    def displacement_rows(self, target_index: int) -> slice:
        """Return the slice of the rows of `point` and `delta_mm` that belong to a target."""
        return slice(int(self.first[target_index]), int(self.first[target_index + 1]))

    def dense_displacements(self, points: Intp, point_count: int) -> Floats:
        """Return the displacements (t, n, 3) of n points by all targets at weight 1 [mm].

        points : (n,) indices of the points
        point_count : number of points of the mesh
        """
        column_of = np.full(point_count, -1, np.int64)
        column_of[points] = np.arange(len(points))
        column = column_of.take(self.point)
        rows = np.flatnonzero(column >= 0)
        target = np.searchsorted(self.first, rows, side="right") - 1
        dense = np.zeros((len(self.names), len(points), 3), np.float32)
        dense[target, column.take(rows)] = self.delta_mm.take(rows, axis=0)
        return dense


def no_targets() -> MorphTargets:
    """Return an empty set of morph targets."""
    return MorphTargets((), np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
