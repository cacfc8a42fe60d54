"""The [head] table of a scene file: its fields, and checks that its fields can be combined."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import Field, ValidationInfo, field_validator

from dermis.base.errors import format_value, refuse
from dermis.formats.axes import Axis, Front
from dermis.formats.size_limits import MAX_RELIEF_MM
from dermis.mesh.eye_look import EYE_LOOK_RANGES
from dermis.scene.field_errors import AcceptedWords, BoundsReason, InvalidFieldsError
from dermis.scene.frozen_model import FrozenModel

_ReliefHeight = Annotated[
    float | None,
    Field(ge=1e-6, le=MAX_RELIEF_MM),
    BoundsReason("mm: 255 levels from a quarter of a micrometre to a nose and more"),
]
_UnitLength = Annotated[
    float | None, Field(ge=1e-3, le=1e6), BoundsReason("mm: files count in micrometres to kilometres")
]
VOrigin = Literal["auto", "top", "bottom"]
NormalY = Literal["up", "down"]
AUTO: Final = "auto"
NO_REGIONS = "none"
EyeMode = Literal["fitted", "plain"]
if TYPE_CHECKING:
    _SubdivisionLevels = int | Literal["auto"]
else:
    _SubdivisionLevels = Annotated[
        int, Field(ge=0, le=3), BoundsReason("each level has four times the triangles"), AcceptedWords(AUTO)
    ]
_UNIT_LENGTHS_MM = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "inch": 25.4, "in": 25.4, "ft": 304.8}


def _eye_limits(field_name: str) -> Any:
    low, high = EYE_LOOK_RANGES[field_name]
    return Field(ge=low, le=high)


class EyeTable(FrozenModel):
    """Eye settings in a [head] table; for a field that is None, the value of the head's eye look is kept."""

    eumelanin: Annotated[float | None, _eye_limits("eumelanin")] = None
    """Eumelanin of the iris, from 0 for blue to 1 for the darkest brown."""
    pupil_mm: Annotated[
        float | None, _eye_limits("pupil_mm"), BoundsReason("mm: from bright light to darkness")
    ] = None
    """Radius of the pupil [mm]."""
    redness: Annotated[float | None, _eye_limits("redness")] = None
    """Redness of the white of the eye."""
    seed: Annotated[int | None, _eye_limits("seed"), BoundsReason("32 bits")] = None
    """Seed of the pattern of fibres and blood vessels."""


class HeadTable(FrozenModel):
    """The [head] table of a scene file: options of `load_head`, and a table of face regions."""

    name: str
    """A person (human, human:SEED, .json), a sample (lee_perry_smith) or a mesh (.glb .gltf .vrm .usdz .obj
    .ply .stl)."""
    colour: str | None = None
    """Colour map (sRGB)."""
    skin_site: str | None = None
    """Measured colour of skin that has no picture: a site of the body, such as palm, back of hand, inner arm
    or cheek, alone or after a group of people, as in south asian palm."""
    normal: str | None = None
    """Tangent-space normal map."""
    height: str | None = None
    """Height map; it needs height_mm."""
    height_mm: _ReliefHeight = None
    """Relief of one grey level of an 8-bit height map [mm]."""
    specular: str | None = None
    """Map of the specular strength, scaled so that its mean is rho_s."""
    roughness: str | None = None
    """Map of the roughness m, 0 to 1."""
    unit_mm: _UnitLength = None
    """Length of the file's unit [mm]; if left out, 1000 for glTF, the length that USD states, or for other
    formats a guess from the size."""
    v_origin: VOrigin = "auto"
    """Row of the maps at v = 0; "auto" follows the format."""
    up: Axis | None = None
    """Upward axis of the file; if left out, the axis that USD states, for other formats y."""
    front: Front = "auto"
    """Axis of the file along which the face looks; "auto" uses the axis that VRM states, else the axis that
    eyes or the shape of the head show, else -y if z is up, as in Blender, else z."""
    normal_y: NormalY = "up"
    """Direction of green in the normal map: "up" (OpenGL) or "down" (DirectX)."""
    skin_groups: tuple[str, ...] = ()
    """Groups of the file (materials, meshes, OBJ groups) that are skin; all others are then drawn with their
    own materials. If left out, skin groups are found by their names or because they cover the head, and a
    note lists them."""
    opaque: tuple[str, ...] = ()
    """Groups of the file that are not skin, such as teeth or clothes, to correct the automatic choice. Two
    balls in groups named as eyes become the package's eyes and need not be listed."""
    eyes: EyeMode = "fitted"
    """Eyeballs of a file (groups named eyes, Eye_L, cornea ...): "fitted" replaces them by the package's."""
    eye_groups: tuple[str, ...] = ()
    """Groups of the file that contain eyeballs, whatever their names; they may contain the rest of the
    head."""
    clothing: str | None = None
    """Garment of a person in words, such as "navy denim shirt"; none for bare shoulders."""
    glasses: str | None = None
    """Glasses of a person in words, such as "brown square": round, square, aviator, rimless or sunglasses;
    none for no glasses."""
    headwear: str | None = None
    """Headwear of a person in words, such as "red beanie": cap, beanie, turban or headscarf; none for a bare
    head."""
    eye: EyeTable | None = None
    """Overrides of the look of the eyes."""
    subdivide: _SubdivisionLevels = AUTO
    """Levels of subdivision: Catmull-Clark for meshes of quads (.obj, .ply), else Loop; "auto" for as many as
    the outline needs to look smooth in a picture of this size from this camera."""
    regions: str = AUTO
    """Roughness and strength of reflection by region of the face: "auto" uses the package's table if the
    regions are known and the head has no roughness map; "none" uses one value everywhere; "default" (the
    package's table, by an artist) and a TOML file (your own table) set rho_s too."""

    @field_validator("front")
    @classmethod
    def _check_axes(cls, front: Front, validation_info: ValidationInfo) -> Front:
        up = validation_info.data.get("up") or ""
        if front[-1] == up[-1:]:
            raise ValueError(f"an axis across up, which is {up}")
        return front


def has_region_table(head_fields: Mapping[str, Any]) -> bool:
    """Return whether a [head] table names a table of face regions.

    Such a table overrides the roughness and the specular strength of the skin.
    """
    return head_fields.get("regions", AUTO) not in (AUTO, NO_REGIONS)


def head_name(head: object) -> str:
    """Return the `head` argument of `load_head` as a string; raise DermisError for other objects."""
    if not isinstance(head, str | os.PathLike):
        actual = "got None" if head is None else f"got a {type(head).__name__}"
        advice = "Pass a Head to Scene directly; write human.head() for a Human"
        refuse("load_head", "the name of a head or a file", actual, advice)
    return str(head)


def check_files_and_lengths(map_files: Mapping[str, object], **lengths: object) -> None:
    """Raise DermisError for lengths that are text, such as "cm", and for maps that are not file names."""
    for name, value in lengths.items():
        if isinstance(value, str):
            known = value in _UNIT_LENGTHS_MM
            advice = f"Write {name}={_UNIT_LENGTHS_MM[value]:g}" if known else "Write 10 for cm, 1000 for m"
            refuse(name, "a length in mm, as a number", f"got {value!r}", advice)
    for role, file in map_files.items():
        if file is not None and not isinstance(file, str | os.PathLike):
            advice = f"For an array write dataclasses.replace(head, maps=replace(head.maps, {role}=...))"
            refuse(role, "the name of an image file", f"got a {type(file).__name__}", advice)


def check_options(**options: Any) -> None:
    """Raise DermisError for arguments of `load_head` that a [head] table does not accept."""
    regions = options.get("regions", AUTO)
    if regions not in (AUTO, NO_REGIONS):
        advice = "Use with_regions for a table"
        refuse("regions", f"{AUTO} or {NO_REGIONS}", f"got {format_value(regions)}", advice)
    try:
        HeadTable(name="", **options)
    except InvalidFieldsError as error:
        raise InvalidFieldsError("load_head", error.messages) from None


def check_relief(height_mm: float | None, height_map: object, error_subject: str = "height_mm") -> None:
    """Raise DermisError if height_mm is given without a height map.

    height_map : file of the height map
    error_subject : name of the option height_mm, for the error message
    """
    if height_mm is not None and height_map is None:
        actual = f"got {height_mm} without a height map"
        refuse(error_subject, "a height map with it", actual, "Give the map too, or leave height_mm out")
