"""Captures of faces: samples in rows, the targets that their names mean, and the bones that turn."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import MOST_WEIGHT, Pose
from dermis.mesh.rotations import matrix_angles, matrix_quaternion, quaternion_matrix, slerp
from dermis.mesh.skeleton import Skeleton

MAX_CLIP_BYTES = 48 << 20
"""Bytes of a capture's file."""
MAX_FRAMES, MAX_NAMES = 200_000, 500
"""Rows of a capture, almost an hour at 60 a second, and columns of it."""
_USUAL_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0)
_RATE_TOLERANCE = 0.02
_SIDE_LETTERS = {"l": "left", "r": "right"}
_PREFIX_WORDS = re.compile("mixamorig|cc|base|def|org|rig|bip|bone|joint|jnt|skel|j|c|x|m")
"""Words that programs write around the names of bones."""
_SIDES = {"left": "left", "l": "left", "right": "right", "r": "right"}
_NECKS, _EYES = (["neck"], ["neck", "twist"]), (["eye"], ["eyeball"])
_HEAD_FRACTION = 0.5  # of a turn; the neck's bones share the rest


@dataclass(frozen=True, eq=False)
class CaptureSamples:
    """Rows of a capture.

    times_s : (k,) that do not go back
    weights : (k, n) by name of a blend shape
    angles : by name of a bone of the head's (k, 3) [degrees]
    unused_names : names of angles for which the head has no bone
    """

    times_s: Doubles
    names: tuple[str, ...]
    weights: Doubles
    angles: Mapping[str, Doubles]
    unused_names: tuple[str, ...] = ()


def capture_clip(culprit: object, name: str, samples: CaptureSamples, head: Head) -> Clip:
    """The clip that rows of a capture are for a head, on lines between them.

    Raises DermisError when the head has none of its names.
    """
    meant = match_targets(samples.names, head.targets)
    if not meant and not samples.angles:
        refuse_unmatched(culprit, samples.names, head)
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

    left_out = tuple(one for one in samples.names if one not in meant) + samples.unused_names
    return Clip(name, float(times[-1]), frame_rate(times), targets, tuple(samples.angles), left_out, sample)


def refuse_unmatched(culprit: object, names: Sequence[str], head: Head) -> None:
    """Raise the error of a motion of which the head has no name."""
    actual = (
        f"it has {_short_list(names)} and the head {_short_list(head.targets) if head.targets else 'none'}"
    )
    advice = "Take a head with targets of these names, such as those of ARKit"
    refuse(culprit, "names of which the head has some", actual, advice)


def frame_rate(times: Doubles) -> float | None:
    """Frames a second of rows that are evenly spaced or nearly so, a usual rate where one is near."""
    steps = np.diff(times)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return None
    rate = 1 / float(np.median(steps))
    if np.mean(np.abs(steps * rate - 1) < 0.5) < 0.5:
        return None
    near = min(_USUAL_RATES, key=lambda usual: abs(usual - rate))
    return near if abs(near / rate - 1) < _RATE_TOLERANCE else rate


def check_weights(culprit: object, names: Sequence[str], values: Doubles) -> None:
    """Refuse weights (n,) of which one is no number of a sensible size."""
    lost = ~(np.abs(values) <= MOST_WEIGHT)
    if lost.any():
        expected = f"numbers from -{MOST_WEIGHT:g} to {MOST_WEIGHT:g}"
        first = int(lost.argmax())
        refuse(culprit, expected, f"{names[first]} is {values[first]:g}", "Correct or remove the line")


def check_size(culprit: object, frames: int, names: int) -> None:
    """Refuse captures that are none by their number of rows or columns."""
    if frames > MAX_FRAMES or names > MAX_NAMES:
        expected = f"at most {MAX_FRAMES:,} frames of {MAX_NAMES} numbers"
        actual = f"it has more ({frames:,} of {names:,} so far)"
        refuse(culprit, expected, actual, "Cut it, or leave out columns that no head has")


def _short_list(names: Sequence[str]) -> str:
    shown = ", ".join(names[:6])
    return f"{shown} and {len(names) - 6} more" if len(names) > 6 else shown


def match_targets(names: Iterable[str], targets: Sequence[str]) -> dict[str, str]:
    """By name the target of the head that it means; names that the head lacks are not there.

    EyeBlinkLeft, eyeBlink_L and blendShape1.eye_blink_left mean eyeBlinkLeft; a name in the same letters
    goes first.
    """
    exact, folded, plain = (
        {key(one): one for one in reversed(targets)} for key in (str, str.casefold, _plain_name)
    )
    found: dict[str, str] = {}
    for name in names:
        target = exact.get(name) or folded.get(name.casefold()) or plain.get(_plain_name(name))
        if target is not None and target not in found.values():
            found[name] = target
    return found


def _plain_name(name: str) -> str:
    """A name without what it belongs to, in small letters, sides in full."""
    last = name.rpartition(".")[2]
    side = re.fullmatch(r"(.+)[_\-. ]([lrLR])", last)
    whole = f"{side[1]}{_SIDE_LETTERS[side[2].lower()]}" if side else last
    return re.sub(r"[\W_]", "", whole).casefold()


@dataclass(frozen=True)
class RotationBones:
    """Names of a skeleton's bones that turn the head and each eye.

    head : by name, which share of the head's turn each takes; none where there is no such bone
    eyes : by "left" and "right"
    """

    head: Mapping[str, float]
    eyes: Mapping[str, str]


def find_rotation_bones(skeleton: Skeleton | None) -> RotationBones:
    """The bones called head, neck and eye, whatever programs write around it.

    Head, mixamorig:Head and CC_Base_Head are a head; neck, Neck1 and DEF-neck.002 above it are necks, LeftEye
    and eye.L an eye. The head takes half of a turn and the necks above it share the rest; alone, either
    takes all of it.
    """
    if skeleton is None:
        return RotationBones({}, {})
    words = [_bone_words(name) for name in skeleton.names]
    heads = [bone for bone, (what, side) in enumerate(words) if what == ["head"] and not side]
    head = heads[0] if heads else None
    necks = [bone for bone, (what, side) in enumerate(words) if what in _NECKS and not side]
    if head is not None:
        above = _ancestors(skeleton, head)
        necks = [bone for bone in necks if bone in above]
    eyes: dict[str, str] = {}
    for bone, (what, side) in enumerate(words):
        if what in _EYES and side:
            eyes.setdefault(side, skeleton.names[bone])
    shares = {bone: (1 - _HEAD_FRACTION if head is not None else 1.0) / len(necks) for bone in necks}
    if head is not None:
        shares[head] = _HEAD_FRACTION if necks else 1.0
    return RotationBones({skeleton.names[bone]: share for bone, share in shares.items()}, eyes)


def head_bone_angles(bones: RotationBones, turns: Doubles) -> dict[str, Doubles]:
    """Angles (k, 3) of each bone [degrees] that together turn the head by quaternions (k, 4)."""
    return {name: _euler_angles(_partial_rotation(turns, share)) for name, share in bones.head.items()}


def unwrap_degrees(degrees: Doubles) -> Doubles:
    """(k, 3) angles that do not jump by whole turns."""
    return np.asarray(np.unwrap(degrees, axis=0, period=360.0))


def rotation_quaternions(matrices: Sequence[Doubles]) -> Doubles:
    """(k, 4) the rotations of matrices (4, 4) as quaternions; scale and mirrors are left aside."""
    linear = np.array(matrices)[:, :3, :3]
    left, _, right = np.linalg.svd(linear)
    turns = left @ right
    turns[np.linalg.det(turns) < 0] *= -1
    return matrix_quaternion(turns)


def _partial_rotation(turns: Doubles, share: float) -> Doubles:
    still = np.broadcast_to([0.0, 0.0, 0.0, 1.0], turns.shape)
    return slerp(still, turns, share)


def _euler_angles(turns: Doubles) -> Doubles:
    matrices = quaternion_matrix(turns)[:, :3, :3]
    return unwrap_degrees(np.array([matrix_angles(matrix) for matrix in matrices]))


def _ancestors(skeleton: Skeleton, bone: int) -> set[int]:
    found = set()
    while (bone := int(skeleton.parent[bone])) >= 0:
        found.add(bone)
    return found


def _bone_words(name: str) -> tuple[list[str], str]:
    """The words that a bone's name is made of without numbers and prefixes, and its side."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|[\W_]|\d+", " ", name.rpartition(":")[2])
    words = [word for word in apart.lower().split() if not _PREFIX_WORDS.fullmatch(word)]
    sides = [_SIDES[word] for word in words if word in _SIDES]
    return [word for word in words if word not in _SIDES], sides[0] if len(sides) == 1 else ""
