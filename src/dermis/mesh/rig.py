"""What moves a head: morph targets, and bones with their skin weights."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]

INFLUENCES = 4
"""Bones that move a point; of more, those with the largest weights stay."""


@dataclass(frozen=True, eq=False)
class MorphTargets:
    """Displacements of some of the points by name, target after target.

    names : (t,)
    first : (t + 1,) where each target's displacements begin
    point : (n,) the point that each moves
    delta_mm : (n, 3) by how much at weight 1
    rest : (t,) weights with which the points at rest were made; None where all are 0
    """

    names: tuple[str, ...]
    first: Ints
    point: Ints
    delta_mm: Floats
    rest: Floats | None = None


def no_targets() -> MorphTargets:
    """Of a head that has none."""
    return MorphTargets((), np.zeros(1, np.int32), np.zeros(0, np.int32), np.zeros((0, 3), np.float32))


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones, parents before children, and the points that follow them.

    names : (b,)
    parent : (b,) -1 for a root
    local : (b, 4, 4) from each bone's space to its parent's, at rest
    inverse_bind : (b, 4, 4) from the file's space to the bone's, where its points are bound
    to_head : (4, 4) from the file's space to the head's [mm]
    bone, weight : (p, 4) bones that each point follows, and how much; the weights of a point add up to 1
    """

    names: tuple[str, ...]
    parent: Ints
    local: Doubles
    inverse_bind: Doubles
    to_head: Doubles
    bone: Ints
    weight: Floats

    def matrices(self, local: Doubles | None = None) -> Doubles:
        """(b, 3, 4) from where a point is at rest to where each bone takes it, in the head's space [mm].

        local : (b, 4, 4) instead of those at rest
        """
        local = self.local if local is None else local
        world = np.empty_like(local)
        for bone, parent in enumerate(self.parent.tolist()):
            world[bone] = world[parent] @ local[bone] if parent >= 0 else local[bone]
        moved = self.to_head @ world @ self.inverse_bind @ np.linalg.inv(self.to_head)
        return np.asarray(moved[:, :3])


@dataclass(frozen=True, eq=False)
class Stencils:
    """Points of a subdivided mesh, each as a mean of some control points.

    first : (q + 1,) where the control points of each begin
    point : (n,) them
    weight : (n,) their weights; those of one point add up to 1
    """

    first: Ints
    point: Ints
    weight: Floats

    def points(self, control_mm: Doubles) -> Doubles:
        """(q, 3) the points [mm]; control_mm : (p, 3)."""
        each = self.weight[:, None] * control_mm[self.point]
        return np.asarray(np.add.reduceat(each, self.first[:-1], axis=0))


@dataclass(frozen=True, eq=False)
class Rig:
    """The control points of a head and what moves them: morph targets first, then bones.

    positions_mm : (p, 3) the points at rest, before any subdivision, in the head's space
    targets, skeleton : what moves them; None for no bones
    stencils : from the control points to those of the mesh; None where they are the same
    """

    positions_mm: Floats
    targets: MorphTargets = field(default_factory=no_targets)
    skeleton: Skeleton | None = None
    stencils: Stencils | None = None

    @cached_property
    def target_index(self) -> dict[str, int]:
        """Number of each target by its name."""
        return {name: index for index, name in enumerate(self.targets.names)}

    def posed(self, weights: Doubles, matrices: Doubles | None = None) -> Doubles:
        """(p, 3) the points in a pose, as the device computes them [mm].

        weights : (t,) of the targets
        matrices : (b, 3, 4) of the bones, from `Skeleton.matrices`; None for those at rest
        """
        targets, points = self.targets, self.positions_mm.astype(np.float64)
        each = np.repeat(weights, np.diff(targets.first))
        np.add.at(points, targets.point, each[:, None] * targets.delta_mm)
        if self.skeleton is None or matrices is None:
            return points
        whole = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        blended = np.einsum("pk,pkij->pij", self.skeleton.weight, matrices[self.skeleton.bone])
        return np.asarray(np.einsum("pij,pj->pi", blended, whole))
