"""Materials in a USD stage: OpenPBR as nodes of MaterialX, and a preview for programs without it."""

from __future__ import annotations

from typing import Any

from dermis.apps.export.targets.openpbr.materials import MAPS, Look, Value
from dermis.apps.export.targets.usd.geometry import TASK
from dermis.base.extras import needed

_NODES = {"color3": "ND_image_color3", "float": "ND_image_float", "vector3": "ND_image_vector3"}
_PREVIEWED = {
    "base_color": "diffuseColor",
    "subsurface_color": "diffuseColor",
    "specular_roughness": "roughness",
    "specular_ior": "ior",
    "geometry_normal": "normal",
}
_UV = "st"


def add_material(stage: Any, path: Any, look: Look, prefix: str) -> Any:
    """Write a material; its prim.

    prefix : of the maps' names, which lie beside the stage
    """
    shade = needed("pxr.UsdShade", TASK)
    material = shade.Material.Define(stage, path)
    material.GetPrim().SetDisplayName(look.name)
    _add_open_pbr(stage, material, look, prefix)
    _add_preview(stage, material, look, prefix)
    return material


def _add_open_pbr(stage: Any, material: Any, look: Look, prefix: str) -> None:
    sdf = needed("pxr.Sdf", TASK)
    prim = material.GetPrim()
    prim.AddAppliedSchema("MaterialXConfigAPI")  # of a plug-in that usd-core comes without
    prim.CreateAttribute("config:mtlx:version", sdf.ValueTypeNames.String, False).Set("1.39")
    surface = _shader(stage, material, "open_pbr", "ND_open_pbr_surface_surfaceshader")
    for key, value in look.values.items():
        _set(surface, key, value)
    if look.maps:
        place = _shader(stage, material, "place", "ND_geompropvalue_vector2")
        place.CreateInput("geomprop", sdf.ValueTypeNames.String).Set(_UV)
        uv = place.CreateOutput("out", sdf.ValueTypeNames.Float2)
    for key, role in look.maps.items():
        kind, types = MAPS[role], sdf.ValueTypeNames
        usd_type = {"color3": types.Color3f, "float": types.Float, "vector3": types.Float3}[kind.type]
        image = _shader(stage, material, f"{role}_image", _NODES[kind.type])
        file = image.CreateInput("file", types.Asset)
        file.Set(sdf.AssetPath(f"./{prefix}{role}.png"))
        file.GetAttr().SetColorSpace(kind.space or "raw")
        image.CreateInput("texcoord", types.Float2).ConnectToSource(uv)
        last = image.CreateOutput("out", usd_type)
        if role == "normal":
            bump = _shader(stage, material, "normal_in_space", "ND_normalmap_float")
            bump.CreateInput("in", usd_type).ConnectToSource(last)
            last = bump.CreateOutput("out", usd_type)
        surface.CreateInput(key, usd_type).ConnectToSource(last)
    out = surface.CreateOutput("out", sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput("mtlx").ConnectToSource(out)


def _add_preview(stage: Any, material: Any, look: Look, prefix: str) -> None:
    """The preview has no scattering below the surface: its colour alone."""
    sdf = needed("pxr.Sdf", TASK)
    types = sdf.ValueTypeNames
    surface = _shader(stage, material, "preview", "UsdPreviewSurface")
    for key, value in look.values.items():
        if key in _PREVIEWED and not (key == "base_color" and "subsurface_color" in look.maps):
            _set(surface, _PREVIEWED[key], value)
    reader = None
    for key, role in look.maps.items():
        if key not in _PREVIEWED:
            continue
        if reader is None:
            place = _shader(stage, material, "preview_place", "UsdPrimvarReader_float2")
            place.CreateInput("varname", types.String).Set(_UV)
            reader = place.CreateOutput("result", types.Float2)
        texture = _shader(stage, material, f"preview_{role}", "UsdUVTexture")
        texture.CreateInput("file", types.Asset).Set(sdf.AssetPath(f"./{prefix}{role}.png"))
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
        surface.CreateInput(_PREVIEWED[key], kinds.get(role, types.Color3f)).ConnectToSource(output)
    out = surface.CreateOutput("surface", types.Token)
    material.CreateSurfaceOutput().ConnectToSource(out)


def _shader(stage: Any, material: Any, name: str, kind: str) -> Any:
    shade = needed("pxr.UsdShade", TASK)
    made = shade.Shader.Define(stage, material.GetPath().AppendChild(name))
    made.CreateIdAttr(kind)
    return made


def _set(shader: Any, name: str, value: Value) -> None:
    types = needed("pxr.Sdf", TASK).ValueTypeNames
    kind = types.Color3f if isinstance(value, tuple) else types.Float
    shader.CreateInput(name, kind).Set(value)
