"""Construction of rigs for the welded points of a mesh from the morph targets and bones of a file."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask
from dermis.base.errors import refuse
from dermis.formats.parts import Bones, MeshPart
from dermis.formats.size_limits import DAMAGED_ADVICE
from dermis.mesh.rig import BONES_PER_POINT, MorphTargets, Rig, Skeleton, no_targets

COINCIDENCE_TOLERANCE_MM = 0.01
"""Coincident vertices become separate points if a morph target moves them farther apart than this distance
[mm]. Vertices of touching lips are an example."""
_MAX_COINCIDENT_VERTICES = 64  # vertices at one position that move differently
_BONE_WEIGHT_TOLERANCE = 0.004  # one step of 8-bit weights
_MIN_DISPLACEMENT_MM = 1e-4  # smaller displacements are rounding errors and count as 0


def split_points(
    point_of_vertex: Ints, mesh_part: MeshPart, linear_to_head: Doubles, error_subject: object
) -> Ints:
    """Return point indices (v,) in which coincident vertices that move differently have different points.

    point_of_vertex : (v,) index of the point of each vertex, as found by welding vertices by position
    mesh_part : vertices with their morph targets and bone weights
    linear_to_head : (3, 3) matrix from the space of the file to that of the head [mm]
    error_subject : file, for errors

    Raises DermisError if too many vertices at one position move differently.
    """
    remaining = np.flatnonzero(np.bincount(point_of_vertex)[point_of_vertex] > 1)
    copy, number = np.zeros(len(point_of_vertex), np.int64), 0
    while len(remaining):
        if number > _MAX_COINCIDENT_VERTICES:
            actual = f"{number} of them move differently"
            refuse(error_subject, "a few coincident vertices", actual, DAMAGED_ADVICE)
        groups, first = np.unique(point_of_vertex[remaining], return_index=True)
        other = remaining[first[np.searchsorted(groups, point_of_vertex[remaining])]]
        apart = _targets_differ(mesh_part, remaining, other, linear_to_head) | _weights_differ(
            mesh_part, remaining, other
        )
        copy[remaining[~apart]] = number
        remaining, number = remaining[apart], number + 1
    _, split = np.unique(point_of_vertex * np.int64(number + 1) + copy, return_inverse=True)
    return np.asarray(split.reshape(-1), np.int32)


def _targets_differ(
    mesh_part: MeshPart, first_vertex: Index, second_vertex: Index, linear_to_head: Doubles
) -> Mask:
    """Return the mask (n,) of vertex pairs that some morph target moves apart.

    first_vertex, second_vertex : (n,) vertex indices of the pairs
    linear_to_head : (3, 3) matrix from the space of the file to that of the head [mm]
    """
    apart, delta = np.zeros(len(first_vertex), bool), np.zeros((len(mesh_part.positions), 3))
    for vertex, delta_of_vertex in mesh_part.targets.values():
        delta[vertex] = delta_of_vertex @ linear_to_head.T
        apart |= np.linalg.norm(delta[first_vertex] - delta[second_vertex], axis=1) > COINCIDENCE_TOLERANCE_MM
        delta[vertex] = 0
    return apart


def _weights_differ(mesh_part: MeshPart, first_vertex: Index, second_vertex: Index) -> Mask:
    """Return the mask (n,) of vertex pairs with different bone weights.

    first_vertex, second_vertex : (n,) vertex indices of the pairs
    """
    if mesh_part.bone is None or mesh_part.weight is None:
        return np.zeros(len(first_vertex), bool)
    bones = np.concatenate([mesh_part.bone[first_vertex], mesh_part.bone[second_vertex]], axis=1)
    weights = np.concatenate([mesh_part.weight[first_vertex], -mesh_part.weight[second_vertex]], axis=1)
    same = bones[:, :, None] == bones[:, None, :]
    return np.asarray((np.abs((same * weights[:, None, :]).sum(axis=2)) > _BONE_WEIGHT_TOLERANCE).any(axis=1))


def build_rig(
    positions_mm: Floats,
    point_of_vertex: Ints,
    mesh_part: MeshPart,
    bones: Bones | None,
    weights: Mapping[str, float],
    to_head: Doubles,
    error_subject: object,
) -> Rig | None:
    """Return the rig that moves a mesh's points; None for a file with neither morph targets nor bones.

    positions_mm : (v, 3) vertices in the head's space
    point_of_vertex : (v,) index of the point of each vertex
    mesh_part : the same vertices with their morph targets and bone weights, in the file's space
    bones : bones of the file; None if it has none
    weights : default weights of morph targets by name
    to_head : (4, 4) matrix from the space of the file to that of the head [mm]
    error_subject : file, for errors

    Raises DermisError for bones with a scale of 0.
    """
    if not mesh_part.targets and bones is None:
        return None
    _, first = np.unique(point_of_vertex, return_index=True)
    point_positions = np.ascontiguousarray(positions_mm[first])
    skeleton = None if bones is None else _point_skeleton(mesh_part, bones, first, to_head, error_subject)
    return Rig(point_positions, _point_targets(mesh_part, point_of_vertex, first, weights, to_head), skeleton)


def _point_targets(
    mesh_part: MeshPart,
    point_of_vertex: Ints,
    first_vertex: Index,
    weights: Mapping[str, float],
    to_head: Doubles,
) -> MorphTargets:
    """Return the morph targets of the p points of a mesh.

    point_of_vertex : (v,) index of the point of each vertex
    first_vertex : (p,) first vertex of each point, whose displacement the point gets
    weights : default weights by target name
    mesh_part, to_head : see `build_rig`
    """
    if not mesh_part.targets:
        return no_targets()
    is_first = np.zeros(len(point_of_vertex), bool)
    is_first[first_vertex] = True
    points, deltas = [], []
    for vertex, delta in mesh_part.targets.values():
        delta_mm = (delta @ to_head[:3, :3].T).astype(np.float32)
        used = np.flatnonzero(is_first[vertex] & (np.abs(delta_mm) > _MIN_DISPLACEMENT_MM).any(axis=1))
        used = used[np.argsort(point_of_vertex[vertex[used]])]
        points.append(point_of_vertex[vertex[used]])
        deltas.append(delta_mm[used])
    start = np.cumsum([0, *map(len, points)]).astype(np.int32)
    rest = np.array([weights.get(name, 0.0) for name in mesh_part.targets], np.float32)
    return MorphTargets(
        tuple(mesh_part.targets),
        start,
        np.concatenate(points),
        np.concatenate(deltas),
        rest if rest.any() else None,
    )


def _point_skeleton(
    mesh_part: MeshPart, bones: Bones, first_vertex: Index, to_head: Doubles, error_subject: object
) -> Skeleton:
    """Return the skeleton of the p points of a mesh.

    first_vertex : (p,) first vertex of each point, whose bone weights the point gets
    mesh_part, bones, to_head, error_subject : see `build_rig`
    """
    assert mesh_part.bone is not None and mesh_part.weight is not None
    bone = np.zeros((len(first_vertex), BONES_PER_POINT), np.int32)
    weight = np.zeros((len(first_vertex), BONES_PER_POINT), np.float32)
    bone[:, : mesh_part.bone.shape[1]], weight[:, : mesh_part.weight.shape[1]] = (
        mesh_part.bone[first_vertex],
        mesh_part.weight[first_vertex],
    )
    size = np.linalg.norm(bones.world[:, :3, :3], axis=(1, 2))
    flat = np.abs(np.linalg.det(bones.world[:, :3, :3])) <= 1e-9 * size**3
    unusable = np.flatnonzero(flat & np.isin(np.arange(len(flat)), bone[weight > 0]))
    if len(unusable):
        actual = f"{bones.names[unusable[0]]!r} has a scale of 0 at rest"
        refuse(error_subject, "bones with a scale above 0", actual, "Export it with another scale")
    inverse = np.linalg.inv(np.where(flat[:, None, None], np.eye(4), bones.world))
    inverse_bind = np.asarray(inverse, np.float64)
    return Skeleton(bones.names, bones.parent, bones.local, inverse_bind, to_head, bone, weight)
