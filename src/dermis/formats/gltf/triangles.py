"""Reading of the triangles of a glTF scene, with morph targets and skin weights."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Index
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
from dermis.formats import size_limits as limits
from dermis.formats.gltf import draco, vrm
from dermis.formats.gltf.document import Document, Tree, read_document
from dermis.formats.gltf.nodes import Nodes, read_nodes
from dermis.formats.gltf.read_materials import MATERIAL_EXTENSIONS, read_materials
from dermis.formats.gltf.rigs import (
    Armature,
    SkinInfluences,
    VertexDisplacements,
    apply_targets,
    default_weights,
    read_armature,
    read_influences,
    read_targets,
    target_names,
)
from dermis.formats.gltf.unread import LIGHTS_EXTENSION, note_unread
from dermis.formats.materials import FileMaterial
from dermis.formats.parts import DEFAULT_COLOUR, MaterialGroup, MeshFile, MeshPart, find_quads
from dermis.formats.text_files import join_names

_TRIANGLES_MODE, _STRIP_MODE, _FAN_MODE = 4, 5, 6
_MAX_SCENE_COUNTS = {
    "primitives": limits.MAX_GROUPS,
    "triangles": limits.MAX_TRIANGLES,
    "vertices": limits.MAX_VERTICES,
    "displacements by targets": limits.MAX_DISPLACEMENTS,
}
_MESHOPT_EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
_QUANTISATION_EXTENSION = "KHR_mesh_quantization"
GLTF_PROPERTIES = (
    drawn_property("triangles, strips, fans"),
    noted_property("points and lines"),
    drawn_property("`indices`, `NORMAL`, `TEXCOORD_0`, `TEXCOORD_1`, ...", "missing normals are computed"),
    drawn_property("`COLOR_0`", "linear; multiplies the base colour"),
    noted_property("alpha of `COLOR_0`", "no note if it is 1"),
    drawn_property(
        f"sparse accessors, normalised integers, `{_QUANTISATION_EXTENSION}`", "", _QUANTISATION_EXTENSION
    ),
    drawn_property(
        f"`{draco.DRACO_EXTENSION}`",
        "with the extra `formats` ([DracoPy](https://github.com/seung-lab/DracoPy)): positions, "
        "normals, uv, colours, joints and weights; refused if the data does not have the size that its "
        "accessors state",
        draco.DRACO_EXTENSION,
    ),
    refused_property(
        f"{markdown_code(_MESHOPT_EXTENSIONS)}, if required",
        "its Python package has no wheels; write the file without it: `gltfpack` without `-c` and `-cc`, or "
        "`gltf-transform copy`",
    ),
    refused_property("other extensions that are required", "the error names them"),
    noted_property("other extensions that are used but not required"),
    drawn_property("transforms of nodes"),
    drawn_property("morph targets, default weights, skins", "they move the head, see [motion](motion.md)"),
    drawn_property("animations", "by `--motion`, see [motion](motion.md)"),
    noted_property(
        f"`{LIGHTS_EXTENSION}`, cameras", "`--lights` and `--camera` set others", LIGHTS_EXTENSION
    ),
    noted_property("several scenes", "the default scene is read"),
    refused_property("buffers without data", "such as the fallback of a compressed one"),
    drawn_property_with_note(
        "names of materials and meshes, such as `Face_00_SKIN`, `Hair_00_HAIR`, `Tops_01_CLOTH`",
        "used to find [which parts are skin](#materials-and-parts)",
    ),
    property_without_effect("`asset`, `extras`, other names", "information for programs and people"),
)
"""Properties of glTF files besides their materials."""
_READ_EXTENSIONS = {*MATERIAL_EXTENSIONS, *keys_of((*GLTF_PROPERTIES, *vrm.VRM_PROPERTIES))}
_COMPRESSION_ADVICE = (
    "Export without this compression: gltfpack without -c and -cc, or gltf-transform copy IN.glb OUT.glb"
)
_EXTENSION_ADVICE = dict.fromkeys(_MESHOPT_EXTENSIONS, _COMPRESSION_ADVICE)
_OTHER_EXTENSION_ADVICE = "Export without it"


def read_gltf(path: Path) -> MeshFile:
    """Read the scene of a .glb or .gltf file in its rest pose.

    Joints have the transforms of their nodes; morph targets have their default weights. A mesh with joints
    is transformed by them alone; the transform of its node has no effect.
    """
    document = read_document(path)
    _refuse_extensions(document)
    draco.decompress(document)
    nodes, avatar = read_nodes(document), vrm.read_avatar(document)
    armature, weights = read_armature(document, nodes), default_weights(document, nodes)
    materials = read_materials(document)
    reader = _SceneReader(document, nodes, armature, weights, materials, avatar)
    parts, bones = list(reader.read_parts()), armature.bones if armature else None
    notes = (*note_unread(document, nodes, _READ_EXTENSIONS), *avatar.notes, *reader.notes)
    return MeshFile(parts, bones, weights, materials, notes, axes=avatar.axes)


def _refuse_extensions(document: Document) -> None:
    """Refuse a file that requires unsupported extensions, such as compressed geometry."""
    required = map(str, document.top_level_array("extensionsRequired"))
    unsupported = [name for name in required if name not in _READ_EXTENSIONS]
    if unsupported:
        advice = next(
            (_EXTENSION_ADVICE[name] for name in unsupported if name in _EXTENSION_ADVICE),
            _OTHER_EXTENSION_ADVICE,
        )
        refuse(document.path, "plain glTF", f"the file requires {join_names(unsupported)}", advice)


@dataclass
class _SceneReader:
    """Reader of the primitives of a glTF scene as mesh parts.

    weights : default weights of morph targets by name
    notes : dictionary whose keys are notes to the user on content that was not read
    """

    document: Document
    nodes: Nodes
    armature: Armature | None
    weights: dict[str, float]
    materials: tuple[FileMaterial, ...]
    avatar: vrm.Avatar
    notes: dict[str, None] = field(default_factory=dict)

    def read_parts(self) -> Iterator[MeshPart]:
        """Yield each triangle primitive of the scene as a mesh part; check the scene's total size."""
        counts = dict.fromkeys(_MAX_SCENE_COUNTS, 0)
        for part in self._all_parts():
            displaced = sum(len(vertex) for vertex, _ in part.targets.values())
            added = 1, len(part.triangles), len(part.positions), displaced
            for name, count in zip(counts, added, strict=True):
                counts[name] += count
                self._check_scene_count(name, counts[name])
            yield part

    def _check_scene_count(self, item_noun: str, count: int) -> None:
        """Refuse a scene with more than the allowed number of parts, triangles, vertices or displacements.

        item_noun : plural name of the counted items, a key of `_MAX_SCENE_COUNTS`
        count : number of the counted items in the scene
        """
        advice = "Export the head alone, or decimated"
        limits.check_limit(self.document.path, count, _MAX_SCENE_COUNTS[item_noun], item_noun, advice)

    def _all_parts(self) -> Iterator[MeshPart]:
        nodes, scene_nodes = self.document.top_level_array("nodes"), self.nodes.scene_nodes or ()
        meshes = [k for k in scene_nodes if "mesh" in nodes[k]]
        for node in meshes:
            yield from self._mesh_parts(self.document.top_level_object("meshes", nodes[node]["mesh"]), node)
        if not meshes:  # a file with meshes but without nodes
            for mesh in self.document.top_level_array("meshes"):
                yield from self._mesh_parts(mesh, None)

    def _mesh_parts(self, mesh: Tree, node_index: int | None) -> Iterator[MeshPart]:
        names = target_names(mesh)
        for primitive in mesh["primitives"]:
            has_triangles = primitive.get("mode", _TRIANGLES_MODE) in (
                _TRIANGLES_MODE,
                _STRIP_MODE,
                _FAN_MODE,
            )
            if has_triangles and _dermis_extras(primitive).get("hair") is not True:
                yield self._scene_part(mesh, names, primitive, node_index)

    def _scene_part(
        self, mesh: Tree, target_names: tuple[str, ...], primitive: Tree, node_index: int | None
    ) -> MeshPart:
        """Return a primitive as a mesh part in scene space, transformed by its node or by its joints.

        mesh, primitive : JSON trees of the mesh and of one of its primitives
        target_names : names of the morph targets of the mesh
        node_index : index of the node that carries the mesh; None in a file whose meshes have no nodes
        """
        part, targets = self._read_primitive(mesh, target_names, primitive)
        if node_index is None:
            return _transform_part(part, targets, np.eye(4))
        if "skin" in self.document.tree["nodes"][node_index] and self.armature:
            influences, matrices = read_influences(
                self.document, self.nodes, self.armature, node_index, primitive
            )
            return _apply_skinning(part, targets, influences, matrices)
        transformed = _transform_part(part, targets, _nearest_rigid_transform(self.nodes.world[node_index]))
        bone = self.armature.bone_for_node(self.nodes, node_index) if self.armature else None
        if bone is None:
            return transformed
        count = len(part.positions)
        return replace(transformed, bone=np.full((count, 1), bone), weight=np.ones((count, 1)))

    def _read_primitive(
        self, mesh: Tree, target_names: tuple[str, ...], primitive: Tree
    ) -> tuple[MeshPart, dict[str, VertexDisplacements]]:
        """Return a primitive in mesh space, with the default weights applied, and its morph targets."""
        attributes = primitive["attributes"]
        self._check_scene_count(
            "vertices", self.document.top_level_object("accessors", attributes["POSITION"])["count"]
        )
        positions = self.document.read_floats(attributes["POSITION"]).reshape(-1, 3)
        group = self._material_group(mesh, primitive)
        uv, normals, colours = (
            self.document.read_floats(attributes[name]) if name in attributes else None
            for name in ("TEXCOORD_0", "NORMAL", "COLOR_0")
        )
        targets = read_targets(self.document, mesh, target_names, primitive, len(positions))
        targets = self.avatar.with_expressions(mesh, target_names, targets)
        displaced = apply_targets(positions, targets, self.weights)
        if displaced is not positions:
            normals = None  # the normals of the file belong to the undisplaced shape
        if colours is not None and colours.shape[1] > 3 and colours[:, 3].min() < 1.0:
            self.notes["the transparency of vertices (alpha of COLOR_0) is left out"] = None
        triangles = self._read_triangles(primitive, len(positions))
        extras = _dermis_extras(primitive)
        corner_counts = np.full(len(triangles) // 2 if extras.get("quads") is True else 0, 4)
        return MeshPart(
            group,
            displaced,
            uv,
            normals,
            triangles,
            quads=find_quads(corner_counts, triangles),
            separate=extras.get("alone") is True,
            colours=None if colours is None else np.clip(colours[:, :3], 0.0, 1.0),
            other_uv=self._read_other_uv(group, attributes, len(positions)),
        ), targets

    def _read_other_uv(
        self, material_group: MaterialGroup, attributes: Tree, vertex_count: int
    ) -> dict[int, Doubles]:
        """Return the additional uv sets (vertex_count, 2) that a material's textures use, by set index."""
        material = self.materials[material_group.material] if material_group.material >= 0 else FileMaterial()
        found = {}
        for index in sorted({texture.uv_set for texture in material.textures.values()} - {0}):
            if f"TEXCOORD_{index}" not in attributes:
                actual = f"material {material.name!r} uses uv set {index}, which its mesh does not have"
                refuse(self.document.path, "uv for each texture", actual, limits.DAMAGED_ADVICE)
            found[index] = self.document.read_floats(attributes[f"TEXCOORD_{index}"]).reshape(vertex_count, 2)
        return found

    def _read_triangles(self, primitive: Tree, vertex_count: int) -> Index:
        """Return the vertex indices of a primitive's triangles, (f, 3); strips and fans are expanded.

        vertex_count : number of vertices of the primitive
        """
        index = np.arange(vertex_count)
        if "indices" in primitive:
            corners = self.document.top_level_object("accessors", primitive["indices"])["count"]
            self._check_scene_count("triangles", corners // 3)
            index = self.document.read_values(primitive["indices"]).ravel().astype(np.int64)
        mode = primitive.get("mode", _TRIANGLES_MODE)
        if mode == _TRIANGLES_MODE:
            return index.reshape(-1, 3)
        if mode == _FAN_MODE:
            return np.column_stack((index[1:-1], index[2:], np.full(max(len(index) - 2, 0), index[0])))
        strip = np.column_stack((index[:-2], index[1:-1], index[2:]))
        strip[1::2] = strip[1::2, ::-1]
        return strip

    def _material_group(self, mesh: Tree, primitive: Tree) -> MaterialGroup:
        material: Tree = {}
        if "material" in primitive:
            material = self.document.top_level_object("materials", primitive["material"])
        index = primitive.get("material", -1)
        names = tuple(str(item["name"]) for item in (material, mesh) if item.get("name"))
        colour = self.materials[index].colour if index >= 0 else None
        return MaterialGroup(names, colour or DEFAULT_COLOUR, index)


def _dermis_extras(primitive: Tree) -> Tree:
    """Return the "dermis" entry of a primitive's extras, which this package writes; {} in other files."""
    extras = primitive.get("extras")
    own = extras.get("dermis") if isinstance(extras, dict) else None
    return own if isinstance(own, dict) else {}


def _transform_part(
    mesh_part: MeshPart, targets: dict[str, VertexDisplacements], matrix: Doubles
) -> MeshPart:
    """Return a mesh part and its morph targets transformed by `matrix` (4, 4).

    Reflections reverse the vertex order of triangles, so that triangles still face outwards.
    """
    linear = matrix[:3, :3]
    return replace(
        mesh_part,
        positions=mesh_part.positions @ linear.T + matrix[:3, 3],
        normals=None if mesh_part.normals is None else mesh_part.normals @ _normal_matrix(linear).T,
        triangles=mesh_part.triangles[:, ::-1] if np.linalg.det(linear) < 0 else mesh_part.triangles,
        targets={name: (own.vertex, own.delta @ linear.T) for name, own in targets.items()},
    )


def _nearest_rigid_transform(matrix: Doubles) -> Doubles:
    """Return the rigid transform that a matrix (4, 4) approximates up to rounding errors.

    Matrices that are not nearly rigid are returned unchanged. Rounding errors are common, as exporters write
    scales like 1.0000001.
    """
    deviation = np.abs(matrix[:3, :3] @ matrix[:3, :3].T - np.eye(3)).max()
    if not 1e-13 < deviation < 1e-5:
        return matrix
    left, _, right = np.linalg.svd(matrix[:3, :3])
    rigid = matrix.copy()
    rigid[:3, :3] = left @ right
    return rigid


def _apply_skinning(
    mesh_part: MeshPart,
    targets: dict[str, VertexDisplacements],
    influences: SkinInfluences,
    skinning_matrices: Doubles,
) -> MeshPart:
    """Return a mesh part and its morph targets with each vertex transformed by its skinning matrix.

    targets : morph targets of the part by name
    influences : bones and weights of each vertex; they become `bone` and `weight` of the returned part
    skinning_matrices : (v, 4, 4) skinning matrix of each vertex in the rest pose
    """
    if len(influences.bone) != len(mesh_part.positions):
        raise ValueError(f"{len(mesh_part.positions)} vertices have {len(influences.bone)} joints")
    linear = skinning_matrices[:, :3, :3]
    mirrored = np.linalg.det(linear) < 0
    return replace(
        mesh_part,
        positions=np.einsum("vij,vj->vi", linear, mesh_part.positions) + skinning_matrices[:, :3, 3],
        normals=None
        if mesh_part.normals is None
        else np.einsum("vij,vj->vi", _normal_matrix(linear), mesh_part.normals),
        triangles=mesh_part.triangles[:, ::-1] if mirrored.mean() > 0.5 else mesh_part.triangles,
        targets={
            name: (own.vertex, np.einsum("vij,vj->vi", linear[own.vertex], own.delta))
            for name, own in targets.items()
        },
        bone=influences.bone,
        weight=influences.weight,
    )


def _normal_matrix(linear_transform: Doubles) -> Doubles:
    """Return the matrices (..., 3, 3) that transform normals for linear transforms (..., 3, 3).

    The matrices are scaled so that a uniform scale preserves the length of normals. They consist of cofactors
    instead of inverses, because cofactors also exist for singular transforms.
    """
    rows = [linear_transform[..., k, :] for k in range(3)]
    cofactors = np.stack([np.cross(rows[(i + 1) % 3], rows[(i + 2) % 3]) for i in range(3)], axis=-2)
    determinant = np.asarray(np.linalg.det(linear_transform))
    sign = np.where(determinant < 0, -1.0, 1.0)
    scale = np.where(determinant == 0, 1.0, np.abs(determinant) ** (2 / 3))
    return np.asarray((sign / scale)[..., None, None] * cofactors)
