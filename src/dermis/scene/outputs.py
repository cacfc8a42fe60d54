"""What a frame knows besides its colour, by name: depth, normals, motion, ..."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from dermis.base.errors import refuse, shown_value
from dermis.base.registry import Registry

_WORDS = {"float32": "f32", "int32": "i32", "uint8": "u32"}

Kind = Literal["float32", "int32", "uint8"]


class Levels(NamedTuple):
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
    letters: str
    kind: Kind
    unit: str
    description: str
    background: float = 0.0
    levels: Levels | None = None
    shader: Path | None = None

    @property
    def channels(self) -> int:
        """How many numbers it has in a pixel; 0 where that follows from the scene."""
        return len(self.letters)

    @property
    def word(self) -> str:
        """Its numbers' type in shaders: a word of four bytes each."""
        return _WORDS[self.kind]


_FLOAT: Kind = "float32"
_MIDDLE = 1 << 15
_TENTHS, _SHARE = Levels(0.1), Levels(1 / 65535)
_AROUND_0, _UNIT, _MOVED = Levels(0.1, _MIDDLE), Levels(1 / 32767, _MIDDLE), Levels(1 / 64, _MIDDLE)
_GEOMETRY = (
    Output("depth", "geometry", "Z", _FLOAT, "mm", "distance along the optical axis", 0.0, _TENTHS),
    Output("position", "geometry", "XYZ", _FLOAT, "mm", "place in the world", 0.0, _AROUND_0),
    Output("normal", "surface", "XYZ", _FLOAT, "", "normal with the skin's relief, in the world", 0.0, _UNIT),
    Output("normal_geometric", "geometry", "XYZ", _FLOAT, "", "normal of the flat triangle", 0.0, _UNIT),
    Output("normal_camera", "surface", "XYZ", _FLOAT, "", "normal with relief, to the camera", 0.0, _UNIT),
    Output("uv", "geometry", "UV", _FLOAT, "", "place in the maps", 0.0, _SHARE),
    Output("triangle", "geometry", "I", "int32", "", "number of the mesh's triangle", -1.0),
    Output("barycentric", "geometry", "ABC", _FLOAT, "", "weights of the triangle's corners", 0.0, _SHARE),
    Output(
        "motion", "motion", "XY", _FLOAT, "pixel", "way in the picture from the scene before", 0.0, _MOVED
    ),
    Output("alpha", "alpha", "A", _FLOAT, "", "share of the pixel that head and hair cover", 0.0, _SHARE),
)

_RADIANCE, _MICROMETRES = Levels(1 / 4096), Levels(0.001)
_LIGHT = (
    Output("albedo", "light", "RGB", _FLOAT, "", "share of the light that comes back", 0.0, _SHARE),
    Output("irradiance", "light", "RGB", _FLOAT, "", "light that enters, not yet spread", 0.0, _RADIANCE),
    Output("diffuse", "light", "RGB", _FLOAT, "", "radiance that leaves below the skin", 0.0, _RADIANCE),
    Output("specular", "light", "RGB", _FLOAT, "", "radiance off the surface", 0.0, _RADIANCE),
    Output("translucent", "light", "RGB", _FLOAT, "", "of the diffuse, what crossed flesh", 0.0, _RADIANCE),
    Output("visibility", "visibility", "", _FLOAT, "", "share of each light that arrives"),
    Output("melanin", "pigments", "A", _FLOAT, "", "share of the epidermis' volume", 0.0, _SHARE),
    Output("blood", "pigments", "A", _FLOAT, "", "share of the dermis' volume", 0.0, _SHARE),
    Output("thickness", "thickness", "A", _FLOAT, "mm", "of the flesh below the skin", 0.0, _MICROMETRES),
)

_LABELS = (
    Output("label", "label", "I", "uint8", "", "class of what is seen, see docs/labels.md"),
    Output("label_face_synthetics", "label", "I", "uint8", "", "the same in the classes of FaceSynthetics"),
)

OUTPUTS: Registry[Output] = Registry("output", {one.name: one for one in (*_GEOMETRY, *_LIGHT, *_LABELS)})
"""By the names that `Renderer.draw` and `dermis render --outputs` take."""


def checked_outputs(names: Iterable[str]) -> tuple[str, ...]:
    """The names, each once.

    Raises DermisError for one that is not registered.
    """
    if isinstance(names, str) or not isinstance(names, Iterable):
        came = f"{shown_value(names)} came"
        refuse("outputs", "several names", came, 'Write outputs=("depth", "normal")')
    asked = tuple(dict.fromkeys(names))
    for name in asked:
        OUTPUTS[name]
    return asked
