"""Encoding of a head with its rig as one .glb file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.binary import CLAMPED_SAMPLER, BufferBuilder, glb_bytes, resolve_textures
from dermis.formats.gltf.document import FrozenTree, Tree
from dermis.formats.gltf.materials import (
    SkinMaterialAdditions,
    encode_colours_png,
    encode_eye_pictures,
    encode_part_pictures,
    encode_skin_maps,
    eye_material,
    hair_material,
    part_material,
    surface_material,
)
from dermis.formats.gltf.primitives import FibreTubes, HairPrimitive, PrimitiveSource, SurfacePrimitive
from dermis.formats.part_pictures import PartPictures
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.grown_strands import hair_strands
from dermis.mesh.head import Head
from dermis.mesh.skeleton import Skeleton

BROWS, HAIR = "brows and lashes", "hair"
"""Names of two materials: one for brows and lashes, one for all other hair. Their pictures have the same
names."""
_KNOTS_PER_HAIR = {BROWS: 5, HAIR: 4}
_MAX_EXPORTED_HAIRS = 16_000  # more hairs are represented by fewer, wider ones
_METRES_PER_MM = 1e-3


def encode_head(
    head: Head,
    *,
    roughness: float,
    weights: Mapping[str, float] | None = None,
    slopes: Floats | None = None,
    asset_extras: FrozenTree | None = None,
    eyes: EyeTextures | None = None,
    skin_additions: SkinMaterialAdditions | None = None,
) -> bytes:
    """Encode a head as a .glb file in metres, with one primitive per material, morph targets and joints.

    Hairs become thin tubes, which this package does not read back. Equal heads give identical bytes.

    roughness : Beckmann's m of skin without a roughness map [-]
    weights : default weights of morph targets by name, which override the weights of the rest pose
    slopes : (n, n, 2) slopes of the relief, written as a normal map for programs that read no height map
    asset_extras : entries for the extras of the file's "asset"
    eyes : maps of the eyeballs; None for eyes in a uniform colour
    skin_additions : properties to add to the material of skin
    """
    binary, deformable = BufferBuilder(), DeformableMesh(head)
    pictures, roles = encode_skin_maps(head.maps, slopes)
    pictures |= {} if skin_additions is None else skin_additions.pictures
    parts, materials = _primitive_sources(deformable, pictures, roles, roughness, eyes)
    if skin_additions is not None:
        materials = [
            skin_additions.extend_material(material) if "dermis" in material.get("extras", {}) else material
            for material in materials
        ]
    images = [
        {"bufferView": binary.add_view(data), "mimeType": "image/png", "name": name}
        for name, data in pictures.items()
    ]
    textures = {name: index for index, name in enumerate(pictures)}
    nodes, roots, skins = _gltf_nodes(head, binary)
    tree = {
        "asset": _gltf_asset(head, asset_extras),
        "extensionsUsed": sorted({name for material in materials for name in material.get("extensions", {})}),
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [_gltf_mesh(deformable, binary, parts, weights or {})],
        "skins": skins,
        "materials": [resolve_textures(material, textures) for material in materials],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [CLAMPED_SAMPLER] if images else [],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    return glb_bytes({key: value for key, value in tree.items() if value != []}, binary.data)


def _primitive_sources(
    deformable_mesh: DeformableMesh,
    pictures: dict[str, bytes],
    map_entries: FrozenTree,
    roughness: float,
    eyes: EyeTextures | None,
) -> tuple[list[PrimitiveSource], list[Tree]]:
    """Return the geometry and the material of each glTF primitive, as two lists in the same order.

    pictures : PNG files by name; this function adds the pictures of eyes, hairs and parts that are not skin
    map_entries : description of the maps for the extras of the skin material, see `encode_skin_maps`
    roughness, eyes : see `encode_head`
    """
    head = deformable_mesh.head
    eye_materials = [] if eyes is None or head.eyes is None else head.eyes.material.tolist()
    if eyes is not None and eye_materials:
        pictures |= encode_eye_pictures(eyes)
    part_maps = PartPictures.from_head(head)
    if part_maps is not None:
        pictures |= encode_part_pictures(part_maps)
    parts, materials = list[PrimitiveSource](), list[Tree]()
    for index in np.unique(head.mesh.material).tolist():
        eye = eye_materials.index(index) if index in eye_materials else -1
        parts.append(SurfacePrimitive(deformable_mesh, np.flatnonzero(head.mesh.material == index), eye))
        own = head.mesh.materials[index]
        if eye >= 0:
            materials.append(eye_material(own))
        elif part_maps is not None and own.has_maps:
            materials.append(part_material(own, part_maps))
        else:
            materials.append(surface_material(own, pictures, map_entries, roughness))
    for name, strands in ((BROWS, head.strands), (HAIR, hair_strands(head))):
        if strands is not None and len(strands):
            fibres = FibreTubes.from_strands(strands, head.mesh, _MAX_EXPORTED_HAIRS, _KNOTS_PER_HAIR[name])
            parts.append(HairPrimitive(deformable_mesh, fibres))
            materials.append(hair_material(name))
            pictures[name] = encode_colours_png(fibres.palette_and_uv()[0])
    return parts, materials


def _gltf_asset(head: Head, notes: FrozenTree | None) -> Tree:
    asset: Tree = {"version": "2.0", "generator": "dermis"}
    if head.attribution:
        asset["copyright"] = head.attribution
    return asset | ({"extras": dict(notes)} if notes else {})


def _gltf_mesh(
    deformable_mesh: DeformableMesh,
    buffer_builder: BufferBuilder,
    primitive_sources: list[PrimitiveSource],
    weights: Mapping[str, float],
) -> Tree:
    """Return the glTF mesh with its primitives, morph targets and default weights.

    buffer_builder : buffer to which vertices, triangles and morph targets are appended
    primitive_sources : geometry of each primitive; primitive i has material i
    weights : default weights of morph targets by name
    """
    primitives = [
        source.add_primitive(buffer_builder) | {"material": number}
        for number, source in enumerate(primitive_sources)
    ]
    mesh: Tree = {"name": _mesh_name(deformable_mesh.head), "primitives": primitives}
    names, rest = deformable_mesh.rig.targets.names, deformable_mesh.rig.targets.rest
    if not names:
        return mesh
    for target in deformable_mesh.targets():
        for primitive, source in zip(primitives, primitive_sources, strict=True):
            primitive.setdefault("targets", []).append(source.add_target(buffer_builder, target))
    resting = {} if rest is None else dict(zip(names, rest.tolist(), strict=True))
    values = [float({**resting, **weights}.get(name, 0.0)) for name in names]
    return mesh | {"weights": values, "extras": {"targetNames": list(names)}}


def _mesh_name(head: Head) -> str:
    """Return a name for the exported mesh that differs from the names of all bones."""
    name = Path(head.name).stem or "head"
    return f"{name} mesh" if name in head.bones else name


def _gltf_nodes(head: Head, buffer_builder: BufferBuilder) -> tuple[list[Tree], list[int], list[Tree]]:
    """Return the glTF nodes, the indices of the root nodes, and the list of glTF skins.

    The nodes are the bones, then the mesh. The list contains one glTF skin, which binds the mesh to the
    bones; it is empty for a head without bones.
    """
    skeleton = head.control_rig.skeleton
    if skeleton is None:
        return [{"name": _mesh_name(head), "mesh": 0}], [0], []
    nodes, inverse_bind = _bone_nodes(skeleton)
    roots = np.flatnonzero(skeleton.parent < 0).tolist()
    if len(roots) > 1:  # the joints of a skin need a common root
        nodes.append({"name": f"{_mesh_name(head)} bones", "children": roots})
        roots = [len(nodes) - 1]
    skin = {"joints": list(range(len(skeleton.names))), "skeleton": roots[0]}
    rows = inverse_bind.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
    skin["inverseBindMatrices"] = buffer_builder.add_accessor(rows)
    nodes.append({"name": _mesh_name(head), "mesh": 0, "skin": 0})
    return nodes, [*roots, len(nodes) - 1], [skin]


def _bone_nodes(skeleton: Skeleton) -> tuple[list[Tree], Doubles]:
    """Return the glTF nodes of b bones, and their inverse bind matrices (b, 4, 4); lengths are in metres."""
    to_file = np.diag([_METRES_PER_MM] * 3 + [1.0]) @ skeleton.to_head
    size = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    scaled_up, scaled_down = (np.diag([factor] * 3 + [1.0]) for factor in (size, 1.0 / size))
    nodes: list[Tree] = []
    for bone, (name, parent) in enumerate(zip(skeleton.names, skeleton.parent.tolist(), strict=True)):
        parent_space = to_file if parent < 0 else scaled_up
        children = np.flatnonzero(skeleton.parent == bone).tolist()
        node = {"name": name, **_node_transform(parent_space @ skeleton.local[bone] @ scaled_down)}
        nodes.append(node | ({"children": children} if children else {}))
    return nodes, np.asarray(scaled_up @ skeleton.inverse_bind @ np.linalg.inv(to_file))


def _node_transform(matrix: Doubles) -> Tree:
    """Return the transform of a glTF node: "translation" for a pure translation, else "matrix"."""
    if np.abs(matrix[:3, :3] - np.eye(3)).max() < 1e-9:
        return {"translation": [float(x) for x in matrix[:3, 3]]}
    return {"matrix": [float(x) for x in matrix.T.ravel()]}
