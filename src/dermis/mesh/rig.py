"""What moves a head: morph targets, and bones with their skin weights."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Intp, Ints, Mask, Numbers
from dermis.base.disk import cached_array
from dermis.base.summary import ShortRepr
from dermis.mesh.eyeball import Contact
from dermis.mesh.morph_targets import MorphTargets, no_targets
from dermis.mesh.outline import RigOutline, corners_of, outline_of, outline_points
from dermis.mesh.rotations import rigid_motion
from dermis.mesh.skeleton import INFLUENCES, Skeleton

__all__ = [
    "INFLUENCES",
    "Carried",
    "MorphTargets",
    "Motion",
    "Rig",
    "Skeleton",
    "Stencils",
    "Turn",
    "no_targets",
]

_FORM = "outline 6"  # another number when other points are found


class Motion(NamedTuple):
    """How a rig is moved, as numbers.

    weights : (t,) of its targets, beyond those at rest
    matrices : (b, 3, 4) of its bones, from where a point is at rest to where it is taken [mm]
    positions_mm : (p, 3) its points at rest
    """

    weights: Floats
    matrices: Floats
    positions_mm: Floats


@dataclass(frozen=True, eq=False, repr=False)
class Stencils(ShortRepr):
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


class Turn(NamedTuple):
    """What a target does by turning a bone, beside moving points.

    degrees : about the head's x, y and z, at a weight of 1
    """

    target: str
    bone: str
    degrees: tuple[float, float, float]


class Carried(NamedTuple):
    """Points that lie where others of the file take them, as one rigid body.

    others : (n,) of the file
    points : (m,) those that go with them
    """

    others: Ints
    points: Ints


@dataclass(frozen=True, eq=False, repr=False)
class Rig(ShortRepr):
    """The control points of a head and what moves them: morph targets first, then bones.

    positions_mm : (p, 3) the points at rest, before any subdivision, in the head's space
    targets, skeleton : what moves them; None for no bones
    stencils : from the control points to those of the mesh; None where they are the same
    corner : (v,) the control point of each vertex of the file's mesh; None where `Mesh.point` tells it
    turns : of bones, by targets
    carried : points that the file has not, after all of its own
    contact : points that stay off the eyes; None for none
    template : a rig of the same points whose outermost ones are this one's too, beside the corners of its own
        convex hull; None where they are looked for
    """

    positions_mm: Floats
    targets: MorphTargets = field(default_factory=no_targets)
    skeleton: Skeleton | None = None
    stencils: Stencils | None = None
    corner: Ints | None = None
    turns: tuple[Turn, ...] = ()
    carried: tuple[Carried, ...] = ()
    contact: Contact | None = None
    template: Rig | None = None

    @cached_property
    def rest(self) -> Motion:
        """That of a rig which nothing moves."""
        bones = np.zeros((0, 3, 4), np.float32) if self.skeleton is None else self.skeleton.resting
        return Motion(np.zeros(len(self.targets.names), np.float32), bones, self.positions_mm)

    @property
    def of_file(self) -> int:
        """How many points are the file's own; they come first."""
        return len(self.positions_mm) - sum(len(one.points) for one in self.carried)

    def completed(self, places_mm: Floats) -> Floats:
        """(p, 3) where all points rest, of those of the file [mm]."""
        both = np.concatenate([places_mm, self.positions_mm[len(places_mm) :]])
        for others, points in self.carried:
            before, after = self.positions_mm[others], places_mm[others]
            matrix, shift = rigid_motion(before.astype(np.float64), after.astype(np.float64))
            both[points] = self.positions_mm[points] @ matrix.T + shift
        return both

    @property
    def target_index(self) -> dict[str, int]:
        """Number of each target by its name."""
        return self.targets.index

    @cached_property
    def outline(self) -> RigOutline:
        """Its outermost points; found once and kept on disk."""
        return outline_of(self.positions_mm, self.targets, self.skeleton, self._outline_points)

    def outline_mm(self, motion: Motion) -> Floats:
        """(s, 3) points that lie as far out as any other in each direction, to a millimetre or so [mm].

        Of a rig that rests elsewhere, the corners of its convex hull there are among them.
        """
        if motion.positions_mm is self.positions_mm:
            return self.outline.posed(motion.weights, motion.matrices)
        return self._outline_at(motion.positions_mm).posed(motion.weights, motion.matrices)

    def _outline_at(self, places: Floats) -> RigOutline:
        """The outline of a rig that rests elsewhere; the last one is kept, and checked by its own points."""
        points, outline = self._elsewhere
        if not np.array_equal(places[points].T, outline.rest_mm[:3]):
            points = np.union1d(self._outline_points, corners_of(places))
            outline = outline_of(places, self.targets, self.skeleton, points)
            vars(self)["_elsewhere"] = points, outline
        return outline

    @cached_property
    def _elsewhere(self) -> tuple[Intp, RigOutline]:
        return self._outline_points, self.outline

    @cached_property
    def _outline_points(self) -> Intp:
        if self.template is not None:
            return np.union1d(self.template._outline_points, corners_of(self.positions_mm))
        targets, skeleton = self.targets, self.skeleton
        sources: list[Numbers] = [self.positions_mm, targets.first, targets.point, targets.delta_mm]
        if skeleton is not None:
            sources += [skeleton.parent, skeleton.local, skeleton.to_head, skeleton.bone, skeleton.weight]
        return cached_array(
            sources, _FORM, lambda: outline_points(self.positions_mm, targets, skeleton)
        ).astype(np.intp)

    def points_mm(self, motion: Motion) -> Doubles:
        """(q, 3) the points of the mesh in a motion, after any subdivision [mm]."""
        resting = replace(self, positions_mm=motion.positions_mm)
        control = resting.posed(motion.weights.astype(np.float64), motion.matrices.astype(np.float64))
        return control if self.stencils is None else self.stencils.points(control)

    def edges_mm(self, motion: Motion) -> Doubles:
        """(k, r, 3) the edges of the lids around each eye, on the surface, in a motion [mm]."""
        assert self.contact is not None
        points, share, outline = self._edges
        rest = np.vstack([motion.positions_mm[points].T, outline.rest_mm[3]])
        posed = replace(outline, rest_mm=rest).posed(motion.weights, motion.matrices)
        return np.asarray(share @ posed).reshape(*self.contact.edge.shape, 3)

    @cached_property
    def _edges(self) -> tuple[Intp, Doubles, RigOutline]:
        """Control points around edges of lids, their shares in these, and what moves them."""
        assert self.contact is not None
        edge = self.contact.edge.ravel().astype(np.intp)
        points, share = edge, np.eye(len(edge))
        if self.stencils is not None:  # whose first points are the control points, on the surface
            parts = [slice(*self.stencils.first[one : one + 2]) for one in edge]
            points = np.unique(np.concatenate([self.stencils.point[part] for part in parts])).astype(np.intp)
            share = np.zeros((len(edge), len(points)))
            for row, part in zip(share, parts, strict=True):
                row[np.searchsorted(points, self.stencils.point[part])] = self.stencils.weight[part]
        return points, share, outline_of(self.positions_mm, self.targets, self.skeleton, points)

    def some_posed(self, points: Ints, motion: Motion) -> Doubles:
        """(n, 3) some points in a motion [mm]."""
        places = motion.positions_mm[points].astype(np.float64)
        if self._moved[points].any():
            places += np.einsum("t,tpk->pk", motion.weights, self._dense(points))
        if self.skeleton is None:
            return places
        whole = np.concatenate([places, np.ones((len(places), 1))], axis=1)
        weight, matrices = self.skeleton.weight[points], motion.matrices[self.skeleton.bone[points]]
        return np.asarray(np.einsum("pk,pkij,pj->pi", weight, matrices, whole))

    @cached_property
    def _moved(self) -> Mask:
        """(p,) whether a target moves a point."""
        moved = np.zeros(len(self.positions_mm), bool)
        moved[self.targets.point] = True
        return moved

    def _dense(self, points: Ints) -> Floats:
        """(t, n, 3) displacements of some points; the last ones are kept."""
        asked, found = vars(self).get("_last", (None, None))
        if found is None or not np.array_equal(asked, points):
            found = self.targets.dense(points.astype(np.intp), len(self.positions_mm))
            vars(self)["_last"] = points, found
        return np.asarray(found)

    def posed(self, weights: Doubles, matrices: Doubles | None = None) -> Doubles:
        """(p, 3) the points in a pose, as the device computes them [mm].

        weights : (t,) of the targets, beyond those at rest
        matrices : (b, 3, 4) of the bones, from `Skeleton.matrices`; None for those at rest
        """
        targets, points = self.targets, self.positions_mm.astype(np.float64)
        each = np.repeat(weights, np.diff(targets.first))
        np.add.at(points, targets.point, each[:, None] * targets.delta_mm)
        if self.skeleton is not None and matrices is not None:
            whole = np.concatenate([points, np.ones((len(points), 1))], axis=1)
            blended = np.einsum("pk,pkij->pij", self.skeleton.weight, matrices[self.skeleton.bone])
            points = np.asarray(np.einsum("pij,pj->pi", blended, whole))
        return points if self.contact is None else self.contact.kept_off(points)
