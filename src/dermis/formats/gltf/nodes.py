"""Node hierarchy of a glTF file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.formats.gltf.document import Document, Tree, checked_index
from dermis.formats.size_limits import DAMAGED_ADVICE, MAX_NODE_DEPTH, MAX_NODES, check_limit
from dermis.mesh.rotations import quaternion_matrix


@dataclass(frozen=True)
class Nodes:
    """Node hierarchy of a file: n nodes with their transforms at rest.

    names : (n,) unique names
    parent : (n,) index of each node's parent, -1 for a root
    order : (n,) node indices, parents before children
    local : (n, 4, 4) transforms at rest from each node's space to the space of its parent
    world : (n, 4, 4) transforms at rest from each node's space to scene space
    scene_nodes : indices of the nodes of the scene, in the order in which meshes are read; None if the file
        has no scenes
    """

    names: tuple[str, ...]
    parent: tuple[int, ...]
    order: tuple[int, ...]
    local: Doubles
    world: Doubles
    scene_nodes: tuple[int, ...] | None

    def node_and_ancestors(self, node_index: int) -> list[int]:
        """Return the index of a node, followed by the indices of its ancestors up to the root."""
        path = [node_index]
        while self.parent[path[-1]] >= 0:
            path.append(self.parent[path[-1]])
        return path


def read_nodes(document: Document) -> Nodes:
    """Read the nodes of a file.

    Raises DermisError when the nodes form a cycle, are too many, or are nested too deeply.
    """
    nodes = document.top_level_array("nodes")
    check_limit(document.path, len(nodes), MAX_NODES, "nodes", "Export the head alone")
    names, parent = node_names(nodes), _node_parents(nodes)
    order = _order_parents_first(document, names, parent)
    local = np.array([_local_matrix(node) for node in nodes]).reshape(-1, 4, 4)
    world, depth = local.copy(), [0] * len(nodes)
    for index in order:
        if parent[index] >= 0:
            world[index] = world[parent[index]] @ local[index]
            depth[index] = depth[parent[index]] + 1
    deepest = max(depth, default=0)
    check_limit(document.path, deepest, MAX_NODE_DEPTH, "nodes below each other", "Export it again")
    return Nodes(names, parent, order, local, world, _scene_nodes(document, nodes))


def node_names(nodes: list[Tree]) -> tuple[str, ...]:
    """Return unique names of nodes: the names in the file, with a number appended to repeated names."""
    names: dict[str, None] = {}
    counts: dict[str, int] = {}
    for index, node in enumerate(nodes):
        name = stated = str(node.get("name") or f"node {index}")
        count = counts.get(stated, 2)
        while name in names:
            name, count = f"{stated} {count}", count + 1
        names[name], counts[stated] = None, count
    return tuple(names)


def _node_parents(nodes: list[Tree]) -> tuple[int, ...]:
    parent = [-1] * len(nodes)
    for index, node in enumerate(nodes):
        for child in node.get("children", []):
            checked_index(child, len(nodes), "nodes")
            if parent[child] < 0:
                parent[child] = index
    return tuple(parent)


def _order_parents_first(
    document: Document, names: tuple[str, ...], parent: tuple[int, ...]
) -> tuple[int, ...]:
    children: dict[int, list[int]] = {}
    for index, own_parent in enumerate(parent):
        children.setdefault(own_parent, []).append(index)
    order = list(children.get(-1, []))
    for index in order:
        order.extend(children.get(index, []))
    cyclic = sorted(set(range(len(parent))) - set(order))
    if cyclic:
        actual = f"{', '.join(repr(names[k]) for k in cyclic[:5])} are their own ancestors"
        refuse(document.path, "nodes that form a tree", actual, DAMAGED_ADVICE)
    return tuple(order)


def _scene_nodes(document: Document, nodes: list[Tree]) -> tuple[int, ...] | None:
    """Return the indices of the scene's nodes, parents before children; None for a file without scenes."""
    if "scenes" not in document.tree:
        return None
    pending = list(document.top_level_object("scenes", document.tree.get("scene", 0)).get("nodes", []))
    visited: dict[int, None] = {}
    while pending:
        index = checked_index(pending.pop(), len(nodes), "nodes")
        if index not in visited:
            visited[index] = None
            pending.extend(nodes[index].get("children", []))
    return tuple(visited)


def _local_matrix(node_tree: Tree) -> Doubles:
    """Return the matrix (4, 4) from a node's space to its parent's space."""
    matrix = np.eye(4)
    if "matrix" in node_tree:
        matrix = np.array(node_tree["matrix"], dtype=np.float64).reshape(4, 4).T
    if "translation" in node_tree:
        translation = np.eye(4)
        translation[:3, 3] = np.reshape(node_tree["translation"], 3)
        matrix = matrix @ translation
    if "rotation" in node_tree:
        matrix = matrix @ quaternion_matrix(np.reshape(np.asarray(node_tree["rotation"], np.float64), 4))
    if "scale" in node_tree:
        matrix = matrix @ np.diag([*np.reshape(node_tree["scale"], 3), 1.0])
    return np.asarray(matrix, dtype=np.float64)
