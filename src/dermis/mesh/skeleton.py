"""Skeletons: hierarchies of bones, and the matrices by which they transform points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Floats, Intp, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.rotations import angles_matrix

BONES_PER_POINT = 4
"""Largest number of bones that move a point; if a file has more, those with the largest weights are kept."""
_IDENTITY_MATRIX = np.eye(4)
_MAX_SEQUENTIAL_BONES = 12  # largest number of moving bones that are handled one after the other


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton(ShortRepr):
    """Hierarchy of b bones, parents before children, with the skin weights of p points.

    names : (b,) names of the bones
    parent : (b,) index of each bone's parent, -1 for a root
    local : (b, 4, 4) rest transforms from each bone's space to its parent's space
    inverse_bind : (b, 4, 4) transforms from file space to each bone's space, in the bind pose
    to_head : (4, 4) transform from file space to head space [mm]
    bone, weight : (p, 4) bones that each point follows, and their weights, which sum to 1
    """

    names: tuple[str, ...]
    parent: Ints
    local: Doubles
    inverse_bind: Doubles
    to_head: Doubles
    bone: Ints
    weight: Floats

    def matrices(self, local_transforms: Doubles | None = None) -> Doubles:
        """Return the bone matrices (b, 3, 4), which transform points at rest in head space [mm].

        local_transforms : (b, 4, 4) transforms from each bone's space to its parent's; None for the rest pose
        """
        world = self._bone_to_file(self.local if local_transforms is None else local_transforms)
        matrices = self.to_head @ world @ self.inverse_bind @ np.linalg.inv(self.to_head)
        return np.asarray(matrices[:, :3])

    @cached_property
    def index_by_name(self) -> dict[str, int]:
        """Return a dictionary from the name of each bone to its index."""
        return {name: index for index, name in enumerate(self.names)}

    @cached_property
    def rest_matrices(self) -> Floats:
        """Return the bone matrices (b, 3, 4) in the rest pose."""
        return self.matrices().astype(np.float32)

    @cached_property
    def joint_positions_mm(self) -> list[list[float]]:
        """Return the positions (b, 3) of the joints at rest, in head space [mm]."""
        origins: list[list[float]] = (self.to_head @ self._bone_to_file(self.local))[:, :3, 3].tolist()
        return origins

    def joint_rotation_matrix(self, bone_index: int, degrees: Sequence[float]) -> list[float]:
        """Return the head-space matrix that rotates about a bone's joint at rest, as 16 numbers row by row.

        degrees : angles about x, y and z, see `angles_matrix`
        """
        (a, b, c), (d, e, f), (g, h, i) = angles_matrix(degrees)
        x, y, z = self.joint_positions_mm[bone_index]
        p, q, r = x - a * x - b * y - c * z, y - d * x - e * y - f * z, z - g * x - h * y - i * z
        return [a, b, c, p, d, e, f, q, g, h, i, r, 0.0, 0.0, 0.0, 1.0]

    def head_space_transforms(self, bones: Sequence[int], local_transforms: Doubles) -> Doubles:
        """Return the transforms (n, 4, 4) in head space that move n bones from their rest pose [mm].

        bones : (n,) indices of the bones
        local_transforms : (n, 4, 4) new transforms from the space of each bone to the space of its parent
        """
        index = list(bones)
        return np.asarray(self._parent_to_head[index] @ local_transforms @ self._head_to_bone[index])

    def pose_matrices(self, bones: Sequence[int], bone_changes: Doubles) -> Floats:
        """Return the bone matrices (b, 3, 4) of a pose in which n bones and their descendants move.

        bones : (n,) indices of the n bones, parents before children
        bone_changes : (n, 4, 4) head-space transform of each of these bones relative to its rest pose,
            without the motion of its parent [mm]
        """
        transforms = (
            self._compose_bone_by_bone
            if len(bones) <= _MAX_SEQUENTIAL_BONES
            else self._compose_level_by_level
        )
        transform = transforms(bones, bone_changes)
        if self._is_bound_at_rest:
            return transform[:, :3].astype(np.float32)
        matrices = transform[:, :3].copy()
        matrices[:, :, 3:] += transform[:, :3, :3] @ self.rest_matrices[:, :, 3:]
        matrices[:, :, :3] = transform[:, :3, :3] @ self.rest_matrices[:, :, :3]
        return matrices.astype(np.float32)

    def _compose_bone_by_bone(self, bones: Sequence[int], bone_changes: Doubles) -> Doubles:
        """Return the head-space transform (b, 4, 4) of every bone of the skeleton, relative to its rest pose.

        It is the product of the changes of the bone's moved ancestors, topmost first, and of its own change.
        The moved bones are handled one after the other, which is fast if there are few of them. The
        parameters are those of `pose_matrices`.
        """
        nearest, transform = np.zeros(len(self.names), np.intp), np.empty((len(bones) + 1, 4, 4))
        transform[0] = _IDENTITY_MATRIX
        for index, bone in enumerate(bones, start=1):
            np.matmul(transform[nearest[bone]], bone_changes[index - 1], out=transform[index])
            nearest[self._descendants[bone]] = index
        return transform[nearest]

    def _compose_level_by_level(self, bones: Sequence[int], bone_changes: Doubles) -> Doubles:
        """Return the same transforms (b, 4, 4) as `_compose_bone_by_bone`, from the same parameters.

        All bones at the same level of the hierarchy are handled at once, which is fast if many bones move.
        """
        transform = np.tile(_IDENTITY_MATRIX, (len(self.names), 1, 1))
        transform[list(bones)] = bone_changes
        for bones_of_depth, parents in self._bones_by_depth[1:]:
            transform[bones_of_depth] = transform[parents] @ transform[bones_of_depth]
        return transform

    @cached_property
    def _bones_by_depth(self) -> list[tuple[Ints, Ints]]:
        """Return for each level of the hierarchy the indices of its bones and of their parents."""
        depth = np.zeros(len(self.names), np.int64)
        for bone, parent in enumerate(self.parent.tolist()):
            depth[bone] = depth[parent] + 1 if parent >= 0 else 0
        levels = [np.flatnonzero(depth == k) for k in range(int(depth.max(initial=0)) + 1)]
        return [(level.astype(np.int32), self.parent[level]) for level in levels]

    def _bone_to_file(self, local_transforms: Doubles) -> Doubles:
        """Return the matrices (b, 4, 4) from each bone's space to the file's space."""
        world = np.empty_like(local_transforms)
        for bone, parent in enumerate(self.parent.tolist()):
            world[bone] = world[parent] @ local_transforms[bone] if parent >= 0 else local_transforms[bone]
        return world

    @cached_property
    def _parent_to_head(self) -> Doubles:
        """Return the matrices (b, 4, 4) from the space of each bone's parent to head space, at rest."""
        to_head = np.concatenate([self.to_head @ self._bone_to_file(self.local), self.to_head[None]])
        return np.asarray(to_head[self.parent])  # the last matrix is for roots, whose parent is -1

    @cached_property
    def _head_to_bone(self) -> Doubles:
        """Return the matrices (b, 4, 4) from head space to each bone's space, at rest."""
        return np.asarray(np.linalg.pinv(self.to_head @ self._bone_to_file(self.local)))

    @cached_property
    def _descendants(self) -> list[Intp]:
        """Return for each bone the indices of the bone and of its descendants."""
        descendants: list[list[int]] = [[] for _ in self.names]
        for bone in range(len(self.names)):
            ancestor = bone
            while ancestor >= 0:
                descendants[ancestor].append(bone)
                ancestor = int(self.parent[ancestor])
        return [np.array(bones, np.intp) for bones in descendants]

    @cached_property
    def subtree_weight_sums(self) -> Doubles:
        """Return for each bone (b,) the sum of the skin weights of the bone and of its descendants."""
        own = np.bincount(self.bone.ravel(), self.weight.ravel(), minlength=len(self.names))
        return np.array([own[bones].sum() for bones in self._descendants])

    @cached_property
    def _is_bound_at_rest(self) -> bool:
        """Return whether bind pose and rest pose agree, so that the bone matrices at rest are identities."""
        return bool(np.abs(self.rest_matrices - np.eye(3, 4, dtype=np.float32)).max(initial=0) < 1e-3)
