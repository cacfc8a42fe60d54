"""Facial captures: matching of blend shapes to morph targets, and of head and eye rotations to bones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import notify, refuse
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.pose import MAX_WEIGHT, Pose
from dermis.mesh.rotations import matrix_angles, matrix_quaternion, quaternion_matrix, slerp
from dermis.mesh.skeleton import Skeleton

MAX_CLIP_BYTES = 48 << 20
"""Largest size of a capture file [byte]."""
MAX_CAPTURE_FRAMES, MAX_CAPTURE_COLUMNS = 200_000, 500
"""Largest numbers of frames (almost an hour at 60 per second) and of columns in a capture."""
SECONDS_PER_TIME_KEY: Mapping[str, float | None] = {
    "time": 1.0,
    "times": 1.0,
    "timestamps": 1.0,
    "seconds": 1.0,
    "timems": 1e-3,
    "timestampms": 1e-3,
    "timestampinmilliseconds": 1e-3,
    "timestampus": 1e-6,
    "timestamp": None,
}
"""Dictionary from the key of a frame's time (see `plain_key`) to the unit of the time [s]; None if the key
states no unit."""
FRAME_NUMBER_KEYS = ("frame", "frameindex", "framenumber", "frameid")
"""Keys (see `plain_key`) under which files store the number of a frame."""
NEUTRAL_SHAPE_NAME = "_neutral"
"""MediaPipe's score of the neutral face, which is not a blend shape."""
MAX_STATED_TIME = 1e19
"""Largest time of a frame in any unit: nanoseconds of three centuries."""
_MAX_FRAME_INTERVAL_S = 2.0  # largest plausible median interval between frames of a capture
_TIME_UNIT_NAMES = {1.0: "seconds", 1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
# range of the largest weight of a capture in percent; fractions are smaller
_PERCENT_WEIGHT_RANGE = (10.0, 200.0)
_MAX_PLAUSIBLE_WEIGHT = 2.0  # larger than the weights of exaggerated poses
_COMMON_FRAME_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0)
_FRAME_RATE_TOLERANCE = 0.02
_SIDE_LETTERS = {"l": "left", "r": "right"}
_PREFIX_WORD_PATTERN = re.compile("mixamorig|cc|base|def|org|rig|bip|bone|joint|jnt|skel|j|c|x|m")
"""Words that programs add to the names of bones."""
_SIDE_OF_WORD = {"left": "left", "l": "left", "right": "right", "r": "right"}
_NECK_WORDS, _EYE_WORDS = (["neck"], ["neck", "twist"]), (["eye"], ["eyeball"])
# part of a head rotation that the head bone performs; neck bones perform the rest
_HEAD_BONE_ROTATION_FRACTION = 0.5


@dataclass(frozen=True, eq=False)
class CaptureSamples:
    """Blend shape weights and bone angles of the k frames of a facial capture.

    times_s : (k,) times of the frames, not decreasing [s]
    names : (n,) names of the blend shapes
    weights : (k, n) weights of the blend shapes
    angles : dictionary from bone name to Euler angles (k, 3) [degrees]
    unused_names : names of angle columns in the file for which the head has no bone
    """

    times_s: Doubles
    names: tuple[str, ...]
    weights: Doubles
    angles: Mapping[str, Doubles]
    unused_names: tuple[str, ...] = ()


def capture_clip(error_subject: object, clip_name: str, samples: CaptureSamples, head: Head) -> Clip:
    """Return a facial capture as a clip for a head, linearly interpolated between frames.

    error_subject : file of the capture, for errors
    clip_name : name of the clip
    samples : blend shape weights and bone angles of the capture

    Raises DermisError when no name matches the head.
    """
    target_of_name = match_targets(samples.names, head.targets)
    if not target_of_name and not samples.angles:
        refuse_unmatched_motion(error_subject, samples.names, head)
    times = samples.times_s - samples.times_s[0]
    columns = [samples.names.index(name) for name in target_of_name]
    weights, targets = samples.weights[:, columns], tuple(target_of_name.values())

    def sample(seconds: float) -> Pose:
        index = int(np.searchsorted(times, seconds, side="right")) - 1
        after = min(index + 1, len(times) - 1)
        step = float(times[after] - times[index])
        fraction = (seconds - float(times[index])) / step if step > 0 else 0.0
        values = (1 - fraction) * weights[index] + fraction * weights[after]
        angles = {
            bone: ((1 - fraction) * rows[index] + fraction * rows[after]).tolist()
            for bone, rows in samples.angles.items()
        }
        return Pose(dict(zip(targets, values.tolist(), strict=True)), angles)

    unused = tuple(name for name in samples.names if name not in target_of_name) + samples.unused_names
    return Clip(
        clip_name,
        float(times[-1]),
        estimate_frame_rate(times),
        targets,
        tuple(samples.angles),
        unused,
        sample,
    )


def refuse_unmatched_motion(error_subject: object, capture_names: Sequence[str], head: Head) -> None:
    """Raise the error for a motion whose names match no morph target and no bone of the head."""
    targets = _abbreviated_list(head.targets) if head.targets else "none"
    actual = f"it has {_abbreviated_list(capture_names)} and the head {targets}"
    advice = "Use a head with targets of these names, such as those of ARKit"
    refuse(error_subject, "names of targets or bones of the head", actual, advice)


def estimate_frame_rate(times: Doubles) -> float | None:
    """Return the frame rate of times (k,) [s], rounded to a common rate; None if they are unevenly spaced."""
    steps = np.diff(times)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return None
    rate = 1 / float(np.median(steps))
    if np.mean(np.abs(steps * rate - 1) < 0.5) < 0.5:
        return None
    nearest = min(_COMMON_FRAME_RATES, key=lambda common: abs(common - rate))
    return nearest if abs(nearest / rate - 1) < _FRAME_RATE_TOLERANCE else rate


def to_seconds(file_name: object, times: Doubles, unit_s: float | None) -> Doubles:
    """Return times (k,) in seconds.

    If the unit is unknown, it is guessed, and a note tells the user. The guess is the first of seconds,
    milliseconds, microseconds and nanoseconds for which the median interval between frames is at most 2 s.

    file_name : file of the capture, for the note
    unit_s : unit of the times [s]; None if it is unknown
    """
    if unit_s is None:
        steps = np.diff(times)
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        unit_s = next((unit_s for unit_s in _TIME_UNIT_NAMES if unit_s * step <= _MAX_FRAME_INTERVAL_S), 1.0)
        notify(
            f"{file_name}: the unit of its times is not stated; they are taken as {_TIME_UNIT_NAMES[unit_s]}"
        )
    return times * unit_s


def frame_rate_or_default(file_name: object, fps: float | None, default_fps: float) -> float:
    """Return the frame rate to use for a capture whose frames have no times.

    This is `fps`. If `fps` is None, it is `default_fps`, and a note tells the user.

    file_name : file of the capture, for the note
    """
    if fps is None:
        assumed = f"{default_fps:g} frames per second are assumed"
        notify(f"{file_name}: it has no times; {assumed}, which fps (--motion-fps) changes")
    return fps or default_fps


def note_lost_frames(file_name: object, lost_frame_count: int, frame_count: int) -> None:
    """Issue a note on the number of frames that show no face, unless all frames show a face.

    lost_frame_count : number of frames without a face
    frame_count : number of all frames
    """
    if lost_frame_count:
        lost = f"{lost_frame_count} of {frame_count} frames"
        notify(f"{file_name}: {lost} show no face; their pose is interpolated")


def fill_gaps(times_s: Doubles, channels: Doubles) -> Doubles:
    """Return the values of `channels` with each NaN replaced by linear interpolation over time.

    Before the first and after the last known value of a channel, its values are constant.

    times_s : (k,) times of the rows of `channels` [s]
    channels : (k, n) values of n channels
    """
    filled = channels.copy()
    for column, known in zip(filled.T, ~np.isnan(channels).T, strict=True):
        column[~known] = np.interp(times_s[~known], times_s[known], column[known])
    return filled


def weights_as_fractions(file_name: object, weights: Doubles) -> Doubles:
    """Return blend shape weights (k, n) as fractions; weights in percent are divided by 100, with a note."""
    largest = float(np.nanmax(np.abs(weights), initial=0.0))
    if _PERCENT_WEIGHT_RANGE[0] < largest <= _PERCENT_WEIGHT_RANGE[1]:
        notify(f"{file_name}: weights of up to {largest:g} are taken as percent")
        return weights / 100
    if _MAX_PLAUSIBLE_WEIGHT < largest <= _PERCENT_WEIGHT_RANGE[0]:
        notify(f"{file_name}: weights of up to {largest:g} are used as they are, where 1 is the full shape")
    return weights


def check_weights(
    error_subjects: Sequence[object], shape_names: Sequence[str], shape_weights: Doubles
) -> None:
    """Refuse implausibly large blend shape weights (k, n); NaN marks missing weights and is accepted.

    error_subjects : (k,) names of the frames, for errors
    shape_names : (n,) names of the blend shapes, for errors
    """
    invalid = np.argwhere(np.abs(shape_weights) > MAX_WEIGHT)
    if len(invalid):
        row, column = invalid[0]
        expected = f"numbers from -{MAX_WEIGHT:g} to {MAX_WEIGHT:g}"
        actual = f"{shape_names[column]} is {shape_weights[row, column]:g}"
        refuse(error_subjects[row], expected, actual, "Correct or remove the line")


def check_capture_size(error_subject: object, frame_count: int, column_count: int) -> None:
    """Refuse a capture with too many frames or too many columns.

    frame_count : number of frames read so far
    column_count : number of columns read so far
    """
    if frame_count > MAX_CAPTURE_FRAMES or column_count > MAX_CAPTURE_COLUMNS:
        expected = f"at most {MAX_CAPTURE_FRAMES:,} frames of {MAX_CAPTURE_COLUMNS} numbers"
        actual = f"it has more ({frame_count:,} of {column_count:,} so far)"
        refuse(error_subject, expected, actual, "Shorten it, or remove columns that heads do not have")


def _abbreviated_list(names: Sequence[str]) -> str:
    listed = ", ".join(names[:6])
    return f"{listed} and {len(names) - 6} more" if len(names) > 6 else listed


def match_targets(shape_names: Iterable[str], target_names: Sequence[str]) -> dict[str, str]:
    """Return a dictionary from blend shape names to the matching morph targets of the head.

    Names without a match are omitted. For example, EyeBlinkLeft, eyeBlink_L and blendShape1.eye_blink_left
    all match eyeBlinkLeft; an identical name has priority.
    """
    exact, folded, plain = (
        {key(target): target for target in reversed(target_names)}
        for key in (str, str.casefold, _plain_shape_name)
    )
    matches: dict[str, str] = {}
    for name in shape_names:
        target = exact.get(name) or folded.get(name.casefold()) or plain.get(_plain_shape_name(name))
        if target is not None and target not in matches.values():
            matches[name] = target
    return matches


def _plain_shape_name(shape_name: str) -> str:
    """Return a form of a blend shape name that is equal for the spellings of different programs.

    The form is in lower case and has only letters and digits. The part up to the last period, such as
    "blendShape1.", is removed, and a final L or R after a separator becomes "left" or "right".
    """
    last = shape_name.rpartition(".")[2]
    side = re.fullmatch(r"(.+)[_\-. ]([lrLR])", last)
    name_with_side = f"{side[1]}{_SIDE_LETTERS[side[2].lower()]}" if side else last
    return re.sub(r"[\W_]", "", name_with_side).casefold()


@dataclass(frozen=True)
class RotationBones:
    """Bones of a skeleton that perform the rotations of head and eyes in a capture.

    head : dictionary from bone name to the fraction of the head's rotation that the bone performs; empty if
        there is neither a head nor a neck bone
    eyes : dictionary from "left" and "right" to the name of the eye bone
    """

    head: Mapping[str, float]
    eyes: Mapping[str, str]


def find_rotation_bones(skeleton: Skeleton | None) -> RotationBones:
    """Find the head, neck and eye bones of a skeleton by name; prefixes of common programs are ignored.

    For example, Head, mixamorig:Head and CC_Base_Head are names of head bones; neck, Neck1 and DEF-neck.002
    are neck bones if they are ancestors of the head bone; LeftEye and eye.L are eye bones. The head bone gets
    half of the head's rotation and the neck bones share the other half. If there is only a head bone, or only
    neck bones, these bones get the whole rotation.
    """
    if skeleton is None:
        return RotationBones({}, {})
    words = [_bone_words(name) for name in skeleton.names]
    heads = [bone for bone, (kind, side) in enumerate(words) if kind == ["head"] and not side]
    head = heads[0] if heads else None
    necks = [bone for bone, (kind, side) in enumerate(words) if kind in _NECK_WORDS and not side]
    if head is not None:
        ancestors = _bone_ancestors(skeleton, head)
        necks = [bone for bone in necks if bone in ancestors]
    eyes: dict[str, str] = {}
    for bone, (kind, side) in enumerate(words):
        if kind in _EYE_WORDS and side:
            eyes.setdefault(side, skeleton.names[bone])
    fractions = {
        bone: (1 - _HEAD_BONE_ROTATION_FRACTION if head is not None else 1.0) / len(necks) for bone in necks
    }
    if head is not None:
        fractions[head] = _HEAD_BONE_ROTATION_FRACTION if necks else 1.0
    return RotationBones({skeleton.names[bone]: fraction for bone, fraction in fractions.items()}, eyes)


def head_bone_angles(bones: RotationBones, rotations: Doubles) -> dict[str, Doubles]:
    """Return the Euler angles (k, 3) [degrees] of the head and neck bones, by bone name.

    rotations : (k, 4) quaternions of the head's rotation in a capture, which the head and neck bones
        perform together
    """
    parts = bones.head.items()
    return {name: _euler_angles(_partial_rotation(rotations, fraction)) for name, fraction in parts}


def unwrap_degrees(degrees: Doubles) -> Doubles:
    """Return angles (k, 3) [degrees] without jumps of 360 between consecutive frames."""
    return np.asarray(np.unwrap(degrees, axis=0, period=360.0))


def rotation_quaternions(matrices: Sequence[Doubles]) -> Doubles:
    """Return the rotations of k matrices (4, 4) as quaternions (k, 4); scale and reflection are removed."""
    linear = np.array(matrices)[:, :3, :3]
    left, _, right = np.linalg.svd(linear)
    rotations = left @ right
    rotations[np.linalg.det(rotations) < 0] *= -1
    return matrix_quaternion(rotations)


def _partial_rotation(rotations: Doubles, fraction: float) -> Doubles:
    identity = np.broadcast_to([0.0, 0.0, 0.0, 1.0], rotations.shape)
    return slerp(identity, rotations, fraction)


def _euler_angles(rotations: Doubles) -> Doubles:
    matrices = quaternion_matrix(rotations)[:, :3, :3]
    return unwrap_degrees(np.array([matrix_angles(matrix) for matrix in matrices]))


def _bone_ancestors(skeleton: Skeleton, bone: int) -> set[int]:
    ancestors = set()
    while (bone := int(skeleton.parent[bone])) >= 0:
        ancestors.add(bone)
    return ancestors


def _bone_words(bone_name: str) -> tuple[list[str], str]:
    """Return the words of a bone's name without numbers and prefixes, and its side: "left", "right" or ""."""
    separated = re.sub(r"(?<=[a-z])(?=[A-Z])|[\W_]|\d+", " ", bone_name.rpartition(":")[2])
    words = [word for word in separated.lower().split() if not _PREFIX_WORD_PATTERN.fullmatch(word)]
    sides = [_SIDE_OF_WORD[word] for word in words if word in _SIDE_OF_WORD]
    return [word for word in words if word not in _SIDE_OF_WORD], sides[0] if len(sides) == 1 else ""
