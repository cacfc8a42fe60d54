"""What moves the eyeballs that replace a file's: the bones and the targets that moved those."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.mesh.rig import INFLUENCES, Carried, MorphTargets, Rig, Skeleton, Turn
from dermis.mesh.rotations import matrix_angles, rigid_motion

_ROOT, _NAMES = "scene", ("eye.L", "eye.R")
_OTHERS = 0.05
"""Of the points that follow a bone: with more beside the eye's, it is the head's and not the eye's."""
_LEAST_DEGREES, _LEAST_MM = 0.5, 0.02


class Globe(NamedTuple):
    """An eyeball that replaces one of a file.

    middle : (3,) [mm]
    places : (n, 3) its control points [mm]
    replaced : (m,) control points of the one in the file
    """

    middle: Doubles
    places: Doubles
    replaced: Index


def with_globes(rig: Rig, globes: Sequence[Globe]) -> Rig:
    """The rig with eyeballs after all its points, which follow what moved those that they replace."""
    skeleton, bones = _with_bones(rig, globes)
    first = len(rig.positions_mm) + np.cumsum([0, *(len(one.places) for one in globes)])
    turns, targets = list(rig.turns), rig.targets
    for globe, bone, begin in zip(globes, bones, first, strict=False):
        origin = np.array(skeleton.origin_mm[bone])
        own, shifts = _rigid_targets(rig, globe, skeleton.names[bone], origin)
        turns += own
        targets = _shifted(targets, shifts, begin + np.arange(len(globe.places)))
    carried = [
        Carried(one.replaced.astype(np.int32), np.arange(begin, begin + len(one.places), dtype=np.int32))
        for one, begin in zip(globes, first, strict=False)
    ]
    places = np.concatenate([rig.positions_mm, *(one.places for one in globes)]).astype(np.float32)
    return replace(
        rig,
        positions_mm=places,
        targets=targets,
        skeleton=skeleton,
        turns=tuple(turns),
        carried=(*rig.carried, *carried),
    )


def _with_bones(rig: Rig, globes: Sequence[Globe]) -> tuple[Skeleton, list[int]]:
    """The skeleton with a bone for each eyeball, its own where the file has one, and their numbers."""
    skeleton = rig.skeleton or _still(len(rig.positions_mm))
    bones = _own_bones(skeleton, globes)
    for k, globe in enumerate(globes):
        if bones[k] < 0:
            above = int(np.argmax(_followed(skeleton, globe)))
            name = next(name for name in (_NAMES[k], f"fitted {_NAMES[k]}") if name not in skeleton.names)
            skeleton, bones[k] = _with_bone(skeleton, name, above, globe.middle), len(skeleton.names)
    for globe, bone in zip(globes, bones, strict=True):
        count = len(globe.places)
        weight = np.tile(np.eye(1, INFLUENCES, dtype=np.float32), (count, 1))
        number = np.zeros((count, INFLUENCES), np.int32)
        number[:, 0] = bone
        skeleton = replace(
            skeleton,
            bone=np.concatenate([skeleton.bone, number]),
            weight=np.concatenate([skeleton.weight, weight]),
        )
    return skeleton, bones


def _still(count: int) -> Skeleton:
    """One bone that all points follow."""
    unit = np.eye(4)[None]
    bone, weight = np.zeros((count, INFLUENCES), np.int32), np.zeros((count, INFLUENCES), np.float32)
    weight[:, 0] = 1.0
    return Skeleton((_ROOT,), np.array([-1], np.int32), unit, unit, np.eye(4), bone, weight)


def _own_bones(skeleton: Skeleton, globes: Sequence[Globe]) -> list[int]:
    """The bone that moves each eyeball and nothing else, -1 where there is none."""
    count, found = len(skeleton.names), list[int]()
    every = np.bincount(skeleton.bone.ravel(), skeleton.weight.ravel(), minlength=count)
    for globe in globes:
        own = _followed(skeleton, globe)
        bone = int(np.argmax(own))
        others = every[bone] - own[bone]
        found.append(bone if others <= _OTHERS * own[bone] else -1)
    return found


def _followed(skeleton: Skeleton, globe: Globe) -> Doubles:
    """(b,) how many points of the replaced eyeball follow each bone."""
    bone, weight = skeleton.bone[globe.replaced], skeleton.weight[globe.replaced]
    return np.bincount(bone.ravel(), weight.ravel(), len(skeleton.names)).astype(np.float64)


def _with_bone(skeleton: Skeleton, name: str, above: int, origin_mm: Doubles) -> Skeleton:
    """The skeleton with a bone more, which rests at a place in the head's space [mm]."""
    placed = np.eye(4)
    placed[:3, 3] = origin_mm
    world = np.linalg.inv(skeleton.to_head) @ placed
    return replace(
        skeleton,
        names=(*skeleton.names, name),
        parent=np.append(skeleton.parent, above).astype(np.int32),
        local=np.concatenate([skeleton.local, (skeleton.inverse_bind[above] @ world)[None]]),
        inverse_bind=np.concatenate([skeleton.inverse_bind, np.linalg.inv(world)[None]]),
    )


def _rigid_targets(
    rig: Rig, globe: Globe, bone: str, origin_mm: Doubles
) -> tuple[list[Turn], dict[int, Doubles]]:
    """Turns of a bone as targets turn the replaced eyeball, and by number how far they shift it [mm]."""
    rest = rig.positions_mm[globe.replaced].astype(np.float64)
    moved = rig.targets.dense(globe.replaced, len(rig.positions_mm)).astype(np.float64)
    turns, shifts = list[Turn](), dict[int, Doubles]()
    for number, delta in enumerate(moved):
        if np.abs(delta).max(initial=0.0) < _LEAST_MM:
            continue
        matrix, _ = rigid_motion(rest, rest + delta)
        x, y, z = matrix_angles(matrix)
        if np.linalg.norm((x, y, z)) < _LEAST_DEGREES:
            matrix = np.eye(3)
        else:
            turns.append(Turn(rig.targets.names[number], bone, (x, y, z)))
        middle = rest.mean(axis=0)
        shift = delta.mean(axis=0) - (matrix - np.eye(3)) @ (middle - origin_mm)
        if np.linalg.norm(shift) > _LEAST_MM:
            shifts[number] = shift
    return turns, shifts


def _shifted(targets: MorphTargets, shifts: dict[int, Doubles], points: Index) -> MorphTargets:
    """The targets that shift some points more, all of them alike."""
    if not shifts:
        return targets
    point, delta, count = list[Ints](), list[Floats](), [0]
    for number in range(len(targets.names)):
        those = [targets.point[targets.of(number)]]
        moved = [targets.delta_mm[targets.of(number)]]
        if number in shifts:
            those.append(points.astype(np.int32))
            moved.append(np.tile(shifts[number].astype(np.float32), (len(points), 1)))
        point += those
        delta += moved
        count.append(sum(map(len, those)))
    first = np.cumsum(count).astype(np.int32)
    return replace(targets, first=first, point=np.concatenate(point), delta_mm=np.concatenate(delta))
