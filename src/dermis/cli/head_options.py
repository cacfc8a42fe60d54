"""Command line options of a head: file format, eye look, morph target weights, bones and gaze."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import print_note
from dermis.base.errors import DermisError, refuse
from dermis.cli.options import Options, check_fields, model_options
from dermis.mesh.eye_look import EYE_LOOK_RANGES
from dermis.scene.head_table import HeadTable

HEAD_OPTION_NAMES = {"specular": "specular_map", "roughness": "roughness_map"}
"""Option names by field of the [head] table, where they differ from the name of the field."""
_MESH_FIELDS = "unit_mm", "v_origin", "up", "front", "skin_groups", "opaque", "eyes", "eye_groups"
_MAP_FIELDS = "colour", "normal", "normal_y", "height", "height_mm", "specular", "roughness"

if TYPE_CHECKING:
    from dermis.mesh.head import Head
    from dermis.mesh.pose import Pose
    from dermis.scene.model import Scene

    HeadOptions = Options
    MeshOptions = Options
    FileOptions = Options
else:
    HeadOptions = model_options(HeadTable, excluded_fields=("name",), option_names=HEAD_OPTION_NAMES)
    MeshOptions = model_options(HeadTable, only_fields=_MESH_FIELDS)
    FileOptions = model_options(
        HeadTable, only_fields=(*_MESH_FIELDS, *_MAP_FIELDS), option_names=HEAD_OPTION_NAMES
    )


def check_head_options(head_name: str, options: Options) -> None:
    """Validate the options of a head.

    head_name : name of the head or its file

    Raises DermisError that names the invalid option.
    """
    check_fields(HeadTable, {"name": head_name, **options}, HEAD_OPTION_NAMES)


EYE_OPTION = "--eye"
_MIN_PUPIL_MM, _MAX_PUPIL_MM = EYE_LOOK_RANGES["pupil_mm"]
EyeOptions = Annotated[
    list[str] | None,
    Parameter(
        name=EYE_OPTION,
        negative="",
        metavar="NAME=NUMBER,...",
        help="Eye appearance, such as eumelanin=0.1,pupil_mm=2.5: eumelanin of the iris, 0 (blue) to 1 (dark "
        f"brown); pupil_mm, radius of the pupil, {_MIN_PUPIL_MM:g} to {_MAX_PUPIL_MM:g} [mm]; redness of the "
        "sclera, 0 to 1; seed.",
    ),
]


def note_kept_eyeballs(head: Head, eyes_option: str | None) -> None:
    """Print a note on stderr if a head keeps the eyeballs of its mesh file, or if no eyeballs were found.

    eyes_option : value of the option --eyes
    """
    if head.note:
        print_note(f"note: {head.note}")
    elif eyes_option == "fitted" and head.eyes is None:
        print_note("note: eyes: no group has a name of an eye; name the groups with --eye-groups")


_MAX_OPTION_NUMBER = 1e10
POSE_OPTION, BONE_OPTION, LOOK_AT_OPTION = "--pose", "--bone", "--look-at"
WeightsOption = Annotated[
    list[str] | None,
    Parameter(
        name=POSE_OPTION,
        negative="",
        metavar="NAME=WEIGHT,...",
        help="Expression, such as joy, or weights of morph targets, such as jawOpen=0.6,mouthSmileLeft=1, in "
        "addition to the [pose] of a scene; `dermis animate HEAD --names` lists the targets; repeatable.",
    ),
]
LookAtOption = Annotated[
    str | None,
    Parameter(
        name=LOOK_AT_OPTION,
        metavar="X,Y,Z",
        help="Point that the eyes look at, relative to the centre of the head [mm], or the word camera.",
    ),
]
BoneAngleOptions = Annotated[
    list[str] | None,
    Parameter(
        name=BONE_OPTION,
        negative="",
        metavar="NAME=X,Y,Z",
        help="Rotation of a bone about the head's x (nod), y (turn) and z (tilt) axes, such as head=0,25,0 "
        "[degrees]; repeatable.",
    ),
]


def parse_weights(option_values: Sequence[str], option_name: str = POSE_OPTION) -> dict[str, float]:
    """Return a dictionary from names to weights for option values such as "joy" or "jawOpen=0.6,mouthLeft=1".

    A word without a weight is the name of an expression; weights given by name replace those of expressions.
    """
    expected = "NAME=WEIGHT,..., such as jawOpen=0.6,mouthSmileLeft=1, or an expression, such as joy"
    parts = [part.strip() for text in option_values for part in text.split(",")]
    weights = dict[str, float]()
    for name in parts:
        if name and "=" not in name:
            from dermis.human.expressions import EXPRESSIONS, expression

            if name not in EXPRESSIONS:
                advice = f"Add a weight, or choose one of {', '.join(EXPRESSIONS)}"
                refuse(option_name, expected, f"got {name!r}", advice)
            weights |= expression(name)
    given = (part for part in parts if "=" in part or not part)
    named = _parse_named_numbers(given, 1, option_name, expected)
    return weights | {name: weight for name, (weight,) in named}


def parse_bone_angles(option_values: Sequence[str]) -> dict[str, list[float]]:
    """Return a dictionary from bones to angles about x, y and z [degrees].

    option_values : values of the option --bone, such as "head=0,25,0"
    """
    return dict(
        _parse_named_numbers(
            option_values, 3, BONE_OPTION, "NAME=X,Y,Z with three angles in degrees, such as head=0,25,0"
        )
    )


def _parse_named_numbers(
    option_values: Iterable[str], number_count: int, option_name: str, expected: str
) -> Iterator[tuple[str, list[float]]]:
    """Yield the name and the numbers of each option value "NAME=NUMBER,...".

    number_count : number of numbers after the sign = in each value
    option_name : name of the option, for error messages
    expected : expected format of the values, for error messages
    """
    for item in option_values:
        name, _, text = item.rpartition("=")
        numbers = _parse_numbers(text)
        if not name.strip() or numbers is None or len(numbers) != number_count:
            refuse(option_name, expected, f"got {item!r}", "Correct it")
        yield name.strip(), numbers


def pose_from_options(
    target_weights: Mapping[str, float],
    bone_angles: Mapping[str, Sequence[float]],
    head: Head,
    head_name: str,
) -> Pose:
    """Return the pose that the options --pose and --bone describe.

    target_weights : dictionary from morph targets to weights [-]
    bone_angles : dictionary from bones to rotation angles about x, y and z [degrees]
    head_name : head as named on the command line, for error messages

    Raises DermisError for targets and bones that the head does not have.
    """
    from dermis.mesh.pose import Pose

    parts = {POSE_OPTION: Pose(target_weights), BONE_OPTION: Pose(bones=bone_angles)}
    for option, part in parts.items():
        try:
            part.to_arrays(head.control_rig, option)
        except DermisError as fault:
            if not (head.targets or head.bones):
                raise
            raise DermisError(f"{fault} All names: dermis animate {head_name} --names.") from None
    return Pose(target_weights, bone_angles)


def pose_with_gaze(option_value: str, scene: Scene) -> Pose:
    """Return the pose of a scene with the eyes turned to a point.

    option_value : value of --look-at: "X,Y,Z" [mm], or "camera"
    """
    from dermis.scene.gaze import looking_at

    point = scene.camera.position if option_value == "camera" else _parse_numbers(option_value)
    if point is None or len(point) != 3:
        expected = "camera, or X,Y,Z in mm from the head's centre"
        refuse(LOOK_AT_OPTION, expected, f"got {option_value!r}", "Correct it")
    return looking_at(scene.head, point, scene.pose)


def _parse_numbers(option_value: str) -> list[float] | None:
    """Return comma-separated numbers; None if an element is not a number, or exceeds 1e10 in magnitude."""
    try:
        numbers = [float(part) for part in option_value.split(",")]
    except ValueError:
        return None
    return numbers if all(abs(number) <= _MAX_OPTION_NUMBER for number in numbers) else None
