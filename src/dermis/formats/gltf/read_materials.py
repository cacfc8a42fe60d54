"""Reading of the materials of glTF files, with their textures and extensions."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from typing import Any

from dermis.base.errors import refuse
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    keys_of,
    markdown_code,
    noted_property,
    property_without_effect,
    refused_property,
)
from dermis.formats.gltf.document import Document, Tree
from dermis.formats.materials import (
    IDENTITY_UV_TRANSFORM,
    AlphaMode,
    FileMaterial,
    Role,
    Texture,
    UvTransform,
    Wrap,
)
from dermis.formats.parts import Colour, parse_colour
from dermis.formats.referenced_files import resolve_uri
from dermis.formats.size_limits import MAX_RELIEF_MM
from dermis.images.io import EmbeddedPicture

EMBEDDED_MAP_ROLES = ("normal", "height", "specular", "roughness", "region")
"""Roles of maps, besides the colour map, that this package stores in the extras of the skin's material."""
_WRAP_OF_GLTF_CODE: Mapping[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_NEAREST_FILTER = 9728
_SOURCE_EXTENSIONS = ("EXT_texture_webp", "EXT_texture_avif")
_ALPHA_MODES: Mapping[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
_SCATTERING_EXTENSIONS = (
    "KHR_materials_volume_scatter",
    "KHR_materials_scatter",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_subsurface",
)
_GLOSS_EXTENSION, _UNLIT_EXTENSION, _EMISSIVE_STRENGTH_EXTENSION = (
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_materials_emissive_strength",
)
_ROUGHNESS_CHANNEL, _METALNESS_CHANNEL, _GLOSS_CHANNEL = 1, 2, 3
_UNDRAWN_EXTENSIONS = {
    "KHR_materials_anisotropy": "anisotropic highlights",
    "KHR_materials_clearcoat": "clear coat",
    "KHR_materials_dispersion": "dispersion",
    "KHR_materials_ior": "index of refraction",
    "KHR_materials_iridescence": "iridescence",
    "KHR_materials_sheen": "sheen",
    "KHR_materials_specular": "specular strength",
    "KHR_materials_transmission": "transmission",
    "KHR_materials_variants": "variants",
    "KHR_materials_volume": "absorbing volume",
    "VRMC_materials_mtoon": "cartoon shading (shade colour, outline, rim light)",
}
_BASISU_EXTENSION = "KHR_texture_basisu"
GLTF_MATERIAL_PROPERTIES = (
    drawn_property("`baseColorFactor`, `baseColorTexture`"),
    drawn_property("`normalTexture` with `scale`"),
    drawn_property_with_note(
        "`metallicRoughnessTexture`",
        "roughness, squared for skin, which has no metalness (note)",
        other_parts="drawn",
    ),
    noted_property("`roughnessFactor`", "skin has a measured roughness", other_parts="drawn"),
    noted_property("`metallicFactor`", other_parts="drawn"),
    noted_property("`emissiveFactor`, `emissiveTexture`", other_parts="drawn"),
    noted_property(
        f"`{_EMISSIVE_STRENGTH_EXTENSION}`",
        "factor of the emission",
        _EMISSIVE_STRENGTH_EXTENSION,
        other_parts="drawn",
    ),
    drawn_property_with_note("emission without a base colour", "taken for the reflectance, as in scans"),
    noted_property(f"`{_UNLIT_EXTENSION}`", "the colour is taken for the reflectance", _UNLIT_EXTENSION),
    noted_property(
        "`alphaMode`, `alphaCutoff`", "cut out, also in shadows; `BLEND` at 0.5", other_parts="drawn"
    ),
    noted_property("`occlusionTexture`", "computed from the shape"),
    property_without_effect("`doubleSided`", "back faces are always drawn"),
    drawn_property("`texCoord`, `KHR_texture_transform`", "", "KHR_texture_transform"),
    drawn_property("`wrapS`, `wrapT`", "repeated, mirrored or clamped"),
    noted_property("`magFilter`", "always interpolated (no note if it is linear)"),
    property_without_effect("`minFilter`", "maps always have mip levels"),
    drawn_property(
        "pictures in PNG, JPEG, WebP, AVIF", markdown_code(_SOURCE_EXTENSIONS), *_SOURCE_EXTENSIONS
    ),
    refused_property(f"`{_BASISU_EXTENSION}` without another picture", "KTX2"),
    drawn_property_with_note(
        markdown_code(_SCATTERING_EXTENSIONS), "the material is skin", *_SCATTERING_EXTENSIONS
    ),
    drawn_property_with_note(f"`{_GLOSS_EXTENSION}`", "without the specular colour", _GLOSS_EXTENSION),
    *(noted_property(f"`{name}`", text, name) for name, text in _UNDRAWN_EXTENSIONS.items()),
    noted_property("other extensions of materials"),
)
"""Properties of glTF materials and textures."""
MATERIAL_EXTENSIONS = keys_of(GLTF_MATERIAL_PROPERTIES)
"""Extensions of materials and textures that are read or named in a note."""


def read_materials(document: Document) -> tuple[FileMaterial, ...]:
    """Return the materials of a file in the order of the file."""
    return tuple(
        _MaterialReader(document, material).read() for material in document.top_level_array("materials")
    )


class _MaterialReader:
    """Reader of one material of a glTF file.

    unused : names of the material's properties that have no effect in this package
    """

    def __init__(self, document: Document, material: Tree) -> None:
        self.document, self.material = document, material
        self.extensions: Tree = material.get("extensions") or {}
        self.unused: list[str] = []

    def read(self) -> FileMaterial:
        """Return the material with its textures, and list its properties without effect in `unused`."""
        own_extras = (self.material.get("extras") or {}).get("dermis")
        pbr: Tree = self.material.get("pbrMetallicRoughness") or {}
        if _GLOSS_EXTENSION in self.extensions:
            pbr = self._from_glossiness(self.extensions[_GLOSS_EXTENSION])
        textures = self._read_textures(pbr)
        factor = pbr.get("baseColorFactor")
        emission = self._emitted_radiance()
        is_unlit = _UNLIT_EXTENSION in self.extensions
        if "emission" in textures and "colour" not in textures and (factor is None or max(factor[:3]) == 0):
            textures["colour"], factor, is_unlit = textures.pop("emission"), [*emission, 1.0], True
            emission = (0.0, 0.0, 0.0)
        if is_unlit:
            self.unused.append("unlit colours, which are taken for the reflectance")
        if "occlusionTexture" in self.material:
            self.unused.append("picture of occlusion, which is computed from the shape")
        self.unused += [text for name, text in _UNDRAWN_EXTENSIONS.items() if name in self.extensions]
        self.unused += [name for name in self.extensions if name not in MATERIAL_EXTENSIONS]
        return FileMaterial(
            str(self.material.get("name") or ""),
            textures,
            parse_colour(factor) if factor else None,
            alpha=float(factor[3]) if factor and len(factor) > 3 else 1.0,
            alpha_mode=_ALPHA_MODES[self.material.get("alphaMode", "OPAQUE")],
            alpha_cutoff=float(self.material.get("alphaCutoff", 0.5)),
            roughness=float(pbr.get("roughnessFactor", 1.0)),
            stated_metalness=float(pbr["metallicFactor"]) if "metallicFactor" in pbr else None,
            emission=emission,
            normal_scale=float((self.material.get("normalTexture") or {}).get("scale", 1.0)),
            scatters=any(name in self.extensions for name in _SCATTERING_EXTENSIONS),
            maps=self._maps_from_extras(own_extras) if isinstance(own_extras, dict) else None,
            unused=tuple(self.unused),
        )

    def _maps_from_extras(self, extras: Tree) -> dict[str, object]:
        """Return keyword arguments of `load_maps` from the extras that this package writes to its files."""
        colour = extras.get("colour") or (self.material.get("pbrMetallicRoughness") or {}).get(
            "baseColorTexture"
        )
        references = {"colour": colour, **{role: extras.get(role) for role in EMBEDDED_MAP_ROLES}}
        pictures = {
            role: self._read_texture_picture(self.document.top_level_object("textures", reference["index"]))
            for role, reference in references.items()
            if reference is not None
        }
        maps: dict[str, object] = {role: picture for role, picture in pictures.items() if picture is not None}
        height_mm = _checked_relief_mm(extras.get("height_mm"))
        return maps if height_mm is None else maps | {"height_mm": height_mm}

    def _from_glossiness(self, glossiness_extension: Tree) -> Tree:
        """Return the metallic-roughness properties that approximate a specular-glossiness material."""
        pbr = {
            "baseColorFactor": glossiness_extension.get("diffuseFactor", [1.0, 1.0, 1.0, 1.0]),
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0 - float(glossiness_extension.get("glossinessFactor", 1.0)),
        }
        if "specularFactor" in glossiness_extension:
            self.unused.append("specular colour")
        if "diffuseTexture" in glossiness_extension:
            pbr["baseColorTexture"] = glossiness_extension["diffuseTexture"]
        if "specularGlossinessTexture" in glossiness_extension:
            self.unused.append("picture of specular colour and glossiness")
        return pbr

    def _read_textures(self, pbr: Tree) -> dict[Role, Texture]:
        gloss = pbr.get("metallicRoughnessTexture")
        references: dict[Role, tuple[Tree | None, int | None]] = {
            "colour": (pbr.get("baseColorTexture"), None),
            "normal": (self.material.get("normalTexture"), None),
            "roughness": (gloss, _ROUGHNESS_CHANNEL),
            "metalness": (gloss, _METALNESS_CHANNEL),
            "emission": (self.material.get("emissiveTexture"), None),
        }
        found = {
            role: self._read_texture(reference, channel) for role, (reference, channel) in references.items()
        }
        return {role: texture for role, texture in found.items() if texture is not None}

    def _emitted_radiance(self) -> Colour:
        strength = float(
            (self.extensions.get(_EMISSIVE_STRENGTH_EXTENSION) or {}).get("emissiveStrength", 1.0)
        )
        r, g, b = (strength * float(value) for value in self.material.get("emissiveFactor", (0.0, 0.0, 0.0)))
        return r, g, b

    def _read_texture(self, reference: Tree | None, channel: int | None) -> Texture | None:
        """Return the texture that a material references; None without a reference or a picture.

        reference : JSON object that refers to the texture, such as the material's "normalTexture"
        channel : index of the picture's channel to use; None for colours, normals and grey pictures
        """
        if reference is None:
            return None
        entry = self.document.top_level_object("textures", reference["index"])
        picture = self._read_texture_picture(entry)
        if picture is None:
            return None
        extension = (reference.get("extensions") or {}).get("KHR_texture_transform") or {}
        uv_set = extension["texCoord"] if "texCoord" in extension else reference.get("texCoord", 0)
        sampler = self.document.top_level_object("samplers", entry["sampler"]) if "sampler" in entry else {}
        if sampler.get("magFilter") == _NEAREST_FILTER:
            self.unused.append("magnification without interpolation")
        wrap = (
            _WRAP_OF_GLTF_CODE[sampler.get("wrapS", 10497)],
            _WRAP_OF_GLTF_CODE[sampler.get("wrapT", 10497)],
        )
        return Texture(picture, uv_set, _uv_transform(extension), wrap, channel)

    def _read_texture_picture(self, texture_tree: Tree) -> EmbeddedPicture | None:
        extensions = texture_tree.get("extensions") or {}
        sources = [extensions[name].get("source") for name in _SOURCE_EXTENSIONS if name in extensions]
        sources.append(texture_tree.get("source"))
        source = next((one for one in sources if one is not None), None)
        if source is None:
            if _BASISU_EXTENSION in extensions:
                actual = f"a texture has only a KTX2 picture ({_BASISU_EXTENSION})"
                refuse(
                    self.document.path, "PNG, JPEG, WebP or AVIF", actual, "Export with one of these formats"
                )
            return None
        return read_picture(self.document, source)


def read_picture(document: Document, image_index: Any) -> EmbeddedPicture:
    """Return an image of a document; the picture format is detected from the bytes of the image.

    image_index : index of the image in the document

    Raises DermisError for an image file outside the folder of the document.
    """
    image = document.top_level_object("images", image_index)
    name = f"{document.path}, image {image.get('name', image_index)}"
    if "bufferView" in image:
        return EmbeddedPicture(name, bytes(document.read_view(image["bufferView"])))
    uri = image["uri"]
    if uri.startswith("data:"):
        return EmbeddedPicture(name, base64.b64decode(uri.partition(",")[2]))
    file = resolve_uri(document.path, uri)
    return EmbeddedPicture(str(file), file)


def _checked_relief_mm(height_mm: object) -> float | None:
    """Return `height_mm` after checking that it is a plausible number; None for None.

    height_mm : height difference of one grey level of an embedded 8-bit height map [mm]
    """
    if height_mm is None:
        return None
    number = height_mm if isinstance(height_mm, int | float) and not isinstance(height_mm, bool) else 0
    if not 0 < number <= MAX_RELIEF_MM:
        raise ValueError(f"height_mm is {str(height_mm)[:40]!r}, not above 0 and up to {MAX_RELIEF_MM:g}")
    return float(number)


def _uv_transform(extension: Tree) -> UvTransform:
    """Return the uv transform that KHR_texture_transform states: first scale, then rotation, then offset."""
    if not extension:
        return IDENTITY_UV_TRANSFORM
    (x, y), (scale_x, scale_y) = extension.get("offset", (0.0, 0.0)), extension.get("scale", (1.0, 1.0))
    angle = float(extension.get("rotation", 0.0))
    cos, sin = math.cos(angle), math.sin(angle)
    return (cos * scale_x, sin * scale_y, float(x), -sin * scale_x, cos * scale_y, float(y))
