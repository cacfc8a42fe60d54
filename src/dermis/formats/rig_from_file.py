"""Rigs of the points of a mesh, from the targets and bones of the vertices of a file."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask
from dermis.base.errors import refuse
from dermis.formats.parts import Bones, MeshPart
from dermis.mesh.rig import INFLUENCES, MorphTargets, Rig, Skeleton, no_targets

SPLIT_TOLERANCE_MM = 0.01
"""Vertices at one place that a target moves this far apart are two points, as of lips that touch."""
_MAX_COINCIDENT = 64
_WEIGHT_TOLERANCE = 0.004  # a step of weights in 8 bits
_MIN_DISPLACEMENT_MM = 1e-4  # what rounding leaves of vertices that do not move


def split_points(point: Ints, part: MeshPart, linear: Doubles, culprit: object) -> Ints:
    """(v,) points of which vertices that move differently are no longer one; in the order they were in.

    point : (v,) welded by their places
    linear : (3, 3) from the file's space to mm

    Raises DermisError for more such vertices at one place than any mesh has.
    """
    left = np.flatnonzero(np.bincount(point)[point] > 1)
    copy, number = np.zeros(len(point), np.int64), 0
    while len(left):
        if number > _MAX_COINCIDENT:
            actual = f"{number} of them move apart"
            refuse(culprit, "a few vertices at one place", actual, "The file is damaged: export it again")
        groups, first = np.unique(point[left], return_index=True)
        other = left[first[np.searchsorted(groups, point[left])]]
        apart = _targets_differ(part, left, other, linear) | _weights_differ(part, left, other)
        copy[left[~apart]] = number
        left, number = left[apart], number + 1
    _, parted = np.unique(point * np.int64(number + 1) + copy, return_inverse=True)
    return np.asarray(parted.reshape(-1), np.int32)


def _targets_differ(part: MeshPart, one: Index, other: Index, linear: Doubles) -> Mask:
    """Whether some target moves vertices (n,) and others (n,) apart."""
    apart, delta = np.zeros(len(one), bool), np.zeros((len(part.positions), 3))
    for vertex, moved in part.targets.values():
        delta[vertex] = moved @ linear.T
        apart |= np.linalg.norm(delta[one] - delta[other], axis=1) > SPLIT_TOLERANCE_MM
        delta[vertex] = 0
    return apart


def _weights_differ(part: MeshPart, one: Index, other: Index) -> Mask:
    """Whether vertices (n,) and others (n,) follow bones by different shares."""
    if part.bone is None or part.weight is None:
        return np.zeros(len(one), bool)
    both = np.concatenate([part.bone[one], part.bone[other]], axis=1)
    share = np.concatenate([part.weight[one], -part.weight[other]], axis=1)
    same = both[:, :, None] == both[:, None, :]
    return np.asarray((np.abs((same * share[:, None, :]).sum(axis=2)) > _WEIGHT_TOLERANCE).any(axis=1))


def build_rig(
    positions_mm: Floats,
    point: Ints,
    part: MeshPart,
    bones: Bones | None,
    weights: Mapping[str, float],
    to_head: Doubles,
    culprit: object,
) -> Rig | None:
    """The rig of a mesh's points, None where nothing moves them.

    positions_mm : (v, 3) in the head's space
    part : all of the file's vertices that are used, (v,)
    weights : of targets at rest
    to_head : (4, 4) from the file's space to the head's [mm]

    Raises DermisError for bones without extent.
    """
    if not part.targets and bones is None:
        return None
    _, first = np.unique(point, return_index=True)
    places = np.ascontiguousarray(positions_mm[first])
    skeleton = None if bones is None else _skeleton(part, bones, first, to_head, culprit)
    return Rig(places, _targets(part, point, first, weights, to_head), skeleton)


def _targets(
    part: MeshPart, point: Ints, first: Index, weights: Mapping[str, float], to_head: Doubles
) -> MorphTargets:
    """The targets of points that move as the `first` of their vertices does."""
    if not part.targets:
        return no_targets()
    stands = np.zeros(len(point), bool)
    stands[first] = True
    moved, deltas = [], []
    for vertex, delta in part.targets.values():
        delta_mm = (delta @ to_head[:3, :3].T).astype(np.float32)
        kept = np.flatnonzero(stands[vertex] & (np.abs(delta_mm) > _MIN_DISPLACEMENT_MM).any(axis=1))
        kept = kept[np.argsort(point[vertex[kept]])]
        moved.append(point[vertex[kept]])
        deltas.append(delta_mm[kept])
    start = np.cumsum([0, *map(len, moved)]).astype(np.int32)
    rest = np.array([weights.get(name, 0.0) for name in part.targets], np.float32)
    return MorphTargets(
        tuple(part.targets),
        start,
        np.concatenate(moved),
        np.concatenate(deltas),
        rest if rest.any() else None,
    )


def _skeleton(part: MeshPart, bones: Bones, first: Index, to_head: Doubles, culprit: object) -> Skeleton:
    """The bones of points that follow them as the `first` of their vertices does."""
    assert part.bone is not None and part.weight is not None
    bone = np.zeros((len(first), INFLUENCES), np.int32)
    weight = np.zeros((len(first), INFLUENCES), np.float32)
    bone[:, : part.bone.shape[1]], weight[:, : part.weight.shape[1]] = part.bone[first], part.weight[first]
    size = np.linalg.norm(bones.world[:, :3, :3], axis=(1, 2))
    flat = np.abs(np.linalg.det(bones.world[:, :3, :3])) <= 1e-9 * size**3
    followed = np.flatnonzero(flat & np.isin(np.arange(len(flat)), bone[weight > 0]))
    if len(followed):
        actual = f"{bones.names[followed[0]]!r} is scaled to nothing at rest"
        refuse(culprit, "bones with an extent", actual, "Export it with another scale")
    inverse = np.linalg.inv(np.where(flat[:, None, None], np.eye(4), bones.world))
    return Skeleton(
        bones.names, bones.parent, bones.local, np.asarray(inverse, np.float64), to_head, bone, weight
    )
