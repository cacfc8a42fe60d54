"""Unity project with a head: meshes, skin material, diffusion profile and maps, which refer to each other."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.engine_files import (
    colour_png,
    engine_maps,
    lod_files,
    normal_png,
    packed_png,
)
from dermis.base.arrays import Floats
from dermis.images.colour import encode_srgb

HDRP_LIT_GUID = "6e4ae4064600d784cac1e41a9e6f2e59"
"""GUID of the shader HDRP/Lit, the same in all versions of HDRP."""
_PACKAGES_BY_HDRP_VERSION: Mapping[str, tuple[str, str]] = {
    "12": ("2021.3.45f1", "12.1.15"),
    "14": ("2022.3.62f1", "14.0.12"),
    "17": ("6000.0.58f1", "17.0.4"),
}
"""Versions of the editor and of the package HDRP."""
_GLTFAST_VERSION = "6.9.0"
_FOLDER = Path(__file__).parent
Files = Iterator[tuple[str, bytes]]


def project_files(subject: Subject, stem: str, profile_asset: str, version: str) -> Files:
    """Yield the paths and contents of the files of a Unity project.

    stem : name of the head in names of files
    profile_asset : YAML of the diffusion profile
    version : version of HDRP
    """
    editor, hdrp = _PACKAGES_BY_HDRP_VERSION[version]
    dependencies = {
        "com.unity.cloud.gltfast": _GLTFAST_VERSION,
        "com.unity.render-pipelines.high-definition": hdrp,
    }
    manifest = json.dumps({"dependencies": dependencies}, indent=2) + "\n"
    yield "Packages/manifest.json", manifest.encode()
    yield "ProjectSettings/ProjectVersion.txt", f"m_EditorVersion: {editor}\n".encode()
    folder = f"Assets/{stem}/{stem}"
    for name, content in lod_files(subject, stem):
        yield f"Assets/{stem}/{name}", content
    maps = dict(_map_files(subject))
    for name, content in maps.items():
        yield f"{folder}_{name}.png", content
        yield f"{folder}_{name}.png.meta", _texture_meta(f"{stem}_{name}", name).encode()
    profile, material = f"{stem}_DiffusionProfile", f"{stem}_Skin"
    yield f"Assets/{stem}/{profile}.asset", profile_asset.encode()
    yield f"Assets/{stem}/{profile}.asset.meta", _native_meta(profile, 11400000).encode()
    yield f"Assets/{stem}/{material}.mat", _material(subject, stem, list(maps), profile).encode()
    yield f"Assets/{stem}/{material}.mat.meta", _native_meta(material, 2100000).encode()


def asset_guid(name: str) -> str:
    """Return a GUID that depends on a name only, and whose bytes are four normal floating-point numbers.

    HDRP stores the GUID of a diffusion profile as a vector of these numbers.
    """
    data = bytearray(hashlib.md5(f"dermis/{name}".encode(), usedforsecurity=False).digest())
    for last in range(3, 16, 4):
        data[last] = 0x20 | data[last] & 0x9F  # limits the exponent, so that no number is infinite or 0
    return data.hex()


def guid_vector(guid: str) -> Floats:
    """Return a GUID as the vector (4,) in which materials of HDRP store it."""
    return np.frombuffer(bytes.fromhex(guid), "<f4")


def _map_files(subject: Subject) -> Files:
    """Yield the maps of the skin with the names and the packing of HDRP/Lit.

    MaskMap: red metallic, green ambient occlusion, blue detail mask, alpha smoothness.
    """
    maps = engine_maps(subject)
    if "colour" in maps:
        yield "BaseMap", colour_png(maps["colour"])
    if "roughness" in maps:
        yield "MaskMap", packed_png(0.0, 1.0, 0.0, 1.0 - maps["roughness"])
    if "normal" in maps:
        yield "Normal", normal_png(maps["normal"])


def _texture_meta(asset_name: str, map_name: str) -> str:
    template = Template((_FOLDER / "texture.meta.txt").read_text("utf-8"))
    is_normal, is_colour = map_name == "Normal", map_name == "BaseMap"
    return template.substitute(guid=asset_guid(asset_name), srgb=int(is_colour), type=int(is_normal))


def _native_meta(asset_name: str, main_object: int) -> str:
    return (
        f"fileFormatVersion: 2\nguid: {asset_guid(asset_name)}\nNativeFormatImporter:\n"
        f"  externalObjects: {{}}\n  mainObjectFileID: {main_object}\n  userData:\n"
        "  assetBundleName:\n  assetBundleVariant:\n"
    )


def _material(subject: Subject, stem: str, map_names: list[str], profile_name: str) -> str:
    """Return the YAML of a material of HDRP/Lit with subsurface scattering and the maps of the skin."""
    slots = {"BaseMap": "_BaseColorMap", "MaskMap": "_MaskMap", "Normal": "_NormalMap"}
    keywords = ["_MATERIAL_FEATURE_SUBSURFACE_SCATTERING", "_MATERIAL_FEATURE_TRANSMISSION"]
    keywords += ["_MASKMAP"] * ("MaskMap" in map_names)
    keywords += ["_NORMALMAP", "_NORMALMAP_TANGENT_SPACE"] * ("Normal" in map_names)
    textures = "".join(
        f"    - {slots[name]}:\n"
        f"        m_Texture: {{fileID: 2800000, guid: {asset_guid(f'{stem}_{name}')}, type: 3}}\n"
        "        m_Scale: {x: 1, y: 1}\n        m_Offset: {x: 0, y: 0}\n"
        for name in map_names
    )
    has_colour = "BaseMap" in map_names
    # Unity stores the colours of materials in sRGB
    r, g, b = np.ones(3) if has_colour else encode_srgb(subject.clipped_albedo())
    roughness = float(np.sqrt(subject.skin.roughness * subject.skin.roughness_factor))
    x, y, z, w = (f"{number:.9g}" for number in guid_vector(asset_guid(profile_name)).tolist())
    return Template((_FOLDER / "skin.mat.txt").read_text("utf-8")).substitute(
        name=json.dumps(f"{stem}_Skin"),
        shader=HDRP_LIT_GUID,
        keywords="".join(f"  - {name}\n" for name in sorted(keywords)),
        textures=f"\n{textures}" if textures else " []\n",
        smoothness=f"{1.0 - roughness:.6g}",
        colour=f"{{r: {r:.6g}, g: {g:.6g}, b: {b:.6g}, a: 1}}",
        profile=f"{{r: {x}, g: {y}, b: {z}, a: {w}}}",
    )
