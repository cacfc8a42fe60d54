"""Reading of the materials of USD scenes: UsdPreviewSurface shaders with their textures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    markdown_code,
    noted_property,
)

if TYPE_CHECKING:
    from pxr import Usd, UsdShade

Tree = dict[str, Any]
_ROLE_OF_INPUT = {
    "diffuseColor": "colour",
    "normal": "normal",
    "roughness": "roughness",
    "metallic": "metalness",
    "emissiveColor": "emission",
}
_INPUT_DEFAULTS: Mapping[str, Any] = {
    "diffuseColor": (0.18, 0.18, 0.18),
    "emissiveColor": (0.0, 0.0, 0.0),
    "roughness": 0.5,
    "metallic": 0.0,
    "opacity": 1.0,
    "opacityThreshold": 0.0,
}
_INPUTS_WITHOUT_EFFECT = {
    "clearcoat": ("clear coat", 0.0),
    "displacement": ("displacement", 0.0),
    "ior": ("index of refraction", 1.5),
    "occlusion": ("picture of occlusion, which is computed from the shape", 1.0),
    "specularColor": ("specular colour", (0.0, 0.0, 0.0)),
}
USD_MATERIAL_PROPERTIES = (
    drawn_property("`diffuseColor`, `normal`", "values and pictures"),
    drawn_property("picture of the `roughness`", "squared for skin"),
    noted_property("value of the `roughness`", "skin has a measured roughness", other_parts="drawn"),
    noted_property("`metallic`, `emissiveColor`", "values and pictures", other_parts="drawn"),
    noted_property(
        "`opacity`, `opacityThreshold`", "values, or the alpha of the colour's picture", other_parts="drawn"
    ),
    noted_property("another picture of the `opacity`"),
    drawn_property("`scale`, `wrapS`, `wrapT`, `UsdTransform2d`"),
    noted_property("`bias`, `wrap...` of `black`, `sourceColorSpace` of `raw`", "normals use their `bias`"),
    noted_property(markdown_code(_INPUTS_WITHOUT_EFFECT), "no note for values that change nothing"),
    drawn_property_with_note("emission without a `diffuseColor`", "taken for the reflectance, as in scans"),
    noted_property("shaders other than `UsdPreviewSurface`", "drawn in the colour of the mesh"),
    noted_property("a picture that is missing"),
)
"""Inputs of UsdPreviewSurface and of its textures."""
_WRAP_OF_USD_MODE = {"repeat": "repeat", "mirror": "mirror"}
_CHANNEL_OF_OUTPUT = {"r": 0, "g": 1, "b": 2, "a": 3}
_BLACK = (0.0, 0.0, 0.0)


class _InputSource(NamedTuple):
    """Shader output to which an input of another shader is connected."""

    shader: UsdShade.Shader
    output: str


class MaterialReader:
    """Reader of the materials of a stage.

    folder : folder of the layers; names of pictures are relative to this folder
    """

    def __init__(self, path: Path, layer_folder: Path, time: Usd.TimeCode) -> None:
        self.path, self.folder, self.time = path, layer_folder, time
        self.shade: Any = import_extra("pxr.UsdShade", f"{path}: USD scenes")

    def read(self, material: UsdShade.Material) -> Tree:
        """Return a material as keyword arguments of `FileMaterial`, with its textures as dictionaries.

        The entries "uv" and "vertex_colours" are names of primvars.
        """
        tree: Tree = {"name": material.GetPrim().GetName(), "textures": {}, "unused": []}
        surface = material.ComputeSurfaceSource()[0]
        kind = surface.GetIdAttr().Get() if surface else None
        if kind != "UsdPreviewSurface":
            tree["unused"].append(f"surface {kind}" if kind else "material without a UsdPreviewSurface")
            return tree
        values = {
            name: self._constant_value(surface, name, default) for name, default in _INPUT_DEFAULTS.items()
        }
        tree["colour"], tree["emission"] = list(values["diffuseColor"]), list(values["emissiveColor"])
        tree |= {"roughness": values["roughness"], "stated_metalness": values["metallic"]}
        for name, role in _ROLE_OF_INPUT.items():
            if (source := self._connected_source(surface, name)) is not None:
                self._add_source(tree, name, role, source)
        self._add_opacity(tree, surface, values)
        self._list_unused_inputs(tree, surface)
        return _emission_to_colour(tree)

    def _add_source(
        self, material_tree: Tree, input_name: str, role: str, input_source: _InputSource
    ) -> None:
        """Add to a material tree the texture or vertex colours to which an input is connected.

        material_tree : incomplete result of `read`
        input_name : name of the input of the surface shader, such as "diffuseColor"
        role : role of the texture in the result, such as "colour"
        input_source : shader output to which the input is connected
        """
        kind = str(input_source.shader.GetIdAttr().Get())
        if kind.startswith("UsdPrimvarReader_float") and role == "colour":
            material_tree |= {
                "vertex_colours": self._text_value(input_source.shader, "varname"),
                "colour": [1.0, 1.0, 1.0],
            }
        elif kind != "UsdUVTexture":
            material_tree["unused"].append(f"{input_name} from {kind}")
        else:
            texture = self._texture_tree(input_source, material_tree)
            material_tree["textures"][role] = texture
            factor, bias = texture.pop("scale"), texture.pop("bias")
            if role == "normal":
                material_tree["normal_scale"] = 0.5 * factor[0] if bias[0] else 1.0
            elif any(bias[: len(factor)]):
                material_tree["unused"].append(f"bias of the picture of {input_name}")
            if role in ("colour", "emission"):
                material_tree[role] = factor[:3]
            elif role != "normal":
                key = "stated_metalness" if role == "metalness" else role
                material_tree[key] = factor[texture["channel"] or 0]

    def _texture_tree(self, input_source: _InputSource, material_tree: Tree) -> Tree:
        shader = input_source.shader
        wraps = [self._text_value(shader, f"wrap{axis}") for axis in "ST"]
        if "black" in wraps:
            material_tree["unused"].append("black beyond the edges of pictures")
        if self._text_value(shader, "sourceColorSpace") == "raw" and input_source.output == "rgb":
            material_tree["unused"].append("colour space raw of pictures, except for that of normals")
        coordinates, transform = self._connected_source(shader, "st"), [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        if coordinates is not None and coordinates.shader.GetIdAttr().Get() == "UsdTransform2d":
            transform = self._uv_transform(coordinates.shader)
            coordinates = self._connected_source(coordinates.shader, "in")
        if coordinates is not None:
            material_tree.setdefault("uv", self._text_value(coordinates.shader, "varname"))
        return {
            "file": self._picture_name(shader),
            "transform": transform,
            "wrap": [_WRAP_OF_USD_MODE.get(one, "clamp") for one in wraps],
            "channel": _CHANNEL_OF_OUTPUT.get(input_source.output),
            "scale": list(self._constant_value(shader, "scale", (1.0, 1.0, 1.0, 1.0))),
            "bias": list(self._constant_value(shader, "bias", (0.0, 0.0, 0.0, 0.0))),
        }

    def _uv_transform(self, shader: UsdShade.Shader) -> list[float]:
        """Convert the shader's transform, which has v up, to a transform of uv with v down, see `Texture`."""
        angle = math.radians(self._constant_value(shader, "rotation", 0.0))
        (x, y), (scale_x, scale_y) = (
            self._constant_value(shader, name, default)
            for name, default in (("translation", (0.0, 0.0)), ("scale", (1.0, 1.0)))
        )
        cos, sin = math.cos(angle), math.sin(angle)
        a, b, d, e = cos * scale_x, -sin * scale_y, sin * scale_x, cos * scale_y
        return [a, -b, b + x, -d, e, 1.0 - e - y]

    def _add_opacity(
        self, material_tree: Tree, surface_shader: UsdShade.Shader, input_values: Mapping[str, Any]
    ) -> None:
        """Add the opacity to a material tree.

        A picture of the opacity is only supported if it is the alpha channel of the colour picture.

        material_tree : incomplete result of `read`, with the colour picture
        surface_shader : UsdPreviewSurface shader of the material
        input_values : constant values of the inputs of `surface_shader`, by name
        """
        source, cutoff = self._connected_source(surface_shader, "opacity"), input_values["opacityThreshold"]
        colour = material_tree["textures"].get("colour")
        if source is not None:
            file = (
                self._picture_name(source.shader)
                if source.shader.GetIdAttr().Get() == "UsdUVTexture"
                else None
            )
            if colour is None or source.output != "a" or colour["file"] != file:
                material_tree["unused"].append("picture of the opacity")
                return
        elif input_values["opacity"] >= 1.0:
            return
        material_tree |= {"alpha": 1.0 if source is not None else input_values["opacity"]}
        material_tree |= {"alpha_mode": "mask" if cutoff > 0 else "blend", "alpha_cutoff": cutoff or 0.5}

    def _list_unused_inputs(self, material_tree: Tree, surface_shader: UsdShade.Shader) -> None:
        for name, (text, neutral) in _INPUTS_WITHOUT_EFFECT.items():
            value = self._constant_value(surface_shader, name, neutral)
            if value != neutral or self._connected_source(surface_shader, name) is not None:
                material_tree["unused"].append(text)

    def _picture_name(self, texture: UsdShade.Shader) -> str:
        """Return a picture's name relative to the folder of the layers.

        If the picture is outside this folder, its name is returned as it is in the file.
        """
        for attribute in self._value_attributes(texture, "file"):
            layer, asset = attribute.GetPropertyStack(self.time)[0].layer, attribute.Get(self.time)
            name = str(asset.path) if asset else ""
            file = (Path(layer.realPath).parent / name).resolve()
            return file.relative_to(self.folder).as_posix() if file.is_relative_to(self.folder) else name
        return ""

    def _value_attributes(self, shader: UsdShade.Shader, input_name: str) -> list[Usd.Attribute]:
        """Return the attributes from which an input gets its value, directly or through connections."""
        entry = shader.GetInput(input_name)
        found: list[Usd.Attribute] = list(entry.GetValueProducingAttributes()) if entry else []
        return found

    def _connected_source(self, shader: UsdShade.Shader, input_name: str) -> _InputSource | None:
        """Return the shader output to which an input of a shader is connected; None without a connection."""
        for attribute in self._value_attributes(shader, input_name):
            kind, output = str(attribute.GetName()).split(":", 1)
            if kind == "outputs":
                return _InputSource(self.shade.Shader(attribute.GetPrim()), output)
        return None

    def _constant_value(self, shader: UsdShade.Shader, input_name: str, default: Any) -> Any:
        """Return the constant value of an input as numbers; `default` if it has none."""
        for attribute in self._value_attributes(shader, input_name):
            if attribute.GetName().startswith("inputs:") and (value := attribute.Get(self.time)) is not None:
                numbers = tuple(map(float, value)) if isinstance(default, tuple) else float(value)
                if not all(map(math.isfinite, numbers if isinstance(numbers, tuple) else (numbers,))):
                    actual = f"{input_name} of {shader.GetPath()} is not"
                    refuse(self.path, "finite numbers in materials", actual, "Correct it, or export again")
                return numbers
        return default

    def _text_value(self, shader: UsdShade.Shader, input_name: str) -> str:
        values = [attribute.Get(self.time) for attribute in self._value_attributes(shader, input_name)]
        return str(next((value for value in values if value is not None), ""))


def _emission_to_colour(material_tree: Tree) -> Tree:
    """Use the emission picture as the colour picture if the colour is black, as in unlit scans."""
    textures = material_tree["textures"]
    if "emission" in textures and "colour" not in textures and tuple(material_tree["colour"]) == _BLACK:
        textures["colour"], material_tree["colour"] = textures.pop("emission"), material_tree["emission"]
        material_tree["emission"] = list(_BLACK)
        material_tree["unused"].append("unlit colours, which are taken for the reflectance")
    return material_tree
