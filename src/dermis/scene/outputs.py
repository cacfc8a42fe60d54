"""Registry of the outputs that a frame can have besides the picture: depth, normals, motion, ..."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from dermis.base.errors import format_value, refuse
from dermis.base.registry import Registry

_WGSL_TYPE_OF_CHANNEL = {"float32": "f32", "int32": "i32", "uint8": "u32"}

ChannelType = Literal["float32", "int32", "uint8"]


class Quantisation(NamedTuple):
    """Quantisation of an output in a 16-bit PNG file.

    The stored integer is value / step + zero, rounded and clamped to 0 to 65535.

    step : size of one level, in the unit of the output
    zero : integer that represents the value 0
    """

    step: float
    zero: int = 0


@dataclass(frozen=True)
class Output:
    """Quantity that a frame computes at the centre of each pixel, such as depth.

    Parameters
    ----------
    name : str
        Name of the output, as in `--outputs`.
    stage : str
        Name STAGE of the shader file features/outputs/STAGE.wgsl that writes the output. The shader calls
        `fn NAME_output`, which returns a scalar or a vector.
    channel_names : str
        One letter for each channel, used in EXR files; empty for an output with one channel for each light.
    kind : str
        NumPy name of the element type: "float32", "int32" or "uint8".
    unit : str
        Unit of the pixel values; empty for dimensionless outputs.
    description : str
        Short description for help texts.
    background : float
        Pixel value where there is neither head nor hair.
    quantisation : Quantisation, optional
        Quantisation in PNG files; an output without quantisation can be written as PNG only if it has 8 bits.
    shader : Path, optional
        File that contains `fn NAME_output`, if the function is not in the shader of the stage.

    Examples
    --------
    >>> from dermis.scene.outputs import OUTPUTS
    >>> OUTPUTS["depth"].unit, OUTPUTS["depth"].channels
    ('mm', 1)
    """

    name: str
    stage: str
    channel_names: str
    kind: ChannelType
    unit: str
    description: str
    background: float = 0.0
    quantisation: Quantisation | None = None
    shader: Path | None = None

    @property
    def channels(self) -> int:
        """Return the number of channels; 0 for an output with one channel per light."""
        return len(self.channel_names)

    @property
    def wgsl_type(self) -> str:
        """Return the four-byte WGSL type of a channel in the shader's output buffer: f32, i32 or u32."""
        return _WGSL_TYPE_OF_CHANNEL[self.kind]


_FLOAT_CHANNEL: ChannelType = "float32"
_SIGNED_ZERO_LEVEL = 1 << 15  # level of the value 0 of signed outputs
_LENGTH_QUANTISATION = Quantisation(0.1)
_SIGNED_LENGTH_QUANTISATION = Quantisation(0.1, _SIGNED_ZERO_LEVEL)
_THICKNESS_QUANTISATION = Quantisation(0.001)
_FRACTION_QUANTISATION = Quantisation(1 / 65535)
_UNIT_VECTOR_QUANTISATION = Quantisation(1 / 32767, _SIGNED_ZERO_LEVEL)
_MOTION_QUANTISATION = Quantisation(1 / 64, _SIGNED_ZERO_LEVEL)
_RADIANCE_QUANTISATION = Quantisation(1 / 4096)
_BUILT_IN_OUTPUTS = (
    Output(
        "depth",
        "geometry",
        "Z",
        _FLOAT_CHANNEL,
        "mm",
        "distance along the optical axis",
        0.0,
        _LENGTH_QUANTISATION,
    ),
    Output(
        "position",
        "geometry",
        "XYZ",
        _FLOAT_CHANNEL,
        "mm",
        "position in world space",
        0.0,
        _SIGNED_LENGTH_QUANTISATION,
    ),
    Output(
        "normal",
        "surface",
        "XYZ",
        _FLOAT_CHANNEL,
        "",
        "normal with relief, in world space",
        0.0,
        _UNIT_VECTOR_QUANTISATION,
    ),
    Output(
        "normal_geometric",
        "geometry",
        "XYZ",
        _FLOAT_CHANNEL,
        "",
        "normal of the flat triangle",
        0.0,
        _UNIT_VECTOR_QUANTISATION,
    ),
    Output(
        "normal_camera",
        "surface",
        "XYZ",
        _FLOAT_CHANNEL,
        "",
        "normal with relief, in camera space",
        0.0,
        _UNIT_VECTOR_QUANTISATION,
    ),
    Output("uv", "geometry", "UV", _FLOAT_CHANNEL, "", "texture coordinates", 0.0, _FRACTION_QUANTISATION),
    Output("triangle", "geometry", "I", "int32", "", "index of the mesh triangle", -1.0),
    Output(
        "barycentric",
        "geometry",
        "ABC",
        _FLOAT_CHANNEL,
        "",
        "weights of the triangle's corners",
        0.0,
        _FRACTION_QUANTISATION,
    ),
    Output(
        "motion",
        "motion",
        "XY",
        _FLOAT_CHANNEL,
        "pixel",
        "displacement since the previous scene",
        0.0,
        _MOTION_QUANTISATION,
    ),
    Output(
        "motion_depth",
        "motion",
        "Z",
        _FLOAT_CHANNEL,
        "mm",
        "depth that the visible point had in the previous scene",
        0.0,
        _LENGTH_QUANTISATION,
    ),
    Output(
        "alpha",
        "alpha",
        "A",
        _FLOAT_CHANNEL,
        "",
        "coverage of the pixel by head and hair",
        0.0,
        _FRACTION_QUANTISATION,
    ),
    Output("albedo", "light", "RGB", _FLOAT_CHANNEL, "", "diffuse reflectance", 0.0, _FRACTION_QUANTISATION),
    Output(
        "irradiance",
        "light",
        "RGB",
        _FLOAT_CHANNEL,
        "",
        "irradiance before scattering",
        0.0,
        _RADIANCE_QUANTISATION,
    ),
    Output(
        "diffuse",
        "light",
        "RGB",
        _FLOAT_CHANNEL,
        "",
        "radiance scattered below the surface",
        0.0,
        _RADIANCE_QUANTISATION,
    ),
    Output(
        "specular",
        "light",
        "RGB",
        _FLOAT_CHANNEL,
        "",
        "radiance reflected by the surface",
        0.0,
        _RADIANCE_QUANTISATION,
    ),
    Output(
        "translucent",
        "light",
        "RGB",
        _FLOAT_CHANNEL,
        "",
        "diffuse radiance from thin parts",
        0.0,
        _RADIANCE_QUANTISATION,
    ),
    Output("visibility", "visibility", "", _FLOAT_CHANNEL, "", "unshadowed fraction of each light"),
    Output(
        "melanin",
        "pigments",
        "A",
        _FLOAT_CHANNEL,
        "",
        "melanosome fraction of the epidermis",
        0.0,
        _FRACTION_QUANTISATION,
    ),
    Output(
        "blood",
        "pigments",
        "A",
        _FLOAT_CHANNEL,
        "",
        "blood fraction of the dermis",
        0.0,
        _FRACTION_QUANTISATION,
    ),
    Output(
        "thickness",
        "thickness",
        "A",
        _FLOAT_CHANNEL,
        "mm",
        "thickness of the tissue below",
        0.0,
        _THICKNESS_QUANTISATION,
    ),
    Output("label", "label", "I", "uint8", "", "class of the surface, see docs/labels.md"),
    Output("label_face_synthetics", "label", "I", "uint8", "", "class as in FaceSynthetics"),
    Output("label_amodal", "label", "I", "uint8", "", "class of the surface, as if hair were transparent"),
    Output(
        "hair_alpha",
        "label",
        "A",
        _FLOAT_CHANNEL,
        "",
        "coverage by hair at the centre of the pixel",
        0.0,
        _FRACTION_QUANTISATION,
    ),
)

OUTPUTS: Registry[Output] = Registry("output", {output.name: output for output in _BUILT_IN_OUTPUTS})
"""Outputs by the names that `Renderer.draw` and `dermis render --outputs` accept."""


def check_outputs(output_names: Iterable[str]) -> tuple[str, ...]:
    """Validate names of outputs and return them without duplicates.

    Raises DermisError for a name that is not registered.
    """
    if isinstance(output_names, str) or not isinstance(output_names, Iterable):
        actual = f"got {format_value(output_names)}"
        refuse("outputs", "a list of names", actual, 'Write outputs=("depth", "normal")')
    unique = tuple(dict.fromkeys(output_names))
    for name in unique:
        OUTPUTS[name]
    return unique
