"""Eyes that look at a place: both converge on it, and the lids follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import numbers
from dermis.formats.motion.captures import matched
from dermis.human.movement import gaze
from dermis.mesh.head import Head
from dermis.mesh.pose import FARTHEST_MM, Pose
from dermis.mesh.rig import Rig, Turn
from dermis.mesh.rotations import angles_matrix

Doubles = NDArray[np.float64]

MOST_GAZE = 1.3
"""Weight of a target of gaze that no eye turns beyond."""
_MOST_DEGREES = 36.0
_STEPS = 6
_SIDES = "Left", "Right"
_NAME_THEM = "Take the parametric human, or name the groups of the file's eyeballs with --eye-groups"


def looking_at(head: Head, place_mm: ArrayLike, pose: Pose | Mapping[str, float] | None = None) -> Pose:
    """The pose with the eyes turned to a place, by the targets that turn them, or else by their bones.

    place_mm : (3,) from the head's centre, as cameras are placed [mm]
    pose : of all else; its own gaze is given up

    Raises DermisError for heads without eyes of true shape, and for places that are none.
    """
    base, rig, eyes = Pose.of(pose) or Pose(), head.control, head.eyes
    if eyes is None or rig.skeleton is None:
        remedy = f"{head.note}. {_NAME_THEM}" if head.note else _NAME_THEM
        refuse(head.name, "a head with eyes that turn", "it has none", remedy)
    place = numbers("look at", place_mm, (3,), -FARTHEST_MM, FARTHEST_MM, "mm from the head's centre")
    own = [rig.skeleton.names[bone] for bone in rig.skeleton.bone[eyes.apex, 0]]
    weights = {name: value for name, value in base.weights.items() if name not in _names(rig.turns, own)}
    bones = {name: value for name, value in base.bones.items() if name not in own}
    frames = eyes.frames(rig, Pose(weights, bones, base.positions_mm).motion(rig))
    resting = eyes.frames(rig, rig.rest)
    for k, (frame, rest, bone) in enumerate(zip(frames, resting, own, strict=True)):
        seen = (frame @ np.append(place + np.array(head.centre_mm), 1.0))[:3] - [0.0, 0.0, eyes.middle_mm[k]]
        angles = _turning(_unit(rest[:3, :3].T @ seen), _unit(rest[:3, :3].T @ eyes.sight[k]))
        turns = [turn for turn in rig.turns if turn.bone == bone]
        if not turns:
            bones[bone] = [*np.clip(np.degrees(angles), -_MOST_DEGREES, _MOST_DEGREES).tolist(), 0.0]
            turns = _of_lids(rig, _SIDES[k])
        weights |= _weights(turns, angles)
    return Pose(weights, bones, base.positions_mm)


def _of_lids(rig: Rig, side: str) -> list[Turn]:
    """What ARKit's targets of gaze, which move a file's lids alone, stand for."""
    usual = [turn for turn in gaze() if turn.target.endswith(side)]
    known = matched([turn.target for turn in usual], rig.targets.names)
    return [turn._replace(target=known[turn.target]) for turn in usual if turn.target in known]


def _turning(wanted: Doubles, axis: Doubles) -> tuple[float, float]:
    """Angles about x and y [rad] by which an axis comes to lie along another, unit vectors (3,)."""
    x, y = 0.0, 0.0
    for _ in range(_STEPS):
        now = np.array(angles_matrix((math.degrees(x), math.degrees(y), 0.0))) @ axis
        x += _pitch(wanted) - _pitch(now)
        y += math.remainder(_yaw(wanted) - _yaw(now), math.tau)
    return x, y


def _pitch(way: Doubles) -> float:
    return -math.atan2(way[1], math.hypot(way[0], way[2]))


def _yaw(way: Doubles) -> float:
    return math.atan2(way[0], way[2])


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))


def _names(turns: tuple[Turn, ...], bones: list[str]) -> set[str]:
    return {turn.target for turn in turns if turn.bone in bones}


def _weights(turns: list[Turn], wanted: tuple[float, float]) -> dict[str, Any]:
    """Weights of targets for angles about x and y [rad]."""
    found = {}
    for turn in turns:
        for angle, most in zip(np.degrees(wanted), turn.degrees[:2], strict=True):
            if most and angle / most > 0:
                found[turn.target] = float(min(angle / most, MOST_GAZE))
    return found
