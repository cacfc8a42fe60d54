"""Conversion of OpenPBR materials to MaterialX documents."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import MaterialX

from dermis.apps.export.targets.openpbr.materials import (
    LENGTH_INPUTS,
    MAP_TYPES,
    STANDARD_SURFACE,
    InputValue,
    OpenPbrMaterial,
    input_name,
)
from dermis.base.errors import refuse


def build_document(
    materials: Sequence[OpenPbrMaterial], shader_category: str, file_prefix: str
) -> MaterialX.Document:
    """Return a validated MaterialX document with the materials, in metres and linear Rec. 709.

    shader_category : MaterialX node category of the surface shaders, `OPEN_PBR` or `STANDARD_SURFACE`
    file_prefix : prefix of the file names of the maps beside the document
    """
    document = MaterialX.createDocument()
    document.setColorSpace("lin_rec709")
    for definition in materials:
        _add_material(document, definition, shader_category, file_prefix)
    document.setDataLibrary(standard_library())
    valid, message = document.validate()
    if not valid:
        refuse("MaterialX", "a valid document", message, "Report this together with the head")
    return document


@cache
def standard_library() -> MaterialX.Document:
    """Return MaterialX's library of standard node definitions."""
    library = MaterialX.createDocument()
    folders, search_path = MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath()
    MaterialX.loadLibraries(folders, search_path, library)
    return library


def _add_material(
    materialx_document: MaterialX.Document,
    open_pbr_material: OpenPbrMaterial,
    shader_category: str,
    file_prefix: str,
) -> None:
    name = MaterialX.createValidName(open_pbr_material.name) or "material"
    node = materialx_document.addNode(
        shader_category, materialx_document.createValidChildName(f"{name}_surface"), "surfaceshader"
    )
    for key, value in open_pbr_material.values.items():
        constant = node.setInputValue(input_name(shader_category, key), _materialx_value(value))
        if key in LENGTH_INPUTS:
            constant.setUnitType("distance")
            constant.setUnit("meter")
    if open_pbr_material.maps:
        graph = materialx_document.addNodeGraph(materialx_document.createValidChildName(f"{name}_maps"))
        for key, role in open_pbr_material.maps.items():
            output = _add_map(graph, role, f"{file_prefix}{role}.png", shader_category)
            mapped = node.addInput(input_name(shader_category, key), output.getType())
            mapped.setNodeGraphString(graph.getName())
            mapped.setOutputString(output.getName())
    material = materialx_document.addMaterialNode(materialx_document.createValidChildName(name), node)
    if material.getName() != open_pbr_material.name:
        material.setAttribute("uiname", open_pbr_material.name)


def _add_map(
    node_graph: MaterialX.NodeGraph, map_role: str, map_path: str, shader_category: str
) -> MaterialX.Output:
    """Extend a node graph by the nodes that read a map file, and return the output of these nodes.

    map_role : role of the map, such as "colour"; determines the type and colour space of the map's node
    map_path : path of the map
    shader_category : MaterialX node category of the surface shaders
    """
    map_type = MAP_TYPES[map_role]
    output_type = map_type.type
    image = node_graph.addNode("image", f"{map_role}_image", map_type.type)
    filename = image.setInputValue("file", map_path, "filename")
    if map_type.space:
        filename.setColorSpace(map_type.space)
    last_node = image
    if map_type.type == "vector3":
        last_node = node_graph.addNode("normalmap", "normal_in_space", map_type.type)
        last_node.addInput("in", map_type.type).setNodeName(image.getName())
    elif map_role == "parts_opacity" and shader_category == STANDARD_SURFACE:
        output_type = "color3"
        last_node = node_graph.addNode("convert", "opacity_of_channels", output_type)
        last_node.addInput("in", map_type.type).setNodeName(image.getName())
    output = node_graph.addOutput(map_role, output_type)
    output.setNodeName(last_node.getName())
    return output


def _materialx_value(input_value: InputValue) -> MaterialX.Color3 | float:
    return MaterialX.Color3(*input_value) if isinstance(input_value, tuple) else float(input_value)
