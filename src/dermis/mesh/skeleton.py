"""Skeletons: bones, and the transforms of the points that follow them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Floats, Intp, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.rotations import angles_matrix

INFLUENCES = 4
"""Number of bones that move a point; of more, those with the largest weights are kept."""
_IDENTITY = np.eye(4)
_MAX_SEQUENTIAL = 12


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton(ShortRepr):
    """Bones, parents before children, and the skin weights of points.

    names : (b,)
    parent : (b,) index of the parent, -1 for a root
    local : (b, 4, 4) from each bone's space to its parent's, at rest
    inverse_bind : (b, 4, 4) from the file's space to the bone's, in the bind pose
    to_head : (4, 4) from the file's space to the head's [mm]
    bone, weight : (p, 4) bones that each point follows, and their weights, which sum to 1
    """

    names: tuple[str, ...]
    parent: Ints
    local: Doubles
    inverse_bind: Doubles
    to_head: Doubles
    bone: Ints
    weight: Floats

    def matrices(self, local: Doubles | None = None) -> Doubles:
        """Return the matrices (b, 3, 4) that each bone applies to points at rest, in head space [mm].

        local : (b, 4, 4) from each bone's space to its parent's; those at rest if None
        """
        world = self._bone_to_file(self.local if local is None else local)
        matrices = self.to_head @ world @ self.inverse_bind @ np.linalg.inv(self.to_head)
        return np.asarray(matrices[:, :3])

    @cached_property
    def index(self) -> dict[str, int]:
        """Return the index of each bone by its name."""
        return {name: index for index, name in enumerate(self.names)}

    @cached_property
    def rest_matrices(self) -> Floats:
        """Return the matrices (b, 3, 4) at rest."""
        return self.matrices().astype(np.float32)

    @cached_property
    def origin_mm(self) -> list[list[float]]:
        """Return the position of each joint at rest (b, 3), in head space [mm]."""
        origins: list[list[float]] = (self.to_head @ self._bone_to_file(self.local))[:, :3, 3].tolist()
        return origins

    def bone_rotation(self, bone: int, degrees: Sequence[float]) -> list[float]:
        """Return the 16 numbers of the head-space matrix that rotates about a bone's joint at rest.

        degrees : angles about x, y and z, see `angles_matrix`
        """
        (a, b, c), (d, e, f), (g, h, i) = angles_matrix(degrees)
        x, y, z = self.origin_mm[bone]
        p, q, r = x - a * x - b * y - c * z, y - d * x - e * y - f * z, z - g * x - h * y - i * z
        return [a, b, c, p, d, e, f, q, g, h, i, r, 0.0, 0.0, 0.0, 1.0]

    def head_space_changes(self, bones: Sequence[int], local: Doubles) -> Doubles:
        """Return the head-space changes (n, 4, 4) that other local matrices of some bones make [mm]."""
        index = list(bones)
        return np.asarray(self._parent_to_head[index] @ local @ self._head_to_bone[index])

    def moved_matrices(self, bones: Sequence[int], changes: Doubles) -> Floats:
        """Return the matrices (b, 3, 4) when some bones move, together with their descendants.

        The cost for few bones depends on the number of changes, not on the number of bones.

        bones : (n,) indices, parents before children
        changes : (n, 4, 4) head-space change of each bone at rest [mm]
        """
        transforms = self._transforms if len(bones) <= _MAX_SEQUENTIAL else self._transforms_by_depth
        transform = transforms(bones, changes)
        if self._is_bound_at_rest:
            return transform[:, :3].astype(np.float32)
        matrices = transform[:, :3].copy()
        matrices[:, :, 3:] += transform[:, :3, :3] @ self.rest_matrices[:, :, 3:]
        matrices[:, :, :3] = transform[:, :3, :3] @ self.rest_matrices[:, :, :3]
        return matrices.astype(np.float32)

    def _transforms(self, bones: Sequence[int], changes: Doubles) -> Doubles:
        """Return the head-space change (b, 4, 4) of each bone, computed one change after the other."""
        nearest, transform = np.zeros(len(self.names), np.intp), np.empty((len(bones) + 1, 4, 4))
        transform[0] = _IDENTITY
        for index, bone in enumerate(bones, start=1):
            np.matmul(transform[nearest[bone]], changes[index - 1], out=transform[index])
            nearest[self._descendants[bone]] = index
        return transform[nearest]

    def _transforms_by_depth(self, bones: Sequence[int], changes: Doubles) -> Doubles:
        """Return the head-space change (b, 4, 4) of each bone, computed level by level of the hierarchy."""
        transform = np.tile(_IDENTITY, (len(self.names), 1, 1))
        transform[list(bones)] = changes
        for bones_of_depth, parents in self._depths[1:]:
            transform[bones_of_depth] = transform[parents] @ transform[bones_of_depth]
        return transform

    @cached_property
    def _depths(self) -> list[tuple[Ints, Ints]]:
        """Return the indices of the bones at each depth of the hierarchy, and of their parents."""
        depth = np.zeros(len(self.names), np.int64)
        for bone, parent in enumerate(self.parent.tolist()):
            depth[bone] = depth[parent] + 1 if parent >= 0 else 0
        levels = [np.flatnonzero(depth == k) for k in range(int(depth.max(initial=0)) + 1)]
        return [(level.astype(np.int32), self.parent[level]) for level in levels]

    def _bone_to_file(self, local: Doubles) -> Doubles:
        """Return the matrices (b, 4, 4) from each bone's space to the file's."""
        world = np.empty_like(local)
        for bone, parent in enumerate(self.parent.tolist()):
            world[bone] = world[parent] @ local[bone] if parent >= 0 else local[bone]
        return world

    @cached_property
    def _parent_to_head(self) -> Doubles:
        """Return the matrices (b, 4, 4) from the space of each bone's parent to the head's, at rest."""
        to_head = np.concatenate([self.to_head @ self._bone_to_file(self.local), self.to_head[None]])
        return np.asarray(to_head[self.parent])  # the last one is for roots, with parent -1

    @cached_property
    def _head_to_bone(self) -> Doubles:
        """Return the matrices (b, 4, 4) from the head's space to each bone's, at rest."""
        return np.asarray(np.linalg.pinv(self.to_head @ self._bone_to_file(self.local)))

    @cached_property
    def _descendants(self) -> list[Intp]:
        """Return the indices of each bone and its descendants."""
        descendants: list[list[int]] = [[] for _ in self.names]
        for bone in range(len(self.names)):
            ancestor = bone
            while ancestor >= 0:
                descendants[ancestor].append(bone)
                ancestor = int(self.parent[ancestor])
        return [np.array(bones, np.intp) for bones in descendants]

    @cached_property
    def follower_counts(self) -> Doubles:
        """Return the number of points (b,) that each bone and its descendants move, by their weights."""
        own = np.bincount(self.bone.ravel(), self.weight.ravel(), minlength=len(self.names))
        return np.array([own[bones].sum() for bones in self._descendants])

    @cached_property
    def _is_bound_at_rest(self) -> bool:
        """Return whether the matrices at rest are identities."""
        return bool(np.abs(self.rest_matrices - np.eye(3, 4, dtype=np.float32)).max(initial=0) < 1e-3)
