"""Clips of samples, one a row: weights of targets and angles of bones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.head import Head
from dermis.scene.clips.clip import Clip
from dermis.scene.clips.names import matched
from dermis.scene.pose import MOST_WEIGHT, Pose

Doubles = NDArray[np.float64]

MOST_CLIP = 48 << 20
"""Bytes of a capture's file."""
MOST_FRAMES, MOST_NAMES = 200_000, 500
"""Rows of a capture, almost an hour at 60 a second, and columns of it."""
_USUAL_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0)
_NEARLY = 0.02


@dataclass(frozen=True, eq=False)
class Samples:
    """Rows of a capture.

    times_s : (k,) that do not go back
    weights : (k, n) by name of a blend shape
    angles : by name of a bone of the head's (k, 3) [degrees]
    lost : names of angles for which the head has no bone
    """

    times_s: Doubles
    names: tuple[str, ...]
    weights: Doubles
    angles: Mapping[str, Doubles]
    lost: tuple[str, ...] = ()


def sampled_clip(culprit: object, name: str, samples: Samples, head: Head) -> Clip:
    """The clip that rows of a capture are for a head, on lines between them.

    Raises DermisError when the head has none of its names.
    """
    meant = matched(samples.names, head.targets)
    if not meant and not samples.angles:
        refuse_names(culprit, samples.names, head)
    times = samples.times_s - samples.times_s[0]
    columns = [samples.names.index(one) for one in meant]
    weights, targets = samples.weights[:, columns], tuple(meant.values())

    def sample(seconds: float) -> Pose:
        index = int(np.searchsorted(times, seconds, side="right")) - 1
        after = min(index + 1, len(times) - 1)
        step = float(times[after] - times[index])
        share = (seconds - float(times[index])) / step if step > 0 else 0.0
        mixed = (1 - share) * weights[index] + share * weights[after]
        turned = {
            bone: ((1 - share) * rows[index] + share * rows[after]).tolist()
            for bone, rows in samples.angles.items()
        }
        return Pose(dict(zip(targets, mixed.tolist(), strict=True)), turned)

    left_out = tuple(one for one in samples.names if one not in meant) + samples.lost
    return Clip(name, float(times[-1]), rate_of(times), targets, tuple(samples.angles), left_out, sample)


def refuse_names(culprit: object, names: Sequence[str], head: Head) -> None:
    """Raise the error of a motion of which the head has no name."""
    came = f"it has {_some(names)} and the head {_some(head.targets) if head.targets else 'none'}"
    remedy = "Take a head with targets of these names, such as those of ARKit"
    refuse(culprit, "names of which the head has some", came, remedy)


def rate_of(times: Doubles) -> float | None:
    """Frames a second of rows that are evenly spaced or nearly so, a usual rate where one is near."""
    steps = np.diff(times)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return None
    rate = 1 / float(np.median(steps))
    if np.mean(np.abs(steps * rate - 1) < 0.5) < 0.5:
        return None
    near = min(_USUAL_RATES, key=lambda usual: abs(usual - rate))
    return near if abs(near / rate - 1) < _NEARLY else rate


def check_weights(culprit: object, names: Sequence[str], values: Doubles) -> None:
    """Refuse weights (n,) of which one is no number of a sensible size."""
    lost = ~(np.abs(values) <= MOST_WEIGHT)
    if lost.any():
        expected = f"numbers from -{MOST_WEIGHT:g} to {MOST_WEIGHT:g}"
        first = int(lost.argmax())
        refuse(culprit, expected, f"{names[first]} is {values[first]:g}", "Correct or remove the line")


def check_size(culprit: object, frames: int, names: int) -> None:
    """Refuse captures that are none by their number of rows or columns."""
    if frames > MOST_FRAMES or names > MOST_NAMES:
        expected = f"at most {MOST_FRAMES:,} frames of {MOST_NAMES} numbers"
        came = f"it has more ({frames:,} of {names:,} so far)"
        refuse(culprit, expected, came, "Cut it, or leave out columns that no head has")


def _some(names: Sequence[str]) -> str:
    shown = ", ".join(names[:6])
    return f"{shown} and {len(names) - 6} more" if len(names) > 6 else shown
