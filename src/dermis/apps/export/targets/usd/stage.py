"""USD stage of a head in metres, Y up.

Each material has MaterialX nodes for OpenPBR, and a UsdPreviewSurface for programs without OpenPBR.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel

from dermis.apps.export.targets.openpbr.materials import MAP_TYPES, InputValue, OpenPbrMaterial, hair_material
from dermis.apps.export.targets.usd.expressions import add_expressions
from dermis.apps.export.targets.usd.geometry import (
    Rig,
    add_mesh,
    add_mesh_blend_shapes,
    add_rig,
    unique_usd_names,
)
from dermis.apps.export.targets.usd.hair import HairCurves
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.mesh.head import Head
from dermis.mesh.strand_groups import strand_groups

_IMAGE_NODE_BY_TYPE = {"color3": "ND_image_color3", "float": "ND_image_float", "vector3": "ND_image_vector3"}
_PREVIEW_INPUTS = {
    "base_color": "diffuseColor",
    "subsurface_color": "diffuseColor",
    "specular_roughness": "roughness",
    "specular_ior": "ior",
    "geometry_normal": "normal",
    "base_metalness": "metallic",
    "emission_color": "emissiveColor",
}
_UV_PRIMVAR = "st"


def build_stage(
    head: Head, head_name: str, materials: Mapping[int, OpenPbrMaterial], file_prefix: str
) -> Usd.Stage:
    """Return the stage with a head's mesh, hairs, rig and materials.

    head_name : display name of the head
    materials : dictionary from material index in the mesh to OpenPBR material
    file_prefix : prefix of the file names of the maps, which are beside the stage
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    root = Sdf.Path("/" + unique_usd_names([head_name])[0])
    deformable = DeformableMesh(head)
    root_type = UsdSkel.Root if _has_rig(deformable) else UsdGeom.Xform
    top = root_type.Define(stage, root).GetPrim()
    top.SetDisplayName(head_name)
    Usd.ModelAPI(top).SetKind("component")
    stage.SetDefaultPrim(top)
    if head.attribution:
        stage.GetRootLayer().customLayerData = {"attribution": head.attribution}
    path = root.AppendChild("mesh")
    subsets = add_mesh(stage, path, head, deformable)
    rig = add_rig(stage, root, stage.GetPrimAtPath(path), deformable) if _has_rig(deformable) else None
    _add_materials(stage, root.AppendChild("materials"), subsets, materials, file_prefix)
    hairs = {name: HairCurves(name, strands, deformable) for name, strands in strand_groups(head).items()}
    _add_hairs(stage, root, hairs)
    if rig is not None:
        _add_blend_shapes(stage, root, rig, deformable, hairs)
        add_expressions(top, rig.animation, deformable.rig)
        top.SetChildrenReorder(["mesh", "skeleton", "materials"])  # variants otherwise put the skeleton first
    return stage


def _add_blend_shapes(
    usd_stage: Usd.Stage,
    root_path: Sdf.Path,
    rig: Rig,
    deformable_mesh: DeformableMesh,
    hairs: Mapping[str, HairCurves],
) -> None:
    """Add the blend shapes of mesh and hairs, and bind the hairs to the skeleton."""
    targets = dict(zip(rig.names, deformable_mesh.targets(), strict=True))
    mesh = usd_stage.GetPrimAtPath(root_path.AppendChild("mesh"))
    add_mesh_blend_shapes(usd_stage, mesh, deformable_mesh, targets)
    for name, curves in hairs.items():
        prim = usd_stage.GetPrimAtPath(root_path.AppendChild(name))
        curves.add_blend_shapes(usd_stage, curves.bind(rig.skeleton_path, prim), targets)


def _has_rig(deformable_mesh: DeformableMesh) -> bool:
    return bool(deformable_mesh.rig.targets.names) or deformable_mesh.rig.skeleton is not None


def _add_materials(
    usd_stage: Usd.Stage,
    materials_path: Sdf.Path,
    geometry_subsets: Mapping[int, UsdGeom.Subset],
    open_pbr_materials: Mapping[int, OpenPbrMaterial],
    file_prefix: str,
) -> None:
    UsdGeom.Scope.Define(usd_stage, materials_path)
    names = unique_usd_names([open_pbr_materials[kind].name for kind in geometry_subsets])
    for (kind, subset), name in zip(geometry_subsets.items(), names, strict=True):
        material = _add_material(
            usd_stage, materials_path.AppendChild(name), open_pbr_materials[kind], file_prefix
        )
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)


def _add_hairs(usd_stage: Usd.Stage, root_path: Sdf.Path, hairs: Mapping[str, HairCurves]) -> None:
    for name, hair in hairs.items():
        curves = hair.define(usd_stage, root_path.AppendChild(name))
        strands = hair.strands
        visible_radii = strands.radius_mm[strands.radius_mm > 0.0]
        definition = hair_material(strands.absorption, float(np.median(visible_radii)))
        material = _add_material(usd_stage, root_path.AppendPath(f"materials/{name}"), definition, "")
        UsdShade.MaterialBindingAPI.Apply(curves.GetPrim()).Bind(material)


def _add_material(
    usd_stage: Usd.Stage, prim_path: Sdf.Path, open_pbr_material: OpenPbrMaterial, file_prefix: str
) -> UsdShade.Material:
    """Add an OpenPBR material with a preview surface to the stage, and return the material.

    file_prefix : prefix of the file names of the maps
    """
    material = UsdShade.Material.Define(usd_stage, prim_path)
    material.GetPrim().SetDisplayName(open_pbr_material.name)
    _add_open_pbr(material, open_pbr_material, file_prefix)
    _add_preview(material, open_pbr_material, file_prefix)
    return material


def _add_open_pbr(material: UsdShade.Material, open_pbr_material: OpenPbrMaterial, file_prefix: str) -> None:
    prim = material.GetPrim()
    prim.AddAppliedSchema("MaterialXConfigAPI")  # its plug-in is not part of usd-core
    prim.CreateAttribute("config:mtlx:version", Sdf.ValueTypeNames.String, False).Set("1.39")
    surface = _add_shader(material, "open_pbr", "ND_open_pbr_surface_surfaceshader")
    for key, value in open_pbr_material.values.items():
        _set_input(surface, key, value)
    if open_pbr_material.maps:
        uv_node = _add_shader(material, "place", "ND_geompropvalue_vector2")
        uv_node.CreateInput("geomprop", Sdf.ValueTypeNames.String).Set(_UV_PRIMVAR)
        uv = uv_node.CreateOutput("out", Sdf.ValueTypeNames.Float2)
    for key, role in open_pbr_material.maps.items():
        map_type, types = MAP_TYPES[role], Sdf.ValueTypeNames
        usd_type = {"color3": types.Color3f, "float": types.Float, "vector3": types.Float3}[map_type.type]
        image = _add_shader(material, f"{role}_image", _IMAGE_NODE_BY_TYPE[map_type.type])
        file = image.CreateInput("file", types.Asset)
        file.Set(Sdf.AssetPath(f"./{file_prefix}{role}.png"))
        file.GetAttr().SetColorSpace(map_type.space or "raw")
        image.CreateInput("texcoord", types.Float2).ConnectToSource(uv)
        output = image.CreateOutput("out", usd_type)
        if map_type.type == "vector3":
            normal_map = _add_shader(material, "normal_in_space", "ND_normalmap_float")
            normal_map.CreateInput("in", usd_type).ConnectToSource(output)
            output = normal_map.CreateOutput("out", usd_type)
        surface.CreateInput(key, usd_type).ConnectToSource(output)
    out = surface.CreateOutput("out", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput("mtlx").ConnectToSource(out)


def _add_preview(material: UsdShade.Material, open_pbr_material: OpenPbrMaterial, file_prefix: str) -> None:
    """Add a UsdPreviewSurface with the material's colour, without subsurface scattering.

    file_prefix : prefix of the file names of the maps
    """
    types = Sdf.ValueTypeNames
    surface = _add_shader(material, "preview", "UsdPreviewSurface")
    luminance = float(np.max(open_pbr_material.values.get("emission_luminance", 0.0)))
    for key, value in open_pbr_material.values.items():
        if key in _PREVIEW_INPUTS and not (
            key == "base_color" and "subsurface_color" in open_pbr_material.maps
        ):
            radiance = tuple(luminance * np.array(value)) if key == "emission_color" else value
            _set_input(surface, _PREVIEW_INPUTS[key], radiance)
    uv = None
    for key, role in open_pbr_material.maps.items():
        if key not in _PREVIEW_INPUTS:
            continue
        is_cut = role == "parts_colour" and "geometry_opacity" in open_pbr_material.maps
        file, map_type = "parts_cutout" if is_cut else role, MAP_TYPES[role]
        if uv is None:
            uv_node = _add_shader(material, "preview_place", "UsdPrimvarReader_float2")
            uv_node.CreateInput("varname", types.String).Set(_UV_PRIMVAR)
            uv = uv_node.CreateOutput("result", types.Float2)
        texture = _add_shader(material, f"preview_{role}", "UsdUVTexture")
        texture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(f"./{file_prefix}{file}.png"))
        texture.CreateInput("sourceColorSpace", types.Token).Set(map_type.preview_space)
        texture.CreateInput("st", types.Float2).ConnectToSource(uv)
        for wrap in ("wrapS", "wrapT"):
            texture.CreateInput(wrap, types.Token).Set("clamp")
        if map_type.type == "vector3":
            texture.CreateInput("scale", types.Float4).Set((2.0, 2.0, 2.0, 1.0))
            texture.CreateInput("bias", types.Float4).Set((-1.0, -1.0, -1.0, 0.0))
        if role == "parts_emission":
            texture.CreateInput("scale", types.Float4).Set((luminance, luminance, luminance, 1.0))
        if is_cut:
            opacity = texture.CreateOutput("a", types.Float)
            surface.CreateInput("opacity", types.Float).ConnectToSource(opacity)
            surface.CreateInput("opacityThreshold", types.Float).Set(0.5)
        scalar = map_type.type == "float"
        output = texture.CreateOutput("r" if scalar else "rgb", types.Float if scalar else types.Float3)
        input_type = {"vector3": types.Normal3f, "float": types.Float}.get(map_type.type, types.Color3f)
        surface.CreateInput(_PREVIEW_INPUTS[key], input_type).ConnectToSource(output)
    out = surface.CreateOutput("surface", types.Token)
    material.CreateSurfaceOutput().ConnectToSource(out)


def _add_shader(material: UsdShade.Material, node_name: str, node_type: str) -> UsdShade.Shader:
    shader = UsdShade.Shader.Define(material.GetPrim().GetStage(), material.GetPath().AppendChild(node_name))
    shader.CreateIdAttr(node_type)
    return shader


def _set_input(shader: UsdShade.Shader, input_name: str, input_value: InputValue) -> None:
    types = Sdf.ValueTypeNames
    shader.CreateInput(input_name, types.Color3f if isinstance(input_value, tuple) else types.Float).Set(
        input_value
    )
