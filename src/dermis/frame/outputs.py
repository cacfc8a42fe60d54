"""What a frame knows besides its colour, by name: depth, normals, motion, ..."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dermis.errors import refuse, shown_value
from dermis.registry import Registry

_WORDS = {"f": "f32", "i": "i32", "u": "u32"}


@dataclass(frozen=True)
class Output:
    """Something that a frame can tell of each pixel's centre.

    stage : the shader that makes it, passes/outputs/STAGE.wgsl; it has `fn NAME_output(seen: Seen)`, which
        returns a number or a vector
    letters : of its channels, by which files name them; empty for a channel for each light
    kind : of its numbers
    unit : of its numbers, empty for none
    description : of it, in a few words for the help texts
    background : its value where nothing is seen
    """

    name: str
    stage: str
    letters: str
    kind: type[np.float32 | np.int32 | np.uint8]
    unit: str
    description: str
    background: float = 0.0

    @property
    def channels(self) -> int:
        """How many numbers it has in a pixel; 0 where that follows from the scene."""
        return len(self.letters)

    @property
    def word(self) -> str:
        """Its numbers' type in shaders: a word of four bytes each."""
        return _WORDS[np.dtype(self.kind).kind]


_FLOAT = np.float32
_GEOMETRY = (
    Output("depth", "geometry", "Z", _FLOAT, "mm", "distance along the optical axis"),
    Output("position", "geometry", "XYZ", _FLOAT, "mm", "place in the world, from the head's centre"),
    Output("normal", "surface", "XYZ", _FLOAT, "", "normal in the world, with the skin's relief"),
    Output("normal_geometric", "geometry", "XYZ", _FLOAT, "", "normal of the flat triangle, in the world"),
    Output("normal_camera", "surface", "XYZ", _FLOAT, "", "normal with relief: x right, y down, z forward"),
    Output("uv", "geometry", "UV", _FLOAT, "", "place in the maps"),
    Output("triangle", "geometry", "I", np.int32, "", "number of the mesh's triangle", -1.0),
    Output("barycentric", "geometry", "ABC", _FLOAT, "", "weights of the triangle's corners"),
    Output("motion", "motion", "XY", _FLOAT, "pixel", "way since the scene before: x right, y down"),
    Output("alpha", "alpha", "A", _FLOAT, "", "share of the pixel that head and hair cover, by all samples"),
)

OUTPUTS: Registry[Output] = Registry("output", {one.name: one for one in _GEOMETRY})
"""By the names that `Renderer.draw` and `dermis render --outputs` take."""


def asked_outputs(names: Iterable[str]) -> tuple[str, ...]:
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
