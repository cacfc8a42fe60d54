"""Triangles of the scene of a glTF file, with what moves them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.formats.gltf.document import Document, Tree, read_document
from dermis.formats.gltf.nodes import Nodes, read_nodes
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
from dermis.formats.parts import GREY, MaterialGroup, MeshFile, MeshPart, find_quads, parse_colour, to_floats
from dermis.formats.size_limits import MAX_DISPLACEMENTS, MAX_GROUPS, MAX_TRIANGLES, MAX_VERTICES

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MAX_COUNTS = {
    "primitives": MAX_GROUPS,
    "triangles": MAX_TRIANGLES,
    "vertices": MAX_VERTICES,
    "displacements by targets": MAX_DISPLACEMENTS,
}
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization")


def read_gltf(path: Path) -> MeshFile:
    """The scene of a .glb or .gltf file as it rests: joints at their nodes, targets at their default weights.

    A mesh with a skin lies where its joints take it, whatever its own node says.
    """
    document = read_document(path)
    _refuse_extensions(document)
    nodes = read_nodes(document)
    armature, weights = read_armature(document, nodes), default_weights(document, nodes)
    parts = list(_Reader(document, nodes, armature, weights).parts())
    return MeshFile(parts, armature.bones if armature else None, weights)


def _refuse_extensions(document: Document) -> None:
    """Refuse geometry in an encoding that would be read wrongly."""
    foreign = [name for name in document.items("extensionsRequired") if not str(name).startswith(_HARMLESS)]
    if foreign:
        actual = f"the file requires {', '.join(map(str, foreign))}"
        refuse(document.path, "plain glTF geometry", actual, "Export without compression")


@dataclass
class _Reader:
    """Reads one part after the other."""

    document: Document
    nodes: Nodes
    armature: Armature | None
    weights: dict[str, float]

    def parts(self) -> Iterator[MeshPart]:
        counts = {"primitives": 0, "triangles": 0, "vertices": 0, "displacements by targets": 0}
        for part in self._all():
            moved = sum(len(vertex) for vertex, _ in part.targets.values())
            for name, count in zip(counts, (1, len(part.triangles), len(part.positions), moved), strict=True):
                counts[name] += count
                self._check_most(name, counts[name])
            yield part

    def _check_most(self, name: str, count: int) -> None:
        """Refuse a scene before all of it is built; instances count as often as they are shown."""
        if count > _MAX_COUNTS[name]:
            actual, advice = "it has more", "Export the head alone, or decimated"
            refuse(self.document.path, f"a scene of at most {_MAX_COUNTS[name]:,} {name}", actual, advice)

    def _all(self) -> Iterator[MeshPart]:
        nodes, shown = self.document.items("nodes"), self.nodes.scene_nodes or ()
        meshes = [k for k in shown if "mesh" in nodes[k]]
        for node in meshes:
            yield from self._mesh(self.document.item("meshes", nodes[node]["mesh"]), node)
        if not meshes:  # a file of meshes alone
            for mesh in self.document.items("meshes"):
                yield from self._mesh(mesh, None)

    def _mesh(self, mesh: Tree, node: int | None) -> Iterator[MeshPart]:
        names = target_names(mesh)
        for primitive in mesh["primitives"]:
            drawn = primitive.get("mode", _TRIANGLES) in (_TRIANGLES, _STRIP, _FAN)
            if drawn and _own_extras(primitive).get("hair") is not True:
                yield self._part(mesh, names, primitive, node)

    def _part(self, mesh: Tree, names: tuple[str, ...], primitive: Tree, node: int | None) -> MeshPart:
        """A primitive where its node, or the joints of its skin, take it."""
        part, targets = self._unplaced(mesh, names, primitive)
        if node is None:
            return _transformed(part, targets, np.eye(4))
        if "skin" in self.document.tree["nodes"][node] and self.armature:
            followed, resting = read_influences(self.document, self.nodes, self.armature, node, primitive)
            return _skin_part(part, targets, followed, resting)
        placed = _transformed(part, targets, _nearest_rigid(self.nodes.world[node]))
        bone = self.armature.bone_for_node(self.nodes, node) if self.armature else None
        if bone is None:
            return placed
        count = len(part.positions)
        return replace(placed, bone=np.full((count, 1), bone), weight=np.ones((count, 1)))

    def _unplaced(
        self, mesh: Tree, names: tuple[str, ...], primitive: Tree
    ) -> tuple[MeshPart, dict[str, VertexDisplacements]]:
        """A primitive in its mesh's space, with targets at their default weights, and all its targets."""
        given = primitive["attributes"]
        self._check_most("vertices", self.document.item("accessors", given["POSITION"])["count"])
        positions = self.document.read_floats(given["POSITION"]).reshape(-1, 3)
        uv, normals = (
            to_floats(self.document.read_values(given[name])) if name in given else None
            for name in ("TEXCOORD_0", "NORMAL")
        )
        targets = read_targets(self.document, mesh, names, primitive, len(positions))
        moved = apply_targets(positions, targets, self.weights)
        if moved is not positions:
            normals = None  # they belong to another shape
        triangles = self._triangles(primitive, len(positions))
        own = _own_extras(primitive)
        sides = np.full(len(triangles) // 2 if own.get("quads") is True else 0, 4)
        return MeshPart(
            self._group(mesh, primitive),
            moved,
            uv,
            normals,
            triangles,
            quads=find_quads(sides, triangles),
            alone=own.get("alone") is True,
        ), targets

    def _triangles(self, primitive: Tree, count: int) -> Index:
        """(f, 3) the corners of a primitive's triangles."""
        index = np.arange(count)
        if "indices" in primitive:
            corners = self.document.item("accessors", primitive["indices"])["count"]
            self._check_most("triangles", corners // 3)
            index = self.document.read_values(primitive["indices"]).ravel().astype(np.int64)
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _TRIANGLES:
            return index.reshape(-1, 3)
        if mode == _FAN:
            return np.column_stack((index[1:-1], index[2:], np.full(max(len(index) - 2, 0), index[0])))
        strip = np.column_stack((index[:-2], index[1:-1], index[2:]))
        strip[1::2] = strip[1::2, ::-1]
        return strip

    def _group(self, mesh: Tree, primitive: Tree) -> MaterialGroup:
        item = self.document.item
        material: Tree = item("materials", primitive["material"]) if "material" in primitive else {}
        names = tuple(str(thing["name"]) for thing in (material, mesh) if thing.get("name"))
        factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor")
        return MaterialGroup(names, parse_colour(factor) if factor else GREY)


def _own_extras(primitive: Tree) -> Tree:
    """What this package wrote beside a primitive."""
    extras = primitive.get("extras")
    told = extras.get("dermis") if isinstance(extras, dict) else None
    return told if isinstance(told, dict) else {}


def _transformed(part: MeshPart, targets: dict[str, VertexDisplacements], matrix: Doubles) -> MeshPart:
    """A part moved by `matrix` (4, 4); a mirror turns its triangles round."""
    linear = matrix[:3, :3]
    return replace(
        part,
        positions=part.positions @ linear.T + matrix[:3, 3],
        normals=None if part.normals is None else part.normals @ _normal_matrix(linear).T,
        triangles=part.triangles[:, ::-1] if np.linalg.det(linear) < 0 else part.triangles,
        targets={name: (one.vertex, one.delta @ linear.T) for name, one in targets.items()},
    )


def _nearest_rigid(matrix: Doubles) -> Doubles:
    """The nearest rigid matrix where it misses one by rounding alone, as with scales of 1.0000001."""
    missed = np.abs(matrix[:3, :3] @ matrix[:3, :3].T - np.eye(3)).max()
    if not 1e-13 < missed < 1e-5:
        return matrix
    left, _, right = np.linalg.svd(matrix[:3, :3])
    rigid = matrix.copy()
    rigid[:3, :3] = left @ right
    return rigid


def _skin_part(
    part: MeshPart, targets: dict[str, VertexDisplacements], followed: SkinInfluences, matrices: Doubles
) -> MeshPart:
    """A part of which each vertex is moved by its own one of `matrices` (v, 4, 4)."""
    if len(followed.bone) != len(part.positions):
        raise ValueError(f"{len(part.positions)} vertices have {len(followed.bone)} joints")
    linear = matrices[:, :3, :3]
    mirrored = np.linalg.det(linear) < 0
    return replace(
        part,
        positions=np.einsum("vij,vj->vi", linear, part.positions) + matrices[:, :3, 3],
        normals=None
        if part.normals is None
        else np.einsum("vij,vj->vi", _normal_matrix(linear), part.normals),
        triangles=part.triangles[:, ::-1] if mirrored.mean() > 0.5 else part.triangles,
        targets={
            name: (one.vertex, np.einsum("vij,vj->vi", linear[one.vertex], one.delta))
            for name, one in targets.items()
        },
        bone=followed.bone,
        weight=followed.weight,
    )


def _normal_matrix(linear: Doubles) -> Doubles:
    """(..., 3, 3) that turns normals as `linear` turns the surface: they keep their length.

    Normals turn with the cofactors, for flat transforms too.
    """
    rows = [linear[..., k, :] for k in range(3)]
    cofactors = np.stack([np.cross(rows[(i + 1) % 3], rows[(i + 2) % 3]) for i in range(3)], axis=-2)
    determinant = np.asarray(np.linalg.det(linear))
    mirror = np.where(determinant < 0, -1.0, 1.0)
    size = np.where(determinant == 0, 1.0, np.abs(determinant) ** (2 / 3))
    return np.asarray((mirror / size)[..., None, None] * cofactors)
