"""Parts of a head that are not skin and have pictures, as shapes of a Mitsuba scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from dermis.apps.export.scene_parts import encode_ply
from dermis.apps.export.targets.mitsuba.xml import Ref
from dermis.apps.truths.scene_description import SceneDict
from dermis.formats.part_pictures import PartPictures, PartRole
from dermis.mesh.head import Head

_PREFIX = "parts_"
_INPUTS: Mapping[PartRole, str] = {"colour": "base_color", "roughness": "roughness", "metalness": "metallic"}
_IOR = 1.5  # of the metallic-roughness model


class PicturedParts(NamedTuple):
    """Parts with pictures.

    textures : descriptions of the textures, to which surfaces refer by id
    surfaces : description of the BSDF of each part, by material index
    meshes : PLY file of each part, by material index
    files : contents of the files of the textures, by path
    """

    textures: Sequence[SceneDict] = ()
    surfaces: Mapping[int, SceneDict] = MappingProxyType({})
    meshes: Mapping[int, bytes] = MappingProxyType({})
    files: Mapping[str, bytes] = MappingProxyType({})


def pictured_parts(head: Head, plain_roughness: float) -> PicturedParts:
    """Return the parts of a head that have pictures, without eyes that the package models.

    plain_roughness : roughness of parts that state none
    """
    pictures = PartPictures.of(head)
    if pictures is None:
        return PicturedParts()
    modelled = [] if head.eyes is None else head.eyes.material.tolist()
    used = np.unique(head.mesh.material).tolist()
    parts = {k: head.mesh.materials[k] for k in used if k not in modelled and head.mesh.materials[k].has_maps}
    encoded = pictures.encode([*_INPUTS, "opacity", "normal"])
    return PicturedParts(
        [_texture(role) for role in encoded],
        {k: _surface(pictures.roles(one), plain_roughness) for k, one in parts.items()},
        {k: _mesh_ply(head, k) for k in parts},
        {_texture_file(role): data for role, data in encoded.items()},
    )


def _texture_file(role: PartRole) -> str:
    return f"textures/{_PREFIX}{role}.png"


def _texture(role: PartRole) -> SceneDict:
    texture: SceneDict = {"type": "bitmap", "id": f"{_PREFIX}{role}", "filename": _texture_file(role)}
    return {**texture, "raw": role != "colour", "wrap_mode": "clamp"}


def _surface(roles: set[PartRole], plain_roughness: float) -> SceneDict:
    """Return the description of the BSDF of a part."""
    bsdf: SceneDict = {"type": "principled", "eta": _IOR, "roughness": plain_roughness}
    bsdf |= {name: Ref(f"{_PREFIX}{role}") for role, name in _INPUTS.items() if role in roles}
    if "normal" in roles:
        bsdf = {"type": "normalmap", "normalmap": Ref(f"{_PREFIX}normal"), "bsdf": bsdf}
    bsdf = {"type": "twosided", "bsdf": bsdf}
    return {"type": "mask", "opacity": Ref(f"{_PREFIX}opacity"), "bsdf": bsdf} if "opacity" in roles else bsdf


def _mesh_ply(head: Head, material: int) -> bytes:
    """Return the PLY file of a part relative to the head's centre [mm], with v downwards as in Mitsuba."""
    mesh = head.mesh
    vertex, corner = np.unique(mesh.triangles[mesh.material == material], return_inverse=True)
    positions = mesh.positions[vertex] - np.array(head.centre_mm)
    return encode_ply(corner.reshape(-1, 3), positions, mesh.normals[vertex], mesh.uv[vertex])
