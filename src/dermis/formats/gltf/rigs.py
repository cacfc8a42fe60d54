"""Morph targets and bones of a glTF file, and the bones that each vertex follows."""

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
from dermis.formats.size_limits import MAX_BONES, MAX_INFLUENCES, MAX_TARGETS
from dermis.mesh.rig import INFLUENCES

_NODE_PATHS = {"translation", "rotation", "scale"}
_STATIC_BONE_NAME = "scene"
_BATCH = 1 << 16  # vertices
_DAMAGED = "The file is damaged: export it again"


class SkinInfluences(NamedTuple):
    """Bones that vertices follow, each by a share; the shares of a vertex add up to 1.

    bone, weight : (v, 4)
    """

    bone: Index
    weight: Doubles


@dataclass(frozen=True)
class Armature:
    """The bones of a file's scene.

    bone_of_node : number of a node's bone, for nodes that are bones
    static_bone : the bone that meshes without any follow; it has all others under it
    """

    bones: Bones
    bone_of_node: dict[int, int]
    static_bone: int | None

    def bone_for_node(self, nodes: Nodes, node: int) -> int | None:
        """The bone that a mesh without skin follows: its own node or the nearest above."""
        return next(
            (self.bone_of_node[one] for one in nodes.ancestors(node) if one in self.bone_of_node),
            self.static_bone,
        )


def read_armature(document: Document, nodes: Nodes) -> Armature | None:
    """Joints, and nodes that an animation moves with meshes below them, with all above; None for none."""
    meshes = [k for k in nodes.scene_nodes or () if "mesh" in document.items("nodes")[k]]
    skinned = [k for k in meshes if "skin" in document.items("nodes")[k]]
    rigid = [k for k in meshes if k not in set(skinned)]
    joints = {joint for k in skinned for joint in _skin(document, k)["joints"]}
    below = {one for k in rigid for one in nodes.ancestors(k)}
    moving = joints | (_animated(document) & below)
    chosen = {one for k in moving for one in nodes.ancestors(k)}
    if not chosen:
        return None
    if len(chosen) > MAX_BONES:
        actual = f"it has {len(chosen):,}"
        refuse(document.path, f"at most {MAX_BONES:,} bones", actual, "Export it with fewer")
    still = any(chosen.isdisjoint(nodes.ancestors(k)) for k in rigid)
    kept = [k for k in nodes.order if k in chosen]
    of_node = {node: number + still for number, node in enumerate(kept)}
    names = [nodes.names[k] for k in kept]
    parent = [of_node.get(nodes.parent[k], 0 if still else -1) for k in kept]
    bones = Bones(tuple(names), np.array(parent, np.int32), nodes.local[kept], nodes.world[kept])
    return Armature(_with_static_root(bones) if still else bones, of_node, 0 if still else None)


def _with_static_root(bones: Bones) -> Bones:
    """The bones under one that rests at the origin."""
    name = node_names([{"name": one} for one in (*bones.names, _STATIC_BONE_NAME)])[-1]
    parent = np.concatenate([[-1], bones.parent]).astype(np.int32)
    local, world = (np.concatenate([np.eye(4)[None], one]) for one in (bones.local, bones.world))
    return Bones((name, *bones.names), parent, local, world)


def _animated(document: Document) -> set[int]:
    channels = [channel for clip in document.items("animations") for channel in clip["channels"]]
    targets = [channel["target"] for channel in channels]
    return {target["node"] for target in targets if target["path"] in _NODE_PATHS and "node" in target}


def _skin(document: Document, node: int) -> Tree:
    skin = document.item("skins", document.items("nodes")[node]["skin"])
    joints = skin["joints"]
    if len(joints) > MAX_BONES:
        actual = f"it has {len(joints):,}"
        refuse(document.path, f"a skin of at most {MAX_BONES:,} joints", actual, "Export it with fewer")
    for joint in joints:
        checked_index(joint, len(document.items("nodes")), "nodes")
    return skin


def read_influences(
    document: Document, nodes: Nodes, armature: Armature, node: int, primitive: Tree
) -> tuple[SkinInfluences, Doubles]:
    """What the vertices of a skinned primitive follow, and where that takes each at rest, (v, 4, 4).

    Raises DermisError for weights that are none and joints that there are not.
    """
    skin, given = _skin(document, node), primitive["attributes"]
    count = max(1, sum(name.startswith("WEIGHTS_") for name in given))
    if 4 * count > MAX_INFLUENCES:
        actual, advice = f"{nodes.names[node]!r} has {count} sets of four", "Export it with fewer"
        refuse(document.path, f"at most {MAX_INFLUENCES} joints of a vertex", actual, advice)
    names = [k for k in range(count) if f"JOINTS_{k}" in given and f"WEIGHTS_{k}" in given]
    if not names:
        actual = f"the mesh of {nodes.names[node]!r} has none"
        refuse(document.path, "joints and weights of each vertex of a mesh with a skin", actual, _DAMAGED)
    joint = np.hstack([document.read_values(given[f"JOINTS_{k}"]).astype(np.int64) for k in names])
    weight = np.hstack([to_floats(document.read_values(given[f"WEIGHTS_{k}"])) for k in names])
    _check_weights(document, nodes.names[node], joint, weight, len(skin["joints"]))
    joint, weight = _strongest_influences(joint, weight)
    bound = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
    if "inverseBindMatrices" in skin:
        bound = document.read_floats(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    resting = nodes.world[skin["joints"]] @ bound[: len(skin["joints"])]
    placed = np.empty((len(joint), 4, 4))
    for start in range(0, len(joint), _BATCH):
        some = slice(start, start + _BATCH)
        placed[some] = np.einsum("vk,vkij->vij", weight[some], resting[joint[some]])
    bone = np.array([armature.bone_of_node[k] for k in skin["joints"]])
    return SkinInfluences(bone[joint], weight), np.asarray(placed)


def _check_weights(document: Document, name: str, joint: Index, weight: Doubles, count: int) -> None:
    if joint.shape != weight.shape:
        actual = f"{name!r} has {joint.shape} of joints and {weight.shape} of weights"
        refuse(document.path, "as many joints as weights", actual, _DAMAGED)
    lost = np.flatnonzero(~(np.isfinite(weight) & (weight >= 0)).all(axis=1))
    if len(lost):
        actual = f"those of {name!r} are negative, NaN or infinite at {len(lost)} vertices, first {lost[0]}"
        refuse(document.path, "skin weights of 0 and more", actual, _DAMAGED)
    if joint[weight > 0].max(initial=0) >= count:
        actual = f"{name!r} names joint {joint[weight > 0].max()}"
        refuse(document.path, f"joints of a skin from 0 to {count - 1}", actual, _DAMAGED)


def _strongest_influences(joint: Index, weight: Doubles) -> tuple[Index, Doubles]:
    """(v, 4) the four largest weights of each vertex, adding up to 1, and their joints."""
    if weight.shape[1] > INFLUENCES:
        order = np.argsort(-weight, axis=1, kind="stable")[:, :INFLUENCES]
        joint, weight = np.take_along_axis(joint, order, axis=1), np.take_along_axis(weight, order, axis=1)
    total = weight.sum(axis=1, keepdims=True)
    first = np.eye(1, weight.shape[1])  # a vertex without any follows its first joint
    weight = np.where(total > 0, weight / np.where(total > 0, total, 1), first)
    return np.where(weight > 0, joint, 0), weight


class VertexDisplacements(NamedTuple):
    """Vertices that a target moves, and by how much at weight 1.

    vertex : (n,)
    delta : (n, 3)
    """

    vertex: Index
    delta: Doubles


def target_names(mesh: Tree) -> tuple[str, ...]:
    """Names of a mesh's targets, from its extras as nearly all programs write them, else "target N"."""
    counts = [len(primitive.get("targets", [])) for primitive in mesh["primitives"]]
    extras = mesh.get("extras")
    told = extras.get("targetNames") if isinstance(extras, dict) else None
    most = max(counts, default=0)
    if most > MAX_TARGETS:
        raise ValueError(f"a mesh has {most:,} morph targets, more than {MAX_TARGETS:,}")
    given = [str(name) for name in told[:most]] if isinstance(told, list) else []
    return tuple(given[k] if k < len(given) else f"target {k}" for k in range(most))


def read_targets(
    document: Document, mesh: Tree, names: tuple[str, ...], primitive: Tree, count: int
) -> dict[str, VertexDisplacements]:
    """Displacements of a primitive's vertices by name, in the mesh's space.

    names : of the mesh's targets
    count : of the primitive's vertices

    Raises DermisError for a target of another count, or with numbers that are none.
    """
    found: dict[str, VertexDisplacements] = {}
    for name, target in zip(names, primitive.get("targets", []), strict=False):
        if "POSITION" not in target:
            continue
        delta = document.read_floats(target["POSITION"])
        if delta.shape != (count, 3):
            actual = f"{name!r} of mesh {mesh.get('name', '')!r} moves {len(delta)}"
            refuse(document.path, f"targets of {count} vertices", actual, "Export the file again")
        if not np.isfinite(delta).all():
            actual = f"{name!r} of mesh {mesh.get('name', '')!r} has some that are NaN or infinite"
            refuse(document.path, "finite displacements", actual, "The file is damaged: export it again")
        moved = np.flatnonzero(delta.any(axis=1))
        found[name] = VertexDisplacements(moved, delta[moved])
    return found


def default_weights(document: Document, nodes: Nodes) -> dict[str, float]:
    """Weights that the scene's meshes have while nothing moves them, by name, where they are not 0.

    A node's weights go before its mesh's. Of a name in several meshes the first counts: it is one target.
    """
    found: dict[str, float] = {}
    names: dict[int, tuple[str, ...]] = {}
    for index in nodes.scene_nodes or ():
        node = document.items("nodes")[index]
        mesh: Tree = document.item("meshes", node["mesh"]) if "mesh" in node else {"primitives": []}
        weights = node.get("weights", mesh.get("weights", []))
        if weights and id(mesh) not in names:
            names[id(mesh)] = target_names(mesh)
        for name, weight in zip(names[id(mesh)] if weights else (), weights or (), strict=False):
            found.setdefault(name, float(weight))
    if not np.isfinite(list(found.values())).all():
        refuse(document.path, "finite weights of targets", "some are not", "Export the file again")
    return {name: weight for name, weight in found.items() if weight}


def apply_targets(
    positions: Doubles, targets: Mapping[str, VertexDisplacements], weights: Mapping[str, float]
) -> Doubles:
    """(v, 3) positions with targets at some weights."""
    moved = positions
    for name, target in targets.items():
        if weights.get(name):
            moved = moved.copy() if moved is positions else moved
            moved[target.vertex] += weights[name] * target.delta
    return moved
