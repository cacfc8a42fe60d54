"""Reading of morph targets, bones and skin weights from glTF files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.base.errors import refuse
from dermis.formats.gltf.document import Document, Tree, checked_index
from dermis.formats.gltf.nodes import Nodes, node_names
from dermis.formats.parts import Bones, to_floats
from dermis.formats.size_limits import (
    DAMAGED_ADVICE,
    MAX_BONES,
    MAX_BONES_PER_VERTEX,
    MAX_TARGETS,
    check_limit,
)
from dermis.mesh.rig import BONES_PER_POINT

_NODE_ANIMATION_PATHS = {"translation", "rotation", "scale"}
_STATIC_BONE_NAME = "scene"
_VERTICES_PER_BATCH = 1 << 16


class SkinInfluences(NamedTuple):
    """Bones that move each vertex, and their weights, which sum to 1.

    bone : (v, 4) bone indices
    weight : (v, 4) weights of these bones
    """

    bone: Index
    weight: Doubles


@dataclass(frozen=True)
class Armature:
    """Bones of a glTF scene: the joints that deform meshes, and animated nodes.

    bone_of_node : dictionary from node index to bone index
    static_bone : index of the additional root bone that carries the meshes that do not move; None if all
        meshes can move
    """

    bones: Bones
    bone_of_node: dict[int, int]
    static_bone: int | None

    def bone_for_node(self, nodes: Nodes, node_index: int) -> int | None:
        """Return the index of the bone that moves a rigid mesh, which has no joints of its own.

        It is the bone of the node that carries the mesh, or else of the nearest ancestor that has a bone. If
        no ancestor has a bone, the result is `static_bone`.

        node_index : index of the node that carries the mesh
        """
        bones = (self.bone_of_node[k] for k in nodes.node_and_ancestors(node_index) if k in self.bone_of_node)
        return next(bones, self.static_bone)


def read_armature(document: Document, nodes: Nodes) -> Armature | None:
    """Return the bones of a scene, or None if no mesh in the scene can move.

    Bones are the joints of glTF skins (which deform meshes), animated nodes that carry meshes, and the
    ancestors of both.
    """
    meshes = [k for k in nodes.scene_nodes or () if "mesh" in document.top_level_array("nodes")[k]]
    skinned = [k for k in meshes if "skin" in document.top_level_array("nodes")[k]]
    rigid = [k for k in meshes if k not in set(skinned)]
    joints = {joint for k in skinned for joint in _node_skin(document, k)["joints"]}
    mesh_ancestors = {node for k in rigid for node in nodes.node_and_ancestors(k)}
    moving = joints | (_animated_nodes(document) & mesh_ancestors)
    bone_nodes = {node for k in moving for node in nodes.node_and_ancestors(k)}
    if not bone_nodes:
        return None
    check_limit(document.path, len(bone_nodes), MAX_BONES, "bones", "Export it with fewer")
    has_static = any(bone_nodes.isdisjoint(nodes.node_and_ancestors(k)) for k in rigid)
    ordered = [k for k in nodes.order if k in bone_nodes]
    bone_of_node = {node: number + has_static for number, node in enumerate(ordered)}
    names = [nodes.names[k] for k in ordered]
    parent = [bone_of_node.get(nodes.parent[k], 0 if has_static else -1) for k in ordered]
    bones = Bones(tuple(names), np.array(parent, np.int32), nodes.local[ordered], nodes.world[ordered])
    if has_static:
        return Armature(_with_static_root(bones), bone_of_node, 0)
    return Armature(bones, bone_of_node, None)


def _with_static_root(bones: Bones) -> Bones:
    """Return the bones of a scene, preceded by a new root bone, which carries the meshes that do not move.

    The new bone has index 0 and lies at the origin.

    bones : bones of the scene, whose parent indices the caller has already adapted to the result: bone k of
        the scene becomes bone k + 1, and the parent of former roots is bone 0
    """
    name = node_names([{"name": known} for known in (*bones.names, _STATIC_BONE_NAME)])[-1]
    parent = np.concatenate([[-1], bones.parent]).astype(np.int32)
    local, world = (np.concatenate([np.eye(4)[None], one]) for one in (bones.local, bones.world))
    return Bones((name, *bones.names), parent, local, world)


def _animated_nodes(document: Document) -> set[int]:
    channels = [channel for clip in document.top_level_array("animations") for channel in clip["channels"]]
    targets = [channel["target"] for channel in channels]
    return {
        target["node"] for target in targets if target["path"] in _NODE_ANIMATION_PATHS and "node" in target
    }


def _node_skin(document: Document, node_index: int) -> Tree:
    skin = document.top_level_object("skins", document.top_level_array("nodes")[node_index]["skin"])
    joints = skin["joints"]
    check_limit(document.path, len(joints), MAX_BONES, "joints of a skin", "Export it with fewer")
    for joint in joints:
        checked_index(joint, len(document.top_level_array("nodes")), "nodes")
    return skin


def read_influences(
    document: Document, nodes: Nodes, armature: Armature, mesh_node_index: int, primitive: Tree
) -> tuple[SkinInfluences, Doubles]:
    """Return the bones and weights of a primitive, and the skinning matrix of each vertex at rest.

    The skinning matrices (v, 4, 4) map mesh space to scene space.

    armature : bones of the scene, to which the bone indices refer
    mesh_node_index : index of the node that carries the mesh and refers to its glTF skin (list of joints)
    primitive : JSON tree of the primitive

    Raises DermisError for invalid weights and joints.
    """
    skin, attributes = _node_skin(document, mesh_node_index), primitive["attributes"]
    count = max(1, sum(name.startswith("WEIGHTS_") for name in attributes))
    error_subject = f"{document.path}: {nodes.names[mesh_node_index]!r}"
    check_limit(error_subject, 4 * count, MAX_BONES_PER_VERTEX, "joints of a vertex", "Export it with fewer")
    sets = [k for k in range(count) if f"JOINTS_{k}" in attributes and f"WEIGHTS_{k}" in attributes]
    if not sets:
        actual = f"the mesh of {nodes.names[mesh_node_index]!r} has none"
        refuse(document.path, "joints and weights of a mesh with a skin", actual, DAMAGED_ADVICE)
    joint = np.hstack([document.read_values(attributes[f"JOINTS_{k}"]).astype(np.int64) for k in sets])
    weight = np.hstack([to_floats(document.read_values(attributes[f"WEIGHTS_{k}"])) for k in sets])
    _check_weights(document, nodes.names[mesh_node_index], joint, weight, len(skin["joints"]))
    joint, weight = _strongest_influences(joint, weight)
    inverse_bind = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
    if "inverseBindMatrices" in skin:
        inverse_bind = document.read_floats(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    resting = nodes.world[skin["joints"]] @ inverse_bind[: len(skin["joints"])]
    matrices = np.empty((len(joint), 4, 4))
    for start in range(0, len(joint), _VERTICES_PER_BATCH):
        batch = slice(start, start + _VERTICES_PER_BATCH)
        matrices[batch] = np.einsum("vk,vkij->vij", weight[batch], resting[joint[batch]])
    bone = np.array([armature.bone_of_node[k] for k in skin["joints"]])
    return SkinInfluences(bone[joint], weight), np.asarray(matrices)


def _check_weights(
    document: Document, node_name: str, joint: Index, weight: Doubles, joint_count: int
) -> None:
    if joint.shape != weight.shape:
        actual = f"{node_name!r} has {joint.shape} of joints and {weight.shape} of weights"
        refuse(document.path, "as many joints as weights", actual, DAMAGED_ADVICE)
    invalid = np.flatnonzero(~(np.isfinite(weight) & (weight >= 0)).all(axis=1))
    if len(invalid):
        actual = f"those of {node_name!r} are invalid at {len(invalid)} vertices, first {invalid[0]}"
        refuse(document.path, "skin weights of 0 and more", actual, DAMAGED_ADVICE)
    if joint[weight > 0].max(initial=0) >= joint_count:
        actual = f"{node_name!r} names joint {joint[weight > 0].max()}"
        refuse(document.path, f"joints of a skin from 0 to {joint_count - 1}", actual, DAMAGED_ADVICE)


def _strongest_influences(joint: Index, weight: Doubles) -> tuple[Index, Doubles]:
    """Return the joints with the four largest weights at each vertex, and these weights, (v, 4) each.

    The weights are normalised to sum to 1.
    """
    if weight.shape[1] > BONES_PER_POINT:
        order = np.argsort(-weight, axis=1, kind="stable")[:, :BONES_PER_POINT]
        joint, weight = np.take_along_axis(joint, order, axis=1), np.take_along_axis(weight, order, axis=1)
    total = weight.sum(axis=1, keepdims=True)
    first = np.eye(1, weight.shape[1])  # a vertex without weights follows its first joint
    weight = np.where(total > 0, weight / np.where(total > 0, total, 1), first)
    return np.where(weight > 0, joint, 0), weight


class VertexDisplacements(NamedTuple):
    """Vertices that a morph target displaces, and their displacements at weight 1.

    vertex : (n,) indices of the displaced vertices
    delta : (n, 3) displacements in the units of the file
    """

    vertex: Index
    delta: Doubles


def target_names(mesh: Tree) -> tuple[str, ...]:
    """Return the names of a mesh's morph targets.

    Most programs write the names as "targetNames" in the mesh's extras; targets without names are called
    "target 0", "target 1" and so on.
    """
    counts = [len(primitive.get("targets", [])) for primitive in mesh["primitives"]]
    extras = mesh.get("extras")
    listed = extras.get("targetNames") if isinstance(extras, dict) else None
    count = max(counts, default=0)
    if count > MAX_TARGETS:
        raise ValueError(f"a mesh has {count:,} morph targets, more than {MAX_TARGETS:,}")
    names = [str(name) for name in listed[:count]] if isinstance(listed, list) else []
    return tuple(names[k] if k < len(names) else f"target {k}" for k in range(count))


def read_targets(
    document: Document, mesh: Tree, all_target_names: tuple[str, ...], primitive: Tree, vertex_count: int
) -> dict[str, VertexDisplacements]:
    """Return the vertex displacements of a primitive by morph target name, in the mesh's space.

    mesh, primitive : JSON trees of the mesh and of one of its primitives
    all_target_names : names of the morph targets of the mesh
    vertex_count : number of vertices of the primitive

    Raises DermisError if the number of displacements is not `vertex_count`, or if values are not finite.
    """
    displacements: dict[str, VertexDisplacements] = {}
    for name, target in zip(all_target_names, primitive.get("targets", []), strict=False):
        if "POSITION" not in target:
            continue
        delta = document.read_floats(target["POSITION"])
        if delta.shape != (vertex_count, 3):
            actual = f"{name!r} of mesh {mesh.get('name', '')!r} moves {len(delta)}"
            refuse(document.path, f"targets of {vertex_count} vertices", actual, "Export the file again")
        if not np.isfinite(delta).all():
            actual = f"{name!r} of mesh {mesh.get('name', '')!r} has some that are NaN or infinite"
            refuse(document.path, "finite displacements", actual, DAMAGED_ADVICE)
        vertex = np.flatnonzero(delta.any(axis=1))
        displacements[name] = VertexDisplacements(vertex, delta[vertex])
    return displacements


def default_weights(document: Document, nodes: Nodes) -> dict[str, float]:
    """Return the default weights of the scene's morph targets by name; weights of 0 are omitted.

    Weights of a node override the weights of its mesh. Morph targets that have the same name in several
    meshes are treated as one target, with the weight that is found first.
    """
    defaults: dict[str, float] = {}
    names: dict[int, tuple[str, ...]] = {}
    for index in nodes.scene_nodes or ():
        node = document.top_level_array("nodes")[index]
        mesh: Tree = (
            document.top_level_object("meshes", node["mesh"]) if "mesh" in node else {"primitives": []}
        )
        weights = node.get("weights", mesh.get("weights", []))
        if weights and id(mesh) not in names:
            names[id(mesh)] = target_names(mesh)
        for name, weight in zip(names[id(mesh)] if weights else (), weights or (), strict=False):
            defaults.setdefault(name, float(weight))
    if not np.isfinite(list(defaults.values())).all():
        refuse(document.path, "finite weights of targets", "some are not", "Export the file again")
    return {name: weight for name, weight in defaults.items() if weight}


def apply_targets(
    positions: Doubles, targets: Mapping[str, VertexDisplacements], weights: Mapping[str, float]
) -> Doubles:
    """Return positions (v, 3) displaced by morph targets.

    targets : displacements of the morph targets at weight 1, by target name
    weights : weights by target name; missing weights are 0
    """
    result = positions
    for name, target in targets.items():
        if weights.get(name):
            result = result.copy() if result is positions else result
            result[target.vertex] += weights[name] * target.delta
    return result
