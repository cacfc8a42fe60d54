"""USD stage of a head in metres, Y up.

Materials are OpenPBR as nodes of MaterialX, and a preview for programs without it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel

from dermis.apps.export.targets.openpbr.materials import MAPS, OpenPbrMaterial, Value, hair_material
from dermis.apps.export.targets.usd.geometry import add_hairs, add_mesh, add_motion, valid_names
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.mesh.head import Head

_NODES = {"color3": "ND_image_color3", "float": "ND_image_float", "vector3": "ND_image_vector3"}
_PREVIEW_INPUTS = {
    "base_color": "diffuseColor",
    "subsurface_color": "diffuseColor",
    "specular_roughness": "roughness",
    "specular_ior": "ior",
    "geometry_normal": "normal",
}
_UV = "st"


def build_stage(head: Head, name: str, looks: Mapping[int, OpenPbrMaterial], prefix: str) -> Usd.Stage:
    """Return the stage.

    name : what the head is called
    looks : by the mesh's materials
    prefix : of the maps' names, which lie beside the stage
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    root = Sdf.Path("/" + valid_names([name])[0])
    moved = DeformableMesh(head)
    top = _root(stage, root, moved)
    top.SetDisplayName(name)
    Usd.ModelAPI(top).SetKind("component")
    stage.SetDefaultPrim(top)
    if head.attribution:
        stage.GetRootLayer().customLayerData = {"attribution": head.attribution}
    path = root.AppendChild("mesh")
    subsets = add_mesh(stage, path, head, moved)
    if has_motion(moved):
        add_motion(stage, root, stage.GetPrimAtPath(path), moved)
    _add_materials(stage, root.AppendChild("materials"), subsets, looks, prefix)
    _add_hairs(stage, root, head)
    return stage


def has_motion(moved: DeformableMesh) -> bool:
    """Return whether anything moves the head."""
    return bool(moved.rig.targets.names) or moved.rig.skeleton is not None


def _root(stage: Usd.Stage, path: Sdf.Path, moved: DeformableMesh) -> Usd.Prim:
    kind = UsdSkel.Root if has_motion(moved) else UsdGeom.Xform
    return kind.Define(stage, path).GetPrim()


def _add_materials(
    stage: Usd.Stage,
    scope: Sdf.Path,
    subsets: Mapping[int, UsdGeom.Subset],
    looks: Mapping[int, OpenPbrMaterial],
    prefix: str,
) -> None:
    UsdGeom.Scope.Define(stage, scope)
    names = valid_names([looks[kind].name for kind in subsets])
    for (kind, subset), name in zip(subsets.items(), names, strict=True):
        material = _add_material(stage, scope.AppendChild(name), looks[kind], prefix)
        UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)


def _add_hairs(stage: Usd.Stage, root: Sdf.Path, head: Head) -> None:
    for name, strands in (("lashes_and_brows", head.strands), ("hair", head.hair)):
        if strands is None:
            continue
        made = add_hairs(stage, root.AppendChild(name), head, strands)
        material_inputs = hair_material(strands.absorption, float(np.median(strands.radius_mm)))
        material = _add_material(stage, root.AppendPath(f"materials/{name}"), material_inputs, "")
        UsdShade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(material)


def _add_material(stage: Usd.Stage, path: Sdf.Path, material_inputs: OpenPbrMaterial, prefix: str) -> UsdShade.Material:
    """Write a material; return it.

    prefix : of the maps' names, which lie beside the stage
    """
    material = UsdShade.Material.Define(stage, path)
    material.GetPrim().SetDisplayName(material_inputs.name)
    _add_open_pbr(stage, material, material_inputs, prefix)
    _add_preview(stage, material, material_inputs, prefix)
    return material


def _add_open_pbr(stage: Usd.Stage, material: UsdShade.Material, material_inputs: OpenPbrMaterial, prefix: str) -> None:
    prim = material.GetPrim()
    prim.AddAppliedSchema("MaterialXConfigAPI")  # of a plug-in that usd-core comes without
    prim.CreateAttribute("config:mtlx:version", Sdf.ValueTypeNames.String, False).Set("1.39")
    surface = _shader(stage, material, "open_pbr", "ND_open_pbr_surface_surfaceshader")
    for key, value in material_inputs.values.items():
        _set(surface, key, value)
    if material_inputs.maps:
        place = _shader(stage, material, "place", "ND_geompropvalue_vector2")
        place.CreateInput("geomprop", Sdf.ValueTypeNames.String).Set(_UV)
        uv = place.CreateOutput("out", Sdf.ValueTypeNames.Float2)
    for key, role in material_inputs.maps.items():
        kind, types = MAPS[role], Sdf.ValueTypeNames
        usd_type = {"color3": types.Color3f, "float": types.Float, "vector3": types.Float3}[kind.type]
        image = _shader(stage, material, f"{role}_image", _NODES[kind.type])
        file = image.CreateInput("file", types.Asset)
        file.Set(Sdf.AssetPath(f"./{prefix}{role}.png"))
        file.GetAttr().SetColorSpace(kind.space or "raw")
        image.CreateInput("texcoord", types.Float2).ConnectToSource(uv)
        last = image.CreateOutput("out", usd_type)
        if role == "normal":
            bump = _shader(stage, material, "normal_in_space", "ND_normalmap_float")
            bump.CreateInput("in", usd_type).ConnectToSource(last)
            last = bump.CreateOutput("out", usd_type)
        surface.CreateInput(key, usd_type).ConnectToSource(last)
    out = surface.CreateOutput("out", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput("mtlx").ConnectToSource(out)


def _add_preview(stage: Usd.Stage, material: UsdShade.Material, material_inputs: OpenPbrMaterial, prefix: str) -> None:
    """The preview has no scattering below the surface: its colour alone."""
    types = Sdf.ValueTypeNames
    surface = _shader(stage, material, "preview", "UsdPreviewSurface")
    for key, value in material_inputs.values.items():
        if key in _PREVIEW_INPUTS and not (key == "base_color" and "subsurface_color" in material_inputs.maps):
            _set(surface, _PREVIEW_INPUTS[key], value)
    reader = None
    for key, role in material_inputs.maps.items():
        if key not in _PREVIEW_INPUTS:
            continue
        if reader is None:
            place = _shader(stage, material, "preview_place", "UsdPrimvarReader_float2")
            place.CreateInput("varname", types.String).Set(_UV)
            reader = place.CreateOutput("result", types.Float2)
        texture = _shader(stage, material, f"preview_{role}", "UsdUVTexture")
        texture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(f"./{prefix}{role}.png"))
        texture.CreateInput("sourceColorSpace", types.Token).Set(MAPS[role].preview_space)
        texture.CreateInput("st", types.Float2).ConnectToSource(reader)
        for side in ("wrapS", "wrapT"):
            texture.CreateInput(side, types.Token).Set("clamp")
        if role == "normal":
            texture.CreateInput("scale", types.Float4).Set((2.0, 2.0, 2.0, 1.0))
            texture.CreateInput("bias", types.Float4).Set((-1.0, -1.0, -1.0, 0.0))
        one = role == "roughness"
        output = texture.CreateOutput("r" if one else "rgb", types.Float if one else types.Float3)
        kinds = {"normal": types.Normal3f, "roughness": types.Float}
        surface.CreateInput(_PREVIEW_INPUTS[key], kinds.get(role, types.Color3f)).ConnectToSource(output)
    out = surface.CreateOutput("surface", types.Token)
    material.CreateSurfaceOutput().ConnectToSource(out)


def _shader(stage: Usd.Stage, material: UsdShade.Material, name: str, kind: str) -> UsdShade.Shader:
    made = UsdShade.Shader.Define(stage, material.GetPath().AppendChild(name))
    made.CreateIdAttr(kind)
    return made


def _set(shader: UsdShade.Shader, name: str, value: Value) -> None:
    types = Sdf.ValueTypeNames
    kind = types.Color3f if isinstance(value, tuple) else types.Float
    shader.CreateInput(name, kind).Set(value)
