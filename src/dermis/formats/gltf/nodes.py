"""The tree of a glTF file's nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.formats.gltf.document import Document, Tree, checked_index
from dermis.formats.size_limits import MAX_NODE_DEPTH, MAX_NODES
from dermis.mesh.rotations import quaternion_matrix


@dataclass(frozen=True)
class Nodes:
    """All nodes of a file.

    names : (n,) each another one
    parent : (n,) -1 for a root
    order : (n,) parents before children
    local, world : (n, 4, 4) to the parent's space and to the scene's, at rest
    scene_nodes : those of the scene, in the order in which their meshes come; None for a file without scenes
    """

    names: tuple[str, ...]
    parent: tuple[int, ...]
    order: tuple[int, ...]
    local: Doubles
    world: Doubles
    scene_nodes: tuple[int, ...] | None

    def ancestors(self, node: int) -> list[int]:
        """The node, its parent and so on up to the root."""
        found = [node]
        while self.parent[found[-1]] >= 0:
            found.append(self.parent[found[-1]])
        return found


def read_nodes(document: Document) -> Nodes:
    """The file's nodes.

    Raises DermisError when they go round in a circle, or are too many or too deep.
    """
    nodes = document.items("nodes")
    if len(nodes) > MAX_NODES:
        actual = f"it has {len(nodes):,}"
        refuse(document.path, f"a scene of at most {MAX_NODES:,} nodes", actual, "Export the head alone")
    names, parent = node_names(nodes), _parents(nodes)
    order = _order(document, names, parent)
    local = np.array([_local_matrix(node) for node in nodes]).reshape(-1, 4, 4)
    world, depth = local.copy(), [0] * len(nodes)
    for index in order:
        if parent[index] >= 0:
            world[index] = world[parent[index]] @ local[index]
            depth[index] = depth[parent[index]] + 1
    if max(depth, default=0) > MAX_NODE_DEPTH:
        actual = f"it has {max(depth):,}"
        refuse(document.path, f"at most {MAX_NODE_DEPTH:,} nodes below each other", actual, "Export it again")
    return Nodes(names, parent, order, local, world, _scene_nodes(document, nodes))


def node_names(nodes: list[Tree]) -> tuple[str, ...]:
    """A name for each node: its own, with a number after it where another one has it already."""
    found: dict[str, None] = {}
    counts: dict[str, int] = {}
    for index, node in enumerate(nodes):
        name = own = str(node.get("name") or f"node {index}")
        count = counts.get(own, 2)
        while name in found:
            name, count = f"{own} {count}", count + 1
        found[name], counts[own] = None, count
    return tuple(found)


def _parents(nodes: list[Tree]) -> tuple[int, ...]:
    parent = [-1] * len(nodes)
    for index, node in enumerate(nodes):
        for child in node.get("children", []):
            checked_index(child, len(nodes), "nodes")
            if parent[child] < 0:
                parent[child] = index
    return tuple(parent)


def _order(document: Document, names: tuple[str, ...], parent: tuple[int, ...]) -> tuple[int, ...]:
    children: dict[int, list[int]] = {}
    for index, above in enumerate(parent):
        children.setdefault(above, []).append(index)
    order = list(children.get(-1, []))
    for index in order:
        order.extend(children.get(index, []))
    lost = sorted(set(range(len(parent))) - set(order))
    if lost:
        actual = f"{', '.join(repr(names[k]) for k in lost[:5])} are their own ancestors"
        refuse(document.path, "nodes that form a tree", actual, "The file is damaged: export it again")
    return tuple(order)


def _scene_nodes(document: Document, nodes: list[Tree]) -> tuple[int, ...] | None:
    """Nodes of the scene, the last child of each first."""
    if "scenes" not in document.tree:
        return None
    waiting = list(document.item("scenes", document.tree.get("scene", 0)).get("nodes", []))
    found: dict[int, None] = {}
    while waiting:
        index = checked_index(waiting.pop(), len(nodes), "nodes")
        if index not in found:
            found[index] = None
            waiting.extend(nodes[index].get("children", []))
    return tuple(found)


def _local_matrix(node: Tree) -> Doubles:
    """(4, 4) from a node's space to its parent's: its matrix, or translation, rotation and scale."""
    matrix = np.eye(4)
    if "matrix" in node:
        matrix = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    if "translation" in node:
        moved = np.eye(4)
        moved[:3, 3] = np.reshape(node["translation"], 3)
        matrix = matrix @ moved
    if "rotation" in node:
        matrix = matrix @ quaternion_matrix(np.reshape(np.asarray(node["rotation"], np.float64), 4))
    if "scale" in node:
        matrix = matrix @ np.diag([*np.reshape(node["scale"], 3), 1.0])
    return np.asarray(matrix, dtype=np.float64)
