"""Mitsuba scene descriptions as XML, written without the mitsuba package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import ClassVar, SupportsFloat
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike, NDArray

SCENE_FORMAT_VERSION = "3.0.0"
_POINT_KEYS, _VECTOR_KEYS = ("position", "center"), ("direction",)
_PLUGINS_BY_KIND = {
    "emitter": ("point", "projector", "directional", "area", "constant", "envmap", "spot"),
    "shape": ("rectangle", "sphere", "disk", "ply", "bsplinecurve"),
    "bsdf": (
        *("null", "diffuse", "principled", "dielectric", "roughdielectric", "roughconductor"),
        *("mask", "normalmap", "twosided", "hair"),
    ),
    "texture": ("bitmap", "mesh_attribute"),
    "medium": ("homogeneous",),
    "phase": ("isotropic", "hg"),
    "integrator": ("volpath", "volpathmis"),
    "sensor": ("perspective", "orthographic"),
    "sampler": ("independent", "multijitter"),
    "film": ("hdrfilm",),
    "rfilter": ("box", "gaussian"),
}
_KIND_BY_PLUGIN = {plugin: kind for kind, plugins in _PLUGINS_BY_KIND.items() for plugin in plugins}


class Transform:
    """Affine transformation.

    Each method returns the product of this transformation and a new one. The product transforms a point by
    the new transformation first, as in Mitsuba.
    """

    def __init__(self, matrix: ArrayLike | None = None) -> None:
        self.matrix = np.eye(4) if matrix is None else np.asarray(matrix, np.float64).reshape(4, 4)

    def look_at(self, origin: ArrayLike, target: ArrayLike, up: ArrayLike) -> Transform:
        """Return the product of this transformation and one that places a camera at `origin`.

        The placed camera's +Z axis points towards `target`.
        """
        forward = _normalise(np.subtract(target, origin))
        left = _normalise(np.cross(np.asarray(up, np.float64), forward))
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([left, np.cross(forward, left), forward, origin])
        return Transform(self.matrix @ matrix)

    def scale(self, scale_factors: ArrayLike) -> Transform:
        """Return the product of this transformation and a scaling along the axes.

        scale_factors : one factor, or (3,) factors of x, y and z
        """
        return Transform(self.matrix @ np.diag([*np.broadcast_to(scale_factors, 3), 1.0]))


@dataclass(eq=False)
class Bitmap:
    """Image of a texture or an environment light, to be written to its own file."""

    values: NDArray[np.float32]


@dataclass
class XmlBackend:
    """Substitute for the module `mitsuba` in functions that describe scenes; Mitsuba need not be installed.

    bitmaps : images of all elements created so far, in the order of their file names
    """

    bitmaps: list[NDArray[np.float32]] = field(default_factory=list)
    ScalarTransform4f: ClassVar[type] = Transform
    Bitmap: ClassVar[type] = Bitmap
    math: ClassVar[SimpleNamespace] = SimpleNamespace(RayEpsilon=1500 * 2.0**-24)


@dataclass(frozen=True)
class ObjectReference:
    """Reference to an object of the scene by its id."""

    name: str


@dataclass(frozen=True)
class CommandLineProperty:
    """Property of a scene whose value is set on the command line by `mitsuba -D NAME=VALUE`.

    kind : type of the property, such as "integer"
    name : NAME in that command
    """

    kind: str
    name: str


def object_element(
    object_description: Mapping[str, object], object_name: str, xml_backend: XmlBackend
) -> ET.Element:
    """Return the XML element of an object described by a dictionary.

    object_description : properties of the object; "type" is the name of the plugin
    object_name : name of the object in the parent element; "" for an object without a name
    xml_backend : object that collects the images in the description
    """
    plugin = str(object_description["type"])
    node = ET.Element(
        _KIND_BY_PLUGIN[plugin], {"type": plugin, **_name_attributes(object_name, object_description)}
    )
    for key, value in object_description.items():
        if key not in ("type", "id"):
            node.append(_property_element(key, value, xml_backend))
    return node


def bitmap_path(bitmap_index: int) -> str:
    """Return the path of an image relative to scene.xml.

    bitmap_index : index of the image in `XmlBackend.bitmaps`
    """
    return f"textures/light_{bitmap_index}.exr"


def scene_document(xml_elements: list[ET.Element]) -> bytes:
    """Return an XML file with a scene of the given elements."""
    root = ET.Element("scene", {"version": SCENE_FORMAT_VERSION})
    root.extend(xml_elements)
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def default_property_element(parameter_name: str, default_value: str) -> ET.Element:
    """Return the element that sets the default value of a parameter, which `mitsuba -D` can override."""
    return ET.Element("default", {"name": parameter_name, "value": default_value})


def include_element(filename: str) -> ET.Element:
    """Return the element that includes another XML file."""
    return ET.Element("include", {"filename": filename})


def _name_attributes(object_name: str, object_description: Mapping[str, object]) -> dict[str, str]:
    return (
        {"id": str(object_description["id"])}
        if "id" in object_description
        else ({"name": object_name} if object_name else {})
    )


def _property_element(property_name: str, property_value: object, xml_backend: XmlBackend) -> ET.Element:
    if isinstance(property_value, ObjectReference):
        return ET.Element("ref", {"name": property_name, "id": property_value.name})
    if isinstance(property_value, CommandLineProperty):
        return ET.Element(property_value.kind, {"name": property_name, "value": f"${property_value.name}"})
    if isinstance(property_value, Transform):
        node = ET.Element("transform", {"name": property_name})
        ET.SubElement(node, "matrix", {"value": _format_numbers(property_value.matrix)})
        return node
    if isinstance(property_value, Bitmap):
        xml_backend.bitmaps.append(property_value.values)
        return _value_element("filename", bitmap_path(len(xml_backend.bitmaps) - 1))
    if isinstance(property_value, Mapping):
        if property_value["type"] == "rgb":
            return ET.Element(
                "rgb", {"name": property_name, "value": _format_numbers(property_value["value"])}
            )
        return object_element(property_value, property_name, xml_backend)
    return _value_element(property_name, property_value)


def _value_element(property_name: str, property_value: object) -> ET.Element:
    if property_name in _POINT_KEYS or property_name in _VECTOR_KEYS:
        kind, xyz = (
            "point" if property_name in _POINT_KEYS else "vector",
            map(_format_number, np.asarray(property_value, np.float64)),
        )
        return ET.Element(kind, {"name": property_name, **dict(zip("xyz", xyz, strict=True))})
    if isinstance(property_value, bool):
        return ET.Element("boolean", {"name": property_name, "value": str(property_value).lower()})
    if isinstance(property_value, int | np.integer):
        return ET.Element("integer", {"name": property_name, "value": str(int(property_value))})
    if isinstance(property_value, float | np.floating):
        return ET.Element("float", {"name": property_name, "value": _format_number(property_value)})
    return ET.Element("string", {"name": property_name, "value": str(property_value)})


def _format_numbers(numbers: ArrayLike) -> str:
    return " ".join(map(_format_number, np.ravel(numbers)))


def _format_number(number: SupportsFloat) -> str:
    return f"{float(number):.9g}"


def _normalise(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vector / np.linalg.norm(vector))
