"""Which bones turn the head and the eyes, for captures that know only angles."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.skeleton import Skeleton
from dermis.mesh.turns import matrix_angles, matrix_quaternion, quaternion_matrix, slerp

Doubles = NDArray[np.float64]

_ASIDE = frozenset(
    (
        "mixamorig",
        "cc",
        "base",
        "def",
        "org",
        "rig",
        "bip",
        "bone",
        "joint",
        "jnt",
        "skel",
        "j",
        "c",
        "x",
        "m",
    )
)
"""Words that programs write around the names of bones."""
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
_NECKS, _EYES = (["neck"], ["neck", "twist"]), (["eye"], ["eyeball"])
_HEAD_SHARE = 0.5  # of a turn; the neck's bones share the rest


@dataclass(frozen=True)
class TurningBones:
    """Names of a skeleton's bones that turn the head and each eye.

    head : by name, which share of the head's turn each takes; none where there is no such bone
    eyes : by "left" and "right"
    """

    head: Mapping[str, float]
    eyes: Mapping[str, str]


def turning_bones(skeleton: Skeleton | None) -> TurningBones:
    """The bones called head, neck and eye, whatever programs write around it.

    Head, mixamorig:Head and CC_Base_Head are a head; neck, Neck1 and DEF-neck.002 above it are necks, LeftEye
    and eye.L an eye. The head takes half of a turn and the necks above it share the rest; alone, either
    takes all of it.
    """
    if skeleton is None:
        return TurningBones({}, {})
    words = [_words(name) for name in skeleton.names]
    heads = [bone for bone, (what, side) in enumerate(words) if what == ["head"] and not side]
    head = heads[0] if heads else None
    necks = [bone for bone, (what, side) in enumerate(words) if what in _NECKS and not side]
    if head is not None:
        above = _above(skeleton, head)
        necks = [bone for bone in necks if bone in above]
    eyes: dict[str, str] = {}
    for bone, (what, side) in enumerate(words):
        if what in _EYES and side:
            eyes.setdefault(side, skeleton.names[bone])
    shares = {bone: (1 - _HEAD_SHARE if head is not None else 1.0) / len(necks) for bone in necks}
    if head is not None:
        shares[head] = _HEAD_SHARE if necks else 1.0
    return TurningBones({skeleton.names[bone]: share for bone, share in shares.items()}, eyes)


def head_turns(bones: TurningBones, turns: Doubles) -> dict[str, Doubles]:
    """Angles (k, 3) of each bone [degrees] that together turn the head by quaternions (k, 4)."""
    return {name: _angles(_part(turns, share)) for name, share in bones.head.items()}


def steady(degrees: Doubles) -> Doubles:
    """(k, 3) angles that do not jump by whole turns."""
    return np.asarray(np.unwrap(degrees, axis=0, period=360.0))


def matrix_turns(matrices: Sequence[Doubles]) -> Doubles:
    """(k, 4) the rotations of matrices (4, 4) as quaternions; scale and mirrors are left aside."""
    linear = np.array(matrices)[:, :3, :3]
    left, _, right = np.linalg.svd(linear)
    turns = left @ right
    turns[np.linalg.det(turns) < 0] *= -1
    return matrix_quaternion(turns)


def _part(turns: Doubles, share: float) -> Doubles:
    still = np.broadcast_to([0.0, 0.0, 0.0, 1.0], turns.shape)
    return slerp(still, turns, share)


def _angles(turns: Doubles) -> Doubles:
    matrices = quaternion_matrix(turns)[:, :3, :3]
    return steady(np.array([matrix_angles(matrix) for matrix in matrices]))


def _above(skeleton: Skeleton, bone: int) -> set[int]:
    found = set()
    while (bone := int(skeleton.parent[bone])) >= 0:
        found.add(bone)
    return found


def _words(name: str) -> tuple[list[str], str]:
    """The words that a bone's name is made of without numbers and prefixes, and its side."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|[\W_]|\d+", " ", name.rpartition(":")[2])
    words = [word for word in apart.lower().split() if word not in _ASIDE]
    sides = [_SIDES[word] for word in words if word in _SIDES]
    return [word for word in words if word not in _SIDES], sides[0] if len(sides) == 1 else ""
