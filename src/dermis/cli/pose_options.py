"""--pose and --bone: how a head is moved, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from dermis.base.errors import DermisError, refuse

if TYPE_CHECKING:
    from dermis.mesh.head import Head
    from dermis.mesh.pose import Pose
    from dermis.scene.model import Scene

_FARTHEST = 1e10
POSE, BONE, LOOK_AT = "--pose", "--bone", "--look-at"
Weights = Annotated[
    list[str] | None,
    Parameter(
        name=POSE,
        negative="",
        metavar="NAME=WEIGHT,...",
        help="Weights of morph targets, as jawOpen=0.6,mouthSmileLeft=1, beside those of a scene's [pose]. "
        "dermis animate HEAD --names lists them.",
    ),
]
LookAt = Annotated[
    str | None,
    Parameter(
        name=LOOK_AT,
        metavar="X,Y,Z",
        help="Where the eyes look, the human's or those fitted to a file: a place in mm from the head's "
        "centre, or camera.",
    ),
]
Turns = Annotated[
    list[str] | None,
    Parameter(
        name=BONE,
        negative="",
        metavar="NAME=X,Y,Z",
        help="A bone turned by degrees about the head's x (nod), y (turn) and z (tilt), as head=0,25,0; once "
        "for each bone.",
    ),
]


def parse_weights(words: Sequence[str], option: str = POSE) -> dict[str, float]:
    """Weights by name of "jawOpen=0.6,mouthSmileLeft=1"."""
    weights = {}
    for word in (part for text in words for part in text.split(",")):
        name, sign, number = word.rpartition("=")
        weight = _numbers(number)
        if not sign or not name.strip() or weight is None or len(weight) != 1:
            expected = "NAME=WEIGHT with commas between, such as jawOpen=0.6,mouthSmileLeft=1"
            refuse(option, expected, f"{word!r} came", "Correct it")
        weights[name.strip()] = weight[0]
    return weights


def parse_turns(words: Sequence[str]) -> dict[str, list[float]]:
    """Angles [degrees] by name of the bone of "head=0,25,0"."""
    turns = {}
    for word in words:
        name, sign, numbers = word.rpartition("=")
        angles = _numbers(numbers)
        if not sign or not name.strip() or angles is None or len(angles) != 3:
            expected = "NAME=X,Y,Z with three angles in degrees, such as head=0,25,0"
            refuse(BONE, expected, f"{word!r} came", "Correct it")
        turns[name.strip()] = angles
    return turns


def laid_over(pose: Pose, base: Pose | Mapping[str, float] | None) -> Pose:
    """A pose that keeps from another one what it says nothing of."""
    from dermis.mesh.pose import Pose

    under = Pose.of(base) or Pose()
    places = under.positions_mm if pose.positions_mm is None else pose.positions_mm
    return Pose({**under.weights, **pose.weights}, {**under.bones, **pose.bones}, places)


def pose_given(
    weights: Mapping[str, float], turns: Mapping[str, Sequence[float]], head: Head, name: str
) -> Pose:
    """The pose of what was typed.

    name : of the head as it was typed, for messages

    Raises DermisError for names that the head lacks, and says where all are listed.
    """
    from dermis.mesh.pose import Pose

    parts: dict[str, Any] = {POSE: Pose(weights), BONE: Pose(bones=turns)}
    for option, part in parts.items():
        try:
            part.motion(head.control, option)
        except DermisError as fault:
            if not (head.targets or head.bones):
                raise
            raise DermisError(f"{fault} All names: dermis animate {name} --names.") from None
    return Pose(weights, turns)


def gaze_given(words: str, scene: Scene) -> Pose:
    """The scene's pose with eyes that look where it was typed."""
    from dermis.scene.gaze import looking_at

    place = scene.camera.position if words == "camera" else _numbers(words)
    if place is None or len(place) != 3:
        refuse(LOOK_AT, "camera, or X,Y,Z in mm from the head's centre", f"{words!r} came", "Correct it")
    return looking_at(scene.head, place, scene.pose)


def _numbers(text: str) -> list[float] | None:
    """The numbers between commas; None where one is none, or beyond all of them."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return found if all(abs(one) <= _FARTHEST for one in found) else None
