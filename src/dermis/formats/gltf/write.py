"""Encoding of a head with its rig as one .glb file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.binary import CLAMPED_SAMPLER, BufferBuilder, glb_bytes, resolve_textures
from dermis.formats.gltf.document import FrozenTree, Tree
from dermis.formats.gltf.hair_ribbons import RibbonPrimitive
from dermis.formats.gltf.hair_tubes import FibreTubes, TubePrimitive
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
from dermis.formats.gltf.primitives import METRES_PER_MM, PrimitiveSource, SurfacePrimitive
from dermis.formats.part_pictures import PartPictures
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material
from dermis.mesh.skeleton import Skeleton
from dermis.mesh.strand_groups import SCALP_HAIR, strand_groups

_HAIR_KNOTS = {"brows": 3, "lashes": 4, "beard": 3}
_MAX_GROWN_STRANDS = 10_000  # of hair and beard
_MAX_RIBBON_KNOTS = 30_000  # of scalp hair
_MAX_TUBES = 1_000  # of brows, lashes or beard; more hairs are represented by fewer, wider ones
_SIDE_WORDS = "left", "right", "upper", "lower"


@dataclass(frozen=True)
class ExportedPart:
    """One mesh of an exported file.

    name : name of the mesh, such as "head", "eye_left" or "hair"
    source : geometry
    material : glTF material, whose textures reference pictures by name
    """

    name: str
    source: PrimitiveSource
    material: Tree


def encode_head(
    head: Head,
    *,
    roughness: float,
    weights: Mapping[str, float] | None = None,
    slopes: Floats | None = None,
    asset_extras: FrozenTree | None = None,
    eyes: EyeTextures | None = None,
    skin_additions: SkinMaterialAdditions | None = None,
    compact: bool = False,
    hair_detail: float = 1.0,
    scalp_hair: bool = True,
) -> bytes:
    """Encode a head as a .glb file in metres, with one mesh per material, morph targets and joints.

    Brows, lashes and beard become thin tubes that move with the skin. Other hair becomes ribbons that follow
    the head. `read_gltf` skips tubes and ribbons. Equal heads give identical bytes.

    roughness : Beckmann's m of skin without a roughness map [-]
    weights : default weights of morph targets by name, which override the weights of the rest pose
    slopes : (n, n, 2) slopes of the relief, written as a normal map for programs that read no height map
    asset_extras : entries for the extras of the file's "asset"
    eyes : maps of the eyeballs; None for eyes in a uniform colour
    skin_additions : properties to add to the material of skin
    compact : whether to leave out maps that no other program reads, and small changes by morph targets
    hair_detail : fraction of the tubes and ribbons that represent hairs; fewer ones are wider
    scalp_hair : whether to write scalp hair
    """
    binary, deformable = BufferBuilder(), DeformableMesh(head)
    pictures, roles = encode_skin_maps(head.maps, slopes, compact)
    pictures |= {} if skin_additions is None else skin_additions.pictures
    parts = [
        *_surface_parts(deformable, pictures, roles, roughness, eyes, compact),
        *_hair_parts(deformable, pictures, hair_detail, scalp_hair),
    ]
    materials = [part.material for part in parts]
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
    nodes, roots, skins = _gltf_nodes(head, parts, binary)
    tree = {
        "asset": _gltf_asset(head, asset_extras),
        "extensionsUsed": sorted({name for material in materials for name in material.get("extensions", {})}),
        "scene": 0,
        "scenes": [{"name": Path(head.name).stem or "head", "nodes": roots}],
        "nodes": nodes,
        "meshes": _gltf_meshes(deformable, binary, parts, weights or {}),
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


def _surface_parts(
    deformable_mesh: DeformableMesh,
    pictures: dict[str, bytes],
    map_entries: FrozenTree,
    roughness: float,
    eyes: EyeTextures | None,
    compact: bool,
) -> Iterator[ExportedPart]:
    """Yield the parts of the mesh, one for each material.

    pictures : PNG files by name; this function adds the pictures of eyes and parts that are not skin
    map_entries : description of the maps for the extras of the skin material, see `encode_skin_maps`
    roughness, eyes, compact : see `encode_head`
    """
    head = deformable_mesh.head
    eye_materials = [] if eyes is None or head.eyes is None else head.eyes.material.tolist()
    if eyes is not None and eye_materials:
        pictures |= encode_eye_pictures(eyes)
    part_maps = PartPictures.from_head(head)
    if part_maps is not None:
        pictures |= encode_part_pictures(part_maps)
    for index in np.unique(head.mesh.material).tolist():
        eye = eye_materials.index(index) if index in eye_materials else -1
        faces = np.flatnonzero(head.mesh.material == index)
        source = SurfacePrimitive(deformable_mesh, faces, eye, compact)
        own = head.mesh.materials[index]
        if eye >= 0:
            material = eye_material(own)
        elif part_maps is not None and own.has_maps:
            material = part_material(own, part_maps)
        else:
            material = surface_material(own, pictures, map_entries, roughness)
        yield ExportedPart(part_name(own), source, material)


def part_name(material: Material) -> str:
    """Return the name of the mesh with a material: "head" for skin, "eye_left" for "left eye"."""
    if material.kind == "skin":
        return "head" if material.name.casefold() in ("", "skin") else material.name
    words = material.name.split()
    sides = [word for word in words if word in _SIDE_WORDS]
    return "_".join([*(word for word in words if word not in sides), *sides]) or "part"


def skin_part_names(head: Head) -> list[str]:
    """Return the names of the meshes of skin in the file of a head, which list all its morph targets."""
    used = [head.mesh.materials[index] for index in np.unique(head.mesh.material)]
    return [part_name(material) for material in used if material.kind == "skin"]


def _hair_parts(
    deformable_mesh: DeformableMesh, pictures: dict[str, bytes], hair_detail: float, scalp_hair: bool
) -> Iterator[ExportedPart]:
    """Yield brows, lashes, beard and hair.

    pictures : PNG files by name; this function adds the colours of the hairs
    hair_detail, scalp_hair : see `encode_head`
    """
    head = deformable_mesh.head
    for name, strands in strand_groups(head, _MAX_GROWN_STRANDS).items():
        if name == SCALP_HAIR and not scalp_hair:
            continue
        if name in _HAIR_KNOTS:
            fibres = FibreTubes.from_strands(
                strands, head.mesh, round(hair_detail * _MAX_TUBES), _HAIR_KNOTS[name]
            )
            source: PrimitiveSource = TubePrimitive(deformable_mesh, fibres)
            pictures[name] = encode_colours_png(fibres.palette_and_uv()[0])
        else:
            source = ribbons = RibbonPrimitive(
                deformable_mesh, strands, round(hair_detail * _MAX_RIBBON_KNOTS)
            )
            pictures[name] = encode_colours_png(ribbons.streaks_and_uv()[0])
        yield ExportedPart(name, source, hair_material(name, has_alpha=name not in _HAIR_KNOTS))


def _gltf_asset(head: Head, notes: FrozenTree | None) -> Tree:
    asset: Tree = {"version": "2.0", "generator": "dermis"}
    if head.attribution:
        asset["copyright"] = head.attribution
    return asset | ({"extras": dict(notes)} if notes else {})


def _gltf_meshes(
    deformable_mesh: DeformableMesh,
    buffer_builder: BufferBuilder,
    parts: Sequence[ExportedPart],
    weights: Mapping[str, float],
) -> list[Tree]:
    """Return the glTF meshes with their morph targets and default weights.

    Meshes of skin list all morph targets, other meshes those that move them.

    buffer_builder : buffer to which vertices, triangles and morph targets are appended
    parts : parts of the file; part i has mesh i and material i
    weights : default weights of morph targets by name
    """
    targets = deformable_mesh.rig.targets
    resting = {} if targets.rest is None else dict(zip(targets.names, targets.rest.tolist(), strict=True))
    meshes = list[Tree]()
    for number, part in enumerate(parts):
        primitive = part.source.add_primitive(buffer_builder) | {"material": number}
        meshes.append({"name": part.name, "primitives": [primitive]})
    for name, target in zip(targets.names, deformable_mesh.targets(), strict=True):
        for mesh, part in zip(meshes, parts, strict=True):
            is_skin = "dermis" in part.material.get("extras", {})
            if not is_skin and not part.source.is_moved_by(target):
                continue
            displacements = part.source.add_target(buffer_builder, target)
            mesh["primitives"][0].setdefault("targets", []).append(displacements)
            mesh.setdefault("weights", []).append(float({**resting, **weights}.get(name, 0.0)))
            mesh.setdefault("extras", {"targetNames": []})["targetNames"].append(name)
    return meshes


def _gltf_nodes(
    head: Head, parts: Sequence[ExportedPart], buffer_builder: BufferBuilder
) -> tuple[list[Tree], list[int], list[Tree]]:
    """Return the glTF nodes, the indices of the root nodes, and the list of glTF skins.

    The nodes are the bones, then the meshes in the order of `parts`. The list contains one glTF skin, which
    binds meshes to the bones; it is empty for a head without bones. Ribbons of hair are children of a bone.
    """
    skeleton = head.control_rig.skeleton
    names = _unique_names([part.name for part in parts], head.bones)
    mesh_roots = list[int]()  # in reverse order, as `read_nodes` visits the roots from last to first
    if skeleton is None:
        mesh_nodes = [{"name": name, "mesh": k} for k, name in enumerate(names)]
        return mesh_nodes, list(range(len(parts)))[::-1], []
    nodes, inverse_bind = _bone_nodes(skeleton)
    roots = np.flatnonzero(skeleton.parent < 0).tolist()
    if len(roots) > 1:  # the joints of a skin need a common root
        nodes.append({"name": f"{Path(head.name).stem or 'head'} bones", "children": roots})
        roots = [len(nodes) - 1]
    skin = {"joints": list(range(len(skeleton.names))), "skeleton": roots[0]}
    rows = inverse_bind.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
    skin["inverseBindMatrices"] = buffer_builder.add_accessor(rows)
    for number, (name, part) in enumerate(zip(names, parts, strict=True)):
        node: Tree = {"name": name, "mesh": number}
        if isinstance(part.source, RibbonPrimitive):
            bone = part.source.root_bone
            nodes[bone].setdefault("children", []).append(len(nodes))
            nodes.append(node | _node_transform(inverse_bind[bone]))
        else:
            mesh_roots.insert(0, len(nodes))
            nodes.append(node | {"skin": 0})
    return nodes, [*roots, *mesh_roots], [skin]


def _unique_names(names: Sequence[str], taken_names: Sequence[str]) -> list[str]:
    """Return names that differ from each other and from `taken_names`, by appended "_mesh" or numbers."""
    used, unique = {*taken_names}, list[str]()
    for name in names:
        candidates = [name, f"{name}_mesh", *(f"{name}_{number}" for number in range(2, len(names) + 2))]
        unique.append(next(one for one in candidates if one not in used))
        used.add(unique[-1])
    return unique


def _bone_nodes(skeleton: Skeleton) -> tuple[list[Tree], Doubles]:
    """Return the glTF nodes of b bones, and their inverse bind matrices (b, 4, 4); lengths are in metres."""
    to_file = np.diag([METRES_PER_MM] * 3 + [1.0]) @ skeleton.to_head
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
