"""Materials of exported glTF heads; their extras list the maps that this package reads back."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from dermis.base.arrays import Floats, Numbers
from dermis.formats.gltf.document import FrozenTree, Tree
from dermis.formats.part_pictures import PartPictures, PartRole, encode_linear8, encode_normals8
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material
from dermis.specular.hair import KERATIN_ETA

_SKIN_IOR_EXTENSION = {"KHR_materials_ior": {"ior": 1.4}}
EYE_PICTURE, EYE_NORMAL_PICTURE = "eye", "eye normal"
"""Names of the pictures of an eye."""
_TEAR_FILM_ROUGHNESS = 0.15  # perceptual roughness of the tear film
_TEAR_FILM_CLEARCOAT_FACTOR = 0.52  # eyes reflect 0.021 at normal incidence, glTF's clear coat 0.04
_HAIR_ROUGHNESS, _RIBBON_ROUGHNESS = 0.45, 0.6
_RIBBON_SPECULAR = 0.4  # factor of the specular reflectance, as other hair hides most of the surroundings
_ROUGHNESS_BY_WORD = {"eye": 0.1, "teeth": 0.3, "tongue": 0.4}  # perceptual roughness by a word in the name
_DEFAULT_ROUGHNESS = 0.8


@dataclass(frozen=True)
class SkinMaterialAdditions:
    """Properties that an export adds to the glTF material of skin.

    surface : members to add to the material's `pbrMetallicRoughness`, such as a `baseColorFactor`; if there
        are any, they replace the base colour texture, which moves to the material's `extras`
    extensions : members to add to the material's `extensions`
    extras : members to add to the material's `extras`
    pictures : dictionary from name to PNG file; textures reference a picture as {"index": name}
    """

    surface: FrozenTree = field(default_factory=dict)
    extensions: FrozenTree = field(default_factory=dict)
    extras: FrozenTree = field(default_factory=dict)
    pictures: Mapping[str, bytes] = field(default_factory=dict)

    def extend_material(self, material: FrozenTree) -> Tree:
        """Return a copy of a glTF material, extended by the properties of this object.

        If `surface` is not empty, the material's base colour texture moves to the entry "colour" of its
        "dermis" extras. There, other programs ignore the texture, but this package finds it when it reads the
        file.
        """
        extended = dict(material) | {"extensions": {**material.get("extensions", {}), **self.extensions}}
        surface = dict(material["pbrMetallicRoughness"])
        extras = {**material.get("extras", {}), **self.extras}
        if self.surface:
            colours = surface.pop("baseColorTexture", None)
            surface |= self.surface
            if colours is not None:
                extras["dermis"] = {**extras["dermis"], "colour": colours}
        return extended | {"pbrMetallicRoughness": surface, "extras": extras}


def encode_skin_maps(
    maps: Maps, slopes: Floats | None = None, compact: bool = False
) -> tuple[dict[str, bytes], Tree]:
    """Return the maps of a skin as PNG files, and their description for the extras of the glTF material.

    The first result is a dictionary from picture name to PNG file. The second result is a dictionary from
    the role of a map to {"index": picture name}; if there is a height map, it also contains "height_mm".
    `embedded_materials` reads these entries.

    slopes : (n, n, 2) slopes of the relief, which become a normal map for other programs if `maps` contains
        no normal map
    compact : whether to leave out the pictures that no other program reads: heights, regions, and roughness
        that is not perceptual
    """
    if compact:
        maps = replace(maps, height=None, region=None)
    pictures: dict[str, Numbers] = {}
    roles: Tree = {}
    if maps.colour is not None:
        pictures["colour"] = encode_srgb8(maps.colour)
    displayed = slopes if maps.normal is None else maps.normal
    if displayed is not None:
        pictures["normal"] = encode_normals8(displayed)
    if displayed is not None and (compact or maps.normal is not None):
        roles["normal"] = {"index": "normal"}
    if maps.height is not None:
        low, span = float(maps.height.min()), float(np.ptp(maps.height)) or 1.0
        grey = np.rint((maps.height.astype(np.float64) - low) / span * 65535).astype(np.uint16)
        pictures["height"], roles["height_mm"] = grey[..., None], span / 255
    if maps.roughness is not None:
        perceptual = np.zeros((*maps.roughness.shape, 3), np.float32)
        perceptual[..., 1] = np.sqrt(np.clip(maps.roughness, 0.0, 1.0))
        pictures["metallic roughness"] = encode_linear8(perceptual)
    if maps.specular is not None:  # other programs read the alpha channel, this package the grey one
        pictures["specular"] = encode_linear8(maps.specular)[..., None].repeat(2, axis=2)
    if maps.roughness is not None and not compact:
        pictures["roughness"] = encode_linear8(maps.roughness)[..., None]
    if maps.region is not None:
        pictures["region"] = maps.region[..., None]
    stored = (role for role in ("height", "specular", "roughness", "region") if role in pictures)
    roles |= {role: {"index": role} for role in stored}
    with ThreadPoolExecutor() as pool:
        return dict(zip(pictures, pool.map(encode_png, pictures.values()), strict=True)), roles


def surface_material(
    material: Material, pictures: Mapping[str, bytes], map_entries: FrozenTree, roughness: float
) -> Tree:
    """Return the glTF material of skin or of another opaque surface.

    The textures of the material reference pictures by name, as {"index": name}.

    material : material of the head
    pictures : PNG files of the skin's maps by name, see `encode_skin_maps`
    map_entries : description of the maps for the extras of the skin material, see `encode_skin_maps`
    roughness : Beckmann's m of skin without a roughness map [-]
    """
    if material.kind != "skin":
        roughness = _roughness_from_name(material) if material.roughness is None else material.roughness
        plain = _plain_gltf_surface(material, roughness) | {"metallicFactor": material.metalness}
        return {"name": material.name, "pbrMetallicRoughness": plain}
    surface = _plain_gltf_surface(material, float(np.sqrt(roughness)))
    if "colour" in pictures:
        del surface["baseColorFactor"]
        surface["baseColorTexture"] = {"index": "colour"}
    if "metallic roughness" in pictures:
        surface |= {"roughnessFactor": 1.0, "metallicRoughnessTexture": {"index": "metallic roughness"}}
    gltf: Tree = {"name": gltf_material_name(material), "pbrMetallicRoughness": surface}
    if "normal" in pictures:
        gltf["normalTexture"] = {"index": "normal"}
    extensions: Tree = dict(_SKIN_IOR_EXTENSION)
    if "specular" in pictures:
        extensions["KHR_materials_specular"] = {"specularTexture": {"index": "specular"}}
    return gltf | {"extensions": extensions, "extras": {"dermis": dict(map_entries)}}


def gltf_material_name(material: Material) -> str:
    """Return the name of a material in the file; that of skin contains the word "skin"."""
    is_named = material.kind != "skin" or "skin" in material.name.casefold()
    return material.name if is_named else f"{material.name} skin"


def skin_material_names(head: Head) -> list[str]:
    """Return the names of the skin materials in the .glb file."""
    used = [head.mesh.materials[index] for index in np.unique(head.mesh.material)]
    return [gltf_material_name(material) for material in used if material.kind == "skin"]


def encode_part_pictures(part_maps: PartPictures) -> dict[str, bytes]:
    """Return the pictures of parts that are not skin, as PNG files by name.

    The colour picture has an alpha channel if any part needs alpha.
    """
    found = part_maps.encode(("cutout", "surface", "normal", "emission"))
    if "cutout" not in found:
        found |= part_maps.encode(("colour",))
    names = {role: f"parts {'colour' if role == 'cutout' else role}" for role in found}
    return {names[role]: data for role, data in found.items()}


def part_material(material: Material, part_maps: PartPictures) -> Tree:
    """Return the glTF material of a part that is not skin, with the pictures of `encode_part_pictures`.

    The textures of the material reference pictures by name, as {"index": name}.

    material : material of the part
    part_maps : pictures that all parts share
    """
    roles = part_maps.needed_roles(material)
    surface: Tree = {
        "baseColorTexture": _part_texture("colour"),
        "metallicFactor": float("metalness" in roles),
        "roughnessFactor": 1.0 if "roughness" in roles else _roughness_from_name(material),
    }
    if "surface" in roles:
        surface["metallicRoughnessTexture"] = _part_texture("surface")
    gltf: Tree = {"name": material.name, "pbrMetallicRoughness": surface, "doubleSided": True}
    if "cutout" in roles:
        gltf |= {"alphaMode": "MASK", "alphaCutoff": 0.5}
    if "normal" in roles:
        gltf["normalTexture"] = _part_texture("normal")
    if "emission" in roles:
        gltf["emissiveTexture"] = _part_texture("emission")
    if max(material.emission) > 0.0:
        strength, colour = part_maps.emission_strength_and_colour(material)
        gltf["emissiveFactor"] = [min(strength, 1.0) * value for value in colour]
        if strength > 1.0:
            gltf["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    return gltf


def _part_texture(role: PartRole) -> Tree:
    return {"index": f"parts {role}"}


def encode_eye_pictures(eyes: EyeTextures) -> dict[str, bytes]:
    """Return the colour map and the normal map of an eyeball as PNG files by name."""
    return {
        EYE_PICTURE: encode_colours_png(eyes.colour),
        EYE_NORMAL_PICTURE: encode_png(encode_linear8(0.5 * eyes.normal + 0.5)),
    }


def eye_material(material: Material) -> Tree:
    """Return the glTF material of a textured eyeball, whose tear film is a clear coat.

    The normal map applies to the surface below the clear coat. Programs that support clear coat show
    highlights only on the coat; other programs show highlights on the surface below the coat.
    """
    surface = _plain_gltf_surface(material, _TEAR_FILM_ROUGHNESS) | {
        "baseColorTexture": {"index": EYE_PICTURE}
    }
    del surface["baseColorFactor"]
    coat = {"clearcoatFactor": _TEAR_FILM_CLEARCOAT_FACTOR, "clearcoatRoughnessFactor": _TEAR_FILM_ROUGHNESS}
    return {
        "name": material.name,
        "pbrMetallicRoughness": surface,
        "normalTexture": {"index": EYE_NORMAL_PICTURE},
        "extensions": {"KHR_materials_clearcoat": coat, "KHR_materials_specular": {"specularFactor": 0.0}},
    }


def hair_material(picture_name: str, has_alpha: bool = False) -> Tree:
    """Return the glTF material of hairs, whose colours are in the picture called `picture_name`.

    has_alpha : whether the picture shows hairs with gaps between them, on ribbons that have two sides
    """
    surface = {
        "baseColorTexture": {"index": picture_name},
        "metallicFactor": 0.0,
        "roughnessFactor": _RIBBON_ROUGHNESS if has_alpha else _HAIR_ROUGHNESS,
    }
    cut = {"alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True} if has_alpha else {}
    extensions: Tree = {"KHR_materials_ior": {"ior": KERATIN_ETA}}
    if has_alpha:
        extensions["KHR_materials_specular"] = {"specularFactor": _RIBBON_SPECULAR}
    return {
        "name": picture_name,
        "pbrMetallicRoughness": surface,
        **cut,
        "extensions": extensions,
    }


def encode_colours_png(linear_colours: Floats) -> bytes:
    """Encode linear colours (h, w, 3), or with alpha (h, w, 4), as an sRGB PNG file."""
    levels = encode_srgb8(linear_colours[..., :3])
    return encode_png(np.concatenate([levels, encode_linear8(linear_colours[..., 3:])], axis=-1))


def _plain_gltf_surface(material: Material, roughness: float) -> Tree:
    factor = [*(float(value) for value in material.colour), 1.0]
    return {"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": round(roughness, 4)}


def _roughness_from_name(material: Material) -> float:
    """Return a default perceptual roughness for a material, chosen by words in its name [-]."""
    matches = (value for word, value in _ROUGHNESS_BY_WORD.items() if word in material.name.casefold())
    return next(matches, _DEFAULT_ROUGHNESS)
