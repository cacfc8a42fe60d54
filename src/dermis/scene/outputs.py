"""What a frame knows besides its colour, by name: depth, normals, motion, ..."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from dermis.base.errors import format_value, refuse
from dermis.base.registry import Registry

_WGSL_TYPES = {"float32": "f32", "int32": "i32", "uint8": "u32"}

Kind = Literal["float32", "int32", "uint8"]


class Quantisation(NamedTuple):
    """How a PNG of 16 bits holds an output: level = value / step + zero, rounded and kept within 0 to 65535.

    step : of a level, in the output's unit
    zero : level of the value 0
    """

    step: float
    zero: int = 0


@dataclass(frozen=True)
class Output:
    """Something that a frame can tell of each pixel's centre.

    stage : the shader that makes it, features/outputs/STAGE.wgsl; it has `fn NAME_output(seen: Seen)`, or of
        what else the stage finds, which returns a number or a vector
    letters : of its channels, by which files name them; empty for a channel for each light
    kind : of its numbers, as NumPy names it; a word and not NumPy's own, for a command's help to be quick
    unit : of its numbers, empty for none
    description : of it, in a few words for the help texts
    background : its value where nothing is seen
    levels : how a PNG holds it, None where none can; whole numbers of a byte are their own levels
    shader : the file of its function where that is not in its stage's shader
    """

    name: str
    stage: str
    channel_names: str
    kind: Kind
    unit: str
    description: str
    background: float = 0.0
    quantisation: Quantisation | None = None
    shader: Path | None = None

    @property
    def channels(self) -> int:
        """How many numbers it has in a pixel; 0 where that follows from the scene."""
        return len(self.channel_names)

    @property
    def wgsl_type(self) -> str:
        """Its numbers' type in shaders: a word of four bytes each."""
        return _WGSL_TYPES[self.kind]


_FLOAT32: Kind = "float32"
_SIGNED_ZERO = 1 << 15
_LENGTH, _FRACTION = Quantisation(0.1), Quantisation(1 / 65535)
_SIGNED_LENGTH, _UNIT_VECTOR, _MOTION = (
    Quantisation(0.1, _SIGNED_ZERO),
    Quantisation(1 / 32767, _SIGNED_ZERO),
    Quantisation(1 / 64, _SIGNED_ZERO),
)
_GEOMETRY_OUTPUTS = (
    Output("depth", "geometry", "Z", _FLOAT32, "mm", "distance along the optical axis", 0.0, _LENGTH),
    Output("position", "geometry", "XYZ", _FLOAT32, "mm", "place in the world", 0.0, _SIGNED_LENGTH),
    Output(
        "normal",
        "surface",
        "XYZ",
        _FLOAT32,
        "",
        "normal with the skin's relief, in the world",
        0.0,
        _UNIT_VECTOR,
    ),
    Output(
        "normal_geometric", "geometry", "XYZ", _FLOAT32, "", "normal of the flat triangle", 0.0, _UNIT_VECTOR
    ),
    Output(
        "normal_camera",
        "surface",
        "XYZ",
        _FLOAT32,
        "",
        "normal with relief, to the camera",
        0.0,
        _UNIT_VECTOR,
    ),
    Output("uv", "geometry", "UV", _FLOAT32, "", "place in the maps", 0.0, _FRACTION),
    Output("triangle", "geometry", "I", "int32", "", "number of the mesh's triangle", -1.0),
    Output(
        "barycentric", "geometry", "ABC", _FLOAT32, "", "weights of the triangle's corners", 0.0, _FRACTION
    ),
    Output(
        "motion", "motion", "XY", _FLOAT32, "pixel", "way in the picture from the scene before", 0.0, _MOTION
    ),
    Output(
        "alpha", "alpha", "A", _FLOAT32, "", "share of the pixel that head and hair cover", 0.0, _FRACTION
    ),
)

_RADIANCE, _THICKNESS = Quantisation(1 / 4096), Quantisation(0.001)
_LIGHT_OUTPUTS = (
    Output("albedo", "light", "RGB", _FLOAT32, "", "share of the light that comes back", 0.0, _FRACTION),
    Output("irradiance", "light", "RGB", _FLOAT32, "", "light that enters, not yet spread", 0.0, _RADIANCE),
    Output("diffuse", "light", "RGB", _FLOAT32, "", "radiance that leaves below the skin", 0.0, _RADIANCE),
    Output("specular", "light", "RGB", _FLOAT32, "", "radiance off the surface", 0.0, _RADIANCE),
    Output("translucent", "light", "RGB", _FLOAT32, "", "of the diffuse, what crossed flesh", 0.0, _RADIANCE),
    Output("visibility", "visibility", "", _FLOAT32, "", "share of each light that arrives"),
    Output("melanin", "pigments", "A", _FLOAT32, "", "share of the epidermis' volume", 0.0, _FRACTION),
    Output("blood", "pigments", "A", _FLOAT32, "", "share of the dermis' volume", 0.0, _FRACTION),
    Output("thickness", "thickness", "A", _FLOAT32, "mm", "of the flesh below the skin", 0.0, _THICKNESS),
)

_LABEL_OUTPUTS = (
    Output("label", "label", "I", "uint8", "", "class of what is seen, see docs/labels.md"),
    Output("label_face_synthetics", "label", "I", "uint8", "", "the same in the classes of FaceSynthetics"),
)

OUTPUTS: Registry[Output] = Registry(
    "output", {one.name: one for one in (*_GEOMETRY_OUTPUTS, *_LIGHT_OUTPUTS, *_LABEL_OUTPUTS)}
)
"""By the names that `Renderer.draw` and `dermis render --outputs` take."""


def check_outputs(names: Iterable[str]) -> tuple[str, ...]:
    """The names, each once.

    Raises DermisError for one that is not registered.
    """
    if isinstance(names, str) or not isinstance(names, Iterable):
        actual = f"got {format_value(names)}"
        refuse("outputs", "several names", actual, 'Write outputs=("depth", "normal")')
    unique = tuple(dict.fromkeys(names))
    for name in unique:
        OUTPUTS[name]
    return unique
