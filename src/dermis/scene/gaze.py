"""Eyes that look at a place: both converge on it, and the lids follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dermis.errors import refuse
from dermis.mesh.head import Head
from dermis.mesh.rig import Turn
from dermis.scene.pose import Pose

MOST_GAZE = 1.3
"""Weight of a target of gaze that no eye turns beyond."""


def looking_at(head: Head, place_mm: ArrayLike, pose: Pose | Mapping[str, float] | None = None) -> Pose:
    """The pose with the eyes turned to a place, by the targets that turn them.

    place_mm : (3,) from the head's centre, as cameras are placed [mm]
    pose : of all else; its own gaze is given up

    Raises DermisError for heads without eyes of true shape, and for places that are none.
    """
    base, rig, eyes = Pose.of(pose) or Pose(), head.control, head.eyes
    if eyes is None or rig.skeleton is None or not rig.turns:
        refuse(head.name, "a head with eyes that turn", "it has none", "Take the parametric human")
    place = np.asarray(place_mm, np.float64)
    if place.shape != (3,) or not np.isfinite(place).all():
        refuse(
            "look at", "three numbers, in mm from the head's centre", f"{place_mm!r:.60} came", "Correct it"
        )
    weights = {name: value for name, value in base.weights.items() if name not in _names(rig.turns)}
    straight = Pose(weights, base.bones, base.positions_mm)
    frames = eyes.frames(rig, straight.motion(rig))
    for frame, apex in zip(frames, eyes.apex, strict=True):
        x, y, z = (frame @ np.append(place + np.array(head.centre_mm), 1.0))[:3]
        bone = rig.skeleton.names[rig.skeleton.bone[apex, 0]]
        turns = [turn for turn in rig.turns if turn.bone == bone]
        weights |= _weights(turns, (-math.atan2(y, math.hypot(x, z)), math.atan2(x, z)))
    return Pose(weights, base.bones, base.positions_mm)


def _names(turns: tuple[Turn, ...]) -> set[str]:
    return {turn.target for turn in turns}


def _weights(turns: list[Turn], wanted: tuple[float, float]) -> dict[str, Any]:
    """Weights of targets for angles about x and y [rad]."""
    found = {}
    for turn in turns:
        for angle, most in zip(np.degrees(wanted), turn.degrees[:2], strict=True):
            if most and angle / most > 0:
                found[turn.target] = float(min(angle / most, MOST_GAZE))
    return found
