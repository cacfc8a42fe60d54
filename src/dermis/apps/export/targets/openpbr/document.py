"""MaterialX documents of materials."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import MaterialX

from dermis.apps.export.targets.openpbr.materials import DISTANCES, MAPS, OpenPbrMaterial, Value, input_name
from dermis.base.errors import refuse


def build_document(looks: Sequence[OpenPbrMaterial], shader: str, prefix: str) -> MaterialX.Document:
    """Return the document, checked by MaterialX's own library; lengths in metres, colours linear Rec. 709.

    shader : `OPEN_PBR` or `STANDARD`
    prefix : of the maps' names, which lie beside the document
    """
    made = MaterialX.createDocument()
    made.setColorSpace("lin_rec709")
    for material_inputs in looks:
        _add_material(made, material_inputs, shader, prefix)
    made.setDataLibrary(standard_library())
    valid, message = made.validate()
    if not valid:
        refuse("MaterialX", "a document that its library takes", message, "Report this with the head")
    return made


@cache
def standard_library() -> MaterialX.Document:
    """Return MaterialX's own definitions."""
    found = MaterialX.createDocument()
    MaterialX.loadLibraries(
        MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), found
    )
    return found


def _add_material(made: MaterialX.Document, material_inputs: OpenPbrMaterial, shader: str, prefix: str) -> None:
    name = MaterialX.createValidName(material_inputs.name) or "material"
    node = made.addNode(shader, made.createValidChildName(f"{name}_surface"), "surfaceshader")
    for key, value in material_inputs.values.items():
        one = node.setInputValue(input_name(shader, key), _value(value))
        if key in DISTANCES:
            one.setUnitType("distance")
            one.setUnit("meter")
    if material_inputs.maps:
        graph = made.addNodeGraph(made.createValidChildName(f"{name}_maps"))
        for key, role in material_inputs.maps.items():
            output = _add_map(graph, role, f"{prefix}{role}.png")
            one = node.addInput(input_name(shader, key), output.getType())
            one.setNodeGraphString(graph.getName())
            one.setOutputString(output.getName())
    material = made.addMaterialNode(made.createValidChildName(name), node)
    if material.getName() != material_inputs.name:
        material.setAttribute("uiname", material_inputs.name)


def _add_map(graph: MaterialX.NodeGraph, role: str, file: str) -> MaterialX.Output:
    """Return the output of a graph that reads a picture."""
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


def _value(value: Value) -> MaterialX.Color3 | float:
    return MaterialX.Color3(*value) if isinstance(value, tuple) else float(value)
