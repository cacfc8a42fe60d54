"""Options of a head: how its file is read, how its eyes look, and how it is posed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import note
from dermis.base.errors import DermisError, refuse
from dermis.cli.options import Options, check, model_options
from dermis.mesh.eye_look import LIMITS
from dermis.scene.head_table import HeadTable

HEAD_OPTION_NAMES = {"specular": "specular_map", "roughness": "roughness_map"}
"""Options by field of a [head], where their name differs."""
_SHAPE = "unit_mm", "v_origin", "up", "opaque", "eyes", "eye_groups"
_MAPS = "colour", "normal", "normal_y", "height", "height_mm", "specular", "roughness"

if TYPE_CHECKING:
    from dermis.mesh.head import Head
    from dermis.mesh.pose import Pose
    from dermis.scene.model import Scene

    HeadOptions = Options
    ShapeOptions = Options
    FileOptions = Options
else:
    HeadOptions = model_options(HeadTable, without=("name",), names=HEAD_OPTION_NAMES)
    ShapeOptions = model_options(HeadTable, only=_SHAPE)
    FileOptions = model_options(HeadTable, only=(*_SHAPE, *_MAPS), names=HEAD_OPTION_NAMES)


def check_head(name: str, options: Options) -> None:
    """Refuse impossible options of a head."""
    check(HeadTable, {"name": name, **options}, HEAD_OPTION_NAMES)


EYE = "--eye"
_LEAST, _MOST = LIMITS["pupil_mm"]
EyeOptions = Annotated[
    list[str] | None,
    Parameter(
        name=EYE,
        negative="",
        metavar="NAME=NUMBER,...",
        help="What the eyes look like, as eumelanin=0.1,pupil_mm=2.5: eumelanin of the iris, 0 (blue) to 1; "
        f"pupil_mm, its radius, {_LEAST:g} to {_MOST:g}; redness of the white, 0 to 1; seed.",
    ),
]


def note_eyes(head: Head, wanted: str | None) -> None:
    """Print a line on stderr if eyes of a file stay plain although names or options request fitted ones.

    wanted : what was typed for --eyes
    """
    if head.note:
        note(f"note: {head.note}")
    elif wanted == "fitted" and head.eyes is None:
        note("note: eyes: none found by name; --eye-groups names the groups that hold eyeballs")


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
LookAtOption = Annotated[
    str | None,
    Parameter(
        name=LOOK_AT,
        metavar="X,Y,Z",
        help="Where the eyes look, the human's or those fitted to a file: a place in mm from the head's "
        "centre, or camera.",
    ),
]
BoneAngleOptions = Annotated[
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
    """Return weights by name of "jawOpen=0.6,mouthSmileLeft=1"."""
    expected = "NAME=WEIGHT with commas between, such as jawOpen=0.6,mouthSmileLeft=1"
    parts = (part for text in words for part in text.split(","))
    return {name: weight for name, (weight,) in _pairs(parts, 1, option, expected)}


def parse_bone_angles(words: Sequence[str]) -> dict[str, list[float]]:
    """Return angles [degrees] by name of the bone of "head=0,25,0"."""
    return dict(_pairs(words, 3, BONE, "NAME=X,Y,Z with three angles in degrees, such as head=0,25,0"))


def _pairs(words: Iterable[str], count: int, option: str, expected: str) -> Iterator[tuple[str, list[float]]]:
    """Yield name and numbers of each "NAME=NUMBER,..."."""
    for word in words:
        name, _, text = word.rpartition("=")
        numbers = _numbers(text)
        if not name.strip() or numbers is None or len(numbers) != count:
            refuse(option, expected, f"{word!r} came", "Correct it")
        yield name.strip(), numbers


def pose_from_options(
    weights: Mapping[str, float], turns: Mapping[str, Sequence[float]], head: Head, name: str
) -> Pose:
    """Return the pose that was typed.

    name : of the head as it was typed, for messages

    Raises DermisError for names that the head lacks, and says where all are listed.
    """
    from dermis.mesh.pose import Pose

    parts = {POSE: Pose(weights), BONE: Pose(bones=turns)}
    for option, part in parts.items():
        try:
            part.motion(head.control, option)
        except DermisError as fault:
            if not (head.targets or head.bones):
                raise
            raise DermisError(f"{fault} All names: dermis animate {name} --names.") from None
    return Pose(weights, turns)


def pose_with_gaze(words: str, scene: Scene) -> Pose:
    """Return the scene's pose with eyes that look at the place that was typed."""
    from dermis.scene.gaze import looking_at

    place = scene.camera.position if words == "camera" else _numbers(words)
    if place is None or len(place) != 3:
        refuse(LOOK_AT, "camera, or X,Y,Z in mm from the head's centre", f"{words!r} came", "Correct it")
    return looking_at(scene.head, place, scene.pose)


def _numbers(text: str) -> list[float] | None:
    """Return the numbers between commas; None where one is not a number, or too large."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        return None
    return found if all(abs(one) <= _FARTHEST for one in found) else None
