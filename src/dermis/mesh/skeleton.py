"""Bones, and where they take the points that follow them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Floats, Intp, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.rotations import angles_matrix

INFLUENCES = 4
"""Bones that move a point; of more, those with the largest weights stay."""
_STILL = np.eye(4)
_FEW = 12


@dataclass(frozen=True, eq=False, repr=False)
class Skeleton(ShortRepr):
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
        world = self._world(self.local if local is None else local)
        moved = self.to_head @ world @ self.inverse_bind @ np.linalg.inv(self.to_head)
        return np.asarray(moved[:, :3])

    @cached_property
    def index(self) -> dict[str, int]:
        """Number of each bone by its name."""
        return {name: index for index, name in enumerate(self.names)}

    @cached_property
    def resting(self) -> Floats:
        """(b, 3, 4) the matrices at rest."""
        return self.matrices().astype(np.float32)

    @cached_property
    def origin_mm(self) -> list[list[float]]:
        """(b, 3) where each bone turns, at rest, in the head's space [mm]."""
        places: list[list[float]] = (self.to_head @ self._world(self.local))[:, :3, 3].tolist()
        return places

    def turned(self, bone: int, degrees: Sequence[float]) -> list[float]:
        """The 16 numbers of what a turn does about where a bone rests, in the head's space [mm].

        degrees : about x, y and z; see `angles_matrix`
        """
        (a, b, c), (d, e, f), (g, h, i) = angles_matrix(degrees)
        x, y, z = self.origin_mm[bone]
        p, q, r = x - a * x - b * y - c * z, y - d * x - e * y - f * z, z - g * x - h * y - i * z
        return [a, b, c, p, d, e, f, q, g, h, i, r, 0.0, 0.0, 0.0, 1.0]

    def changes(self, bones: Sequence[int], local: Doubles) -> Doubles:
        """(n, 4, 4) what other matrices from bones' spaces to their parents' do in the head's space [mm]."""
        index = list(bones)
        return np.asarray(self._above[index] @ local @ self._inward[index])

    def moved(self, bones: Sequence[int], changes: Doubles) -> Floats:
        """(b, 3, 4) the matrices when some bones move, and with them all below.

        bones : (n,) their numbers, parents before children
        changes : (n, 4, 4) what moves each in the head's space at rest [mm]

        Few cost as much as there are changes, not bones.
        """
        taken = self._taken(bones, changes) if len(bones) <= _FEW else self._all_taken(bones, changes)
        if self._bound_at_rest:
            return taken[:, :3].astype(np.float32)
        moved = taken[:, :3].copy()
        moved[:, :, 3:] += taken[:, :3, :3] @ self.resting[:, :, 3:]
        moved[:, :, :3] = taken[:, :3, :3] @ self.resting[:, :, :3]
        return moved.astype(np.float32)

    def _taken(self, bones: Sequence[int], changes: Doubles) -> Doubles:
        """(b, 4, 4) where each bone is taken, by one change after the other."""
        nearest, taken = self._unmoved.copy(), np.empty((len(bones) + 1, 4, 4))
        taken[0] = _STILL
        for number, bone in enumerate(bones, start=1):
            np.matmul(taken[nearest[bone]], changes[number - 1], out=taken[number])
            nearest[self._below[bone]] = number
        return taken[nearest]

    def _all_taken(self, bones: Sequence[int], changes: Doubles) -> Doubles:
        """The same, all bones of one depth at once."""
        taken = np.tile(_STILL, (len(self.names), 1, 1))
        taken[list(bones)] = changes
        for bones_of_depth, parents in self._depths[1:]:
            taken[bones_of_depth] = taken[parents] @ taken[bones_of_depth]
        return taken

    @cached_property
    def _depths(self) -> list[tuple[Ints, Ints]]:
        """Numbers of the bones at each depth, and of their parents."""
        depth = np.zeros(len(self.names), np.int64)
        for bone, parent in enumerate(self.parent.tolist()):
            depth[bone] = depth[parent] + 1 if parent >= 0 else 0
        levels = [np.flatnonzero(depth == k) for k in range(int(depth.max(initial=0)) + 1)]
        return [(level.astype(np.int32), self.parent[level]) for level in levels]

    def _world(self, local: Doubles) -> Doubles:
        """(b, 4, 4) from each bone's space to the file's."""
        world = np.empty_like(local)
        for bone, parent in enumerate(self.parent.tolist()):
            world[bone] = world[parent] @ local[bone] if parent >= 0 else local[bone]
        return world

    @cached_property
    def _above(self) -> Doubles:
        """(b, 4, 4) from the space of each bone's parent to the head's, at rest."""
        placed = np.concatenate([self.to_head @ self._world(self.local), self.to_head[None]])
        return np.asarray(placed[self.parent])  # -1 is the last

    @cached_property
    def _inward(self) -> Doubles:
        """(b, 4, 4) from the head's space to each bone's, at rest."""
        return np.asarray(np.linalg.pinv(self.to_head @ self._world(self.local)))

    @cached_property
    def _below(self) -> list[Intp]:
        """Numbers of each bone and of all below it."""
        below: list[list[int]] = [[] for _ in self.names]
        for bone in range(len(self.names)):
            above = bone
            while above >= 0:
                below[above].append(bone)
                above = int(self.parent[above])
        return [np.array(bones, np.intp) for bones in below]

    @cached_property
    def following(self) -> Doubles:
        """(b,) how many points each bone moves with all below it, by their weights."""
        own = np.bincount(self.bone.ravel(), self.weight.ravel(), minlength=len(self.names))
        return np.array([own[below].sum() for below in self._below])

    @cached_property
    def _unmoved(self) -> Intp:
        return np.zeros(len(self.names), np.intp)

    @cached_property
    def _bound_at_rest(self) -> bool:
        """Whether the matrices at rest are those that change nothing."""
        return bool(np.abs(self.resting - np.eye(3, 4, dtype=np.float32)).max(initial=0) < 1e-3)
