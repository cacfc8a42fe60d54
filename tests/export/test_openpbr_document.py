"""MaterialX documents of materials, checked with the MaterialX library."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("MaterialX")
import MaterialX
from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenMdl, PyMaterialXGenOsl, PyMaterialXGenShader

from dermis.apps.export.targets.openpbr.document import build_document, standard_library
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    STANDARD_SURFACE,
    OpenPbrMaterial,
    skin_material,
    untextured_part_material,
)
from dermis.mesh.mesh import Material
from dermis.scene.skin import Skin

RADIUS_M = (1.234e-3, 4e-4, 2e-4)
GENERATORS = {
    "glsl": PyMaterialXGenGlsl.GlslShaderGenerator,
    "osl": PyMaterialXGenOsl.OslShaderGenerator,
    "mdl": PyMaterialXGenMdl.MdlShaderGenerator,
}
HOSTILE = '"/><input name="x" /><!-- \n ; import os'


def materials(name: str = "skin") -> list[OpenPbrMaterial]:
    skin = skin_material(
        name, Skin(), RADIUS_M, (0.4, 0.2, 0.1), ["colour", "roughness", "specular", "normal"]
    )
    return [skin, untextured_part_material(Material("left eye", "opaque"))]


def read_back(document: Any) -> Any:
    document_read = MaterialX.createDocument()
    MaterialX.readFromXmlString(document_read, MaterialX.writeToXmlString(document))
    document_read.setDataLibrary(standard_library())
    assert document_read.validate() == (True, "")
    return document_read


@pytest.mark.parametrize("shader", [OPEN_PBR, STANDARD_SURFACE])
def test_document_is_valid_after_reading_back(shader: str) -> None:
    document_read = read_back(build_document(materials(), shader, "a_"))
    nodes = {node.getName(): node for node in document_read.getNodes(shader)}
    assert set(nodes) == {"skin_surface", "left_eye_surface"}
    for node in nodes.values():
        for one in node.getInputs():
            assert node.getNodeDef().getActiveInput(one.getName()).getType() == one.getType()
    radius = nodes["skin_surface"].getInput("subsurface_radius" if shader == OPEN_PBR else "subsurface_scale")
    assert radius.getUnit() == "meter" and radius.getValue() == pytest.approx(max(RADIUS_M))


def test_pictures_state_their_colour_spaces() -> None:
    graph = read_back(build_document(materials(), OPEN_PBR, "a_")).getNodeGraph("skin_maps")
    files = {one.getName(): one.getInput("file") for one in graph.getNodes("image")}
    assert files["colour_image"].getColorSpace() == "srgb_texture"
    assert not any(one.getColorSpace() for name, one in files.items() if name != "colour_image")
    assert files["normal_image"].getValueString() == "a_normal.png"


@pytest.mark.parametrize("language", GENERATORS)
@pytest.mark.parametrize("shader", [OPEN_PBR, STANDARD_SURFACE])
def test_generated_code_converts_length_units(shader: str, language: str) -> None:
    code = generated(build_document(materials(), shader, "a_"), GENERATORS[language].create())
    assert "0.00123" in code and "100.0" in code  # metres, and centimetres in one
    assert "srgb_texture_to_lin_rec709" in code


def test_hostile_names_are_escaped() -> None:
    document_read = read_back(build_document(materials(HOSTILE), OPEN_PBR, "a_"))
    named = [one for one in document_read.getMaterialNodes() if one.getAttribute("uiname")]
    assert HOSTILE in [one.getAttribute("uiname") for one in named]
    assert [node.getCategory() for node in document_read.getNodes()] == [OPEN_PBR, "surfacematerial"] * 2


def generated(document: Any, generator: Any) -> str:
    """Return the pixel shader of the first material, for a scene in centimetres."""
    context = PyMaterialXGenShader.GenContext(generator)
    context.registerSourceCodeSearchPath(MaterialX.getDefaultDataSearchPath())
    colours = PyMaterialXGenShader.DefaultColorManagementSystem.create(generator.getTarget())
    colours.loadLibrary(standard_library())
    generator.setColorManagementSystem(colours)
    units = PyMaterialXGenShader.UnitSystem.create(generator.getTarget())
    units.loadLibrary(standard_library())
    registry, distance = (
        MaterialX.UnitConverterRegistry.create(),
        standard_library().getUnitTypeDef("distance"),
    )
    registry.addUnitConverter(distance, MaterialX.LinearUnitConverter.create(distance))
    units.setUnitConverterRegistry(registry)
    generator.setUnitSystem(units)
    context.getOptions().targetDistanceUnit = "centimeter"
    return generator.generate("skin", document.getMaterialNodes()[0], context).getSourceCode("pixel")


@pytest.mark.parametrize("shader", [OPEN_PBR, STANDARD_SURFACE])
def test_metal_frames_keep_roughness_and_metalness(shader: str) -> None:
    frame = Material("glasses frame", "opaque", (0.7, 0.5, 0.3), roughness=0.25, metalness=1.0)
    document_read = read_back(build_document([untextured_part_material(frame)], shader, ""))
    (node,) = document_read.getNodes(shader)
    values = {one.getName(): one.getValue() for one in node.getInputs()}
    assert values["specular_roughness"] == pytest.approx(0.25)
    assert values["base_metalness" if shader == OPEN_PBR else "metalness"] == 1.0
