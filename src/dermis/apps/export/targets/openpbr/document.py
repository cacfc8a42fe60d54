"""Materials as a MaterialX document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from dermis.apps.export.targets.openpbr.materials import DISTANCES, MAPS, Look, Value
from dermis.base.errors import refuse
from dermis.base.extras import needed

TASK = "writing MaterialX"
OPEN_PBR, STANDARD = "open_pbr_surface", "standard_surface"
_IN_STANDARD: Mapping[str, str] = {
    "base_color": "base_color",
    "subsurface_weight": "subsurface",
    "subsurface_color": "subsurface_color",
    "subsurface_radius": "subsurface_scale",
    "subsurface_radius_scale": "subsurface_radius",
    "subsurface_scatter_anisotropy": "subsurface_anisotropy",
    "specular_weight": "specular",
    "specular_ior": "specular_IOR",
    "specular_roughness": "specular_roughness",
    "geometry_normal": "normal",
}


def input_name(shader: str, name: str) -> str:
    """What an input of OpenPBR is called in a shader."""
    return name if shader == OPEN_PBR else _IN_STANDARD[name]


def document_of(looks: Sequence[Look], shader: str, prefix: str) -> Any:
    """The document, checked by MaterialX's own library; lengths in metres, colours linear Rec. 709.

    shader : `OPEN_PBR` or `STANDARD`
    prefix : of the maps' names, which lie beside the document
    """
    mx = needed("MaterialX", TASK)
    made = mx.createDocument()
    made.setColorSpace("lin_rec709")
    for look in looks:
        _add_material(mx, made, look, shader, prefix)
    made.setDataLibrary(library())
    valid, message = made.validate()
    if not valid:
        refuse("MaterialX", "a document that its library takes", message, "Report this with the head")
    return made


@cache
def library() -> Any:
    """MaterialX's own definitions."""
    mx = needed("MaterialX", TASK)
    found = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), found)
    return found


def _add_material(mx: Any, made: Any, look: Look, shader: str, prefix: str) -> None:
    name = mx.createValidName(look.name) or "material"
    node = made.addNode(shader, made.createValidChildName(f"{name}_surface"), "surfaceshader")
    for key, value in look.values.items():
        one = node.setInputValue(input_name(shader, key), _value(mx, value))
        if key in DISTANCES:
            one.setUnitType("distance")
            one.setUnit("meter")
    if look.maps:
        graph = made.addNodeGraph(made.createValidChildName(f"{name}_maps"))
        for key, role in look.maps.items():
            output = _add_map(graph, role, f"{prefix}{role}.png")
            one = node.addInput(input_name(shader, key), output.getType())
            one.setNodeGraphString(graph.getName())
            one.setOutputString(output.getName())
    material = made.addMaterialNode(made.createValidChildName(name), node)
    if material.getName() != look.name:
        material.setAttribute("uiname", look.name)


def _add_map(graph: Any, role: str, file: str) -> Any:
    """The output of a graph that reads a picture."""
    kind = MAPS[role]
    image = graph.addNode("image", f"{role}_image", kind.type)
    picture = image.setInputValue("file", file, "filename")
    if kind.space:
        picture.setColorSpace(kind.space)
    last = image
    if role == "normal":
        last = graph.addNode("normalmap", "normal_in_space", kind.type)
        last.addInput("in", kind.type).setNodeName(image.getName())
    output = graph.addOutput(role, kind.type)
    output.setNodeName(last.getName())
    return output


def _value(mx: Any, value: Value) -> Any:
    return mx.Color3(*value) if isinstance(value, tuple) else float(value)
