"""Materials of a head that is written: what any program shows, and all maps for this package."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from dermis.base.arrays import Bytes, Floats, Numbers
from dermis.formats.gltf.document import FrozenTree, Tree
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.eyeball import EyePictures
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material
from dermis.specular.hair import ETA

_IOR = {"KHR_materials_ior": {"ior": 1.4}}
EYE, EYE_NORMAL = "eye", "eye normal"
"""Names of an eye's pictures."""
_TEARS = 0.15  # perceptual roughness of their film
_COAT = 0.52  # of glTF's coat, which reflects 0.04 straight ahead: tears and the cornea do 0.021
_HAIR_ROUGH = 0.45
_ROUGH = {"eye": 0.1, "teeth": 0.3, "tongue": 0.4}  # perceptual roughness by a word in the name
_ROUGH_ELSE = 0.8


@dataclass(frozen=True)
class SkinAdditions:
    """What the material of skin has besides.

    surface : members of its pbrMetallicRoughness, which then has no others for colour
    extensions, extras : by name
    pictures : PNG files by the names that textures in these have: {"index": name}
    """

    surface: FrozenTree = field(default_factory=dict)
    extensions: FrozenTree = field(default_factory=dict)
    extras: FrozenTree = field(default_factory=dict)
    pictures: Mapping[str, bytes] = field(default_factory=dict)

    def applied_to(self, material: FrozenTree) -> Tree:
        """The material with it; where a picture of colours is shown no more, this package still finds it."""
        told = dict(material) | {"extensions": {**material.get("extensions", {}), **self.extensions}}
        surface, extras = (
            dict(material["pbrMetallicRoughness"]),
            {**material.get("extras", {}), **self.extras},
        )
        if self.surface:
            colours = surface.pop("baseColorTexture", None)
            surface |= self.surface
            if colours is not None:
                extras["dermis"] = {**extras["dermis"], "colour": colours}
        return told | {"pbrMetallicRoughness": surface, "extras": extras}


def skin_pictures(maps: Maps, slopes: Floats | None = None) -> tuple[dict[str, bytes], Tree]:
    """PNG files by name, and what this package reads of them: {"index": name} by role.

    slopes : (n, n, 2) of the relief for other programs, where `maps` has a height map and no normals
    """
    found: dict[str, Numbers] = {}
    roles: Tree = {}
    if maps.colour is not None:
        found["colour"] = encode_srgb8(maps.colour)
    shown = slopes if maps.normal is None else maps.normal
    if shown is not None:
        found["normal"] = _normal_colours(shown)
    if maps.normal is not None:
        roles["normal"] = {"index": "normal"}
    if maps.height is not None:
        low, span = float(maps.height.min()), float(np.ptp(maps.height)) or 1.0
        grey = np.rint((maps.height.astype(np.float64) - low) / span * 65535).astype(np.uint16)
        found["height"], roles["height_mm"] = grey[..., None], span / 255
    if maps.roughness is not None:
        perceptual = np.zeros((*maps.roughness.shape, 3), np.float32)
        perceptual[..., 1] = np.sqrt(np.clip(maps.roughness, 0.0, 1.0))
        found["metallic roughness"] = _to_bytes(perceptual)
    for role in ("specular", "roughness"):
        if (grey_map := getattr(maps, role)) is not None:
            found[role] = _to_bytes(grey_map)[..., None]
    if maps.region is not None:
        found["region"] = maps.region[..., None]
    own = (role for role in ("height", "specular", "roughness", "region") if role in found)
    roles |= {role: {"index": role} for role in own}
    with ThreadPoolExecutor() as beside:
        return dict(zip(found, beside.map(encode_png, found.values()), strict=True)), roles


def surface_material(
    one: Material, pictures: Mapping[str, bytes], roles: FrozenTree, roughness: float
) -> Tree:
    """A glTF material, in which a texture is named by its picture: {"index": name}.

    roughness : Beckmann's m of skin without a map of it [-]
    """
    if one.kind != "skin":
        rough = next((value for word, value in _ROUGH.items() if word in one.name.casefold()), _ROUGH_ELSE)
        return {"name": one.name, "pbrMetallicRoughness": _base_material(one, rough)}
    surface = _base_material(one, float(np.sqrt(roughness)))
    if "colour" in pictures:
        del surface["baseColorFactor"]
        surface["baseColorTexture"] = {"index": "colour"}
    if "metallic roughness" in pictures:
        surface |= {"roughnessFactor": 1.0, "metallicRoughnessTexture": {"index": "metallic roughness"}}
    name = one.name if "skin" in one.name.casefold() else f"{one.name} skin"
    told: Tree = {"name": name, "pbrMetallicRoughness": surface}
    if "normal" in pictures:
        told["normalTexture"] = {"index": "normal"}
    return told | {"extensions": _IOR, "extras": {"dermis": dict(roles)}}


def eye_pictures(eyes: EyePictures) -> dict[str, bytes]:
    """PNG files of an eyeball by name."""
    return {EYE: colours_png(eyes.colour), EYE_NORMAL: encode_png(_to_bytes(0.5 * eyes.normal + 0.5))}


def eye_material(one: Material) -> Tree:
    """An eyeball that is painted as seen through its cornea, whose film of tears is a coat over it.

    What lies below faces otherwise than the coat, and shines by itself only where a program has none.
    """
    surface = _base_material(one, _TEARS) | {"baseColorTexture": {"index": EYE}}
    del surface["baseColorFactor"]
    coat = {"clearcoatFactor": _COAT, "clearcoatRoughnessFactor": _TEARS}
    return {
        "name": one.name,
        "pbrMetallicRoughness": surface,
        "normalTexture": {"index": EYE_NORMAL},
        "extensions": {"KHR_materials_clearcoat": coat, "KHR_materials_specular": {"specularFactor": 0.0}},
    }


def hair_material(name: str) -> Tree:
    """Hairs with a picture of their own name."""
    surface = {"baseColorTexture": {"index": name}, "metallicFactor": 0.0, "roughnessFactor": _HAIR_ROUGH}
    return {"name": name, "pbrMetallicRoughness": surface, "extensions": {"KHR_materials_ior": {"ior": ETA}}}


def colours_png(linear: Floats) -> bytes:
    """A PNG file of linear colours (h, w, 3)."""
    return encode_png(encode_srgb8(linear))


def _base_material(one: Material, roughness: float) -> Tree:
    factor = [*(float(value) for value in one.colour), 1.0]
    return {"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": round(roughness, 4)}


def _normal_colours(slopes: Floats) -> Bytes:
    """(h, w, 3) tangent-space normals as colours, green up."""
    normal = np.concatenate([-slopes, np.ones_like(slopes[..., :1])], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _to_bytes(0.5 * normal + 0.5)


def _to_bytes(values: Numbers) -> Bytes:
    return np.asarray(np.rint(np.clip(values, 0, 1) * 255), np.uint8)
