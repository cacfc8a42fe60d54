"""Morph targets of a glTF file's meshes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from dermis.base.errors import refuse
from dermis.mesh.formats import Array, Index
from dermis.mesh.gltf.document import Document, Tree
from dermis.mesh.gltf.nodes import Nodes
from dermis.mesh.limits import MOST_TARGETS


class Displaced(NamedTuple):
    """Vertices that a target moves, and by how much at weight 1.

    vertex : (n,)
    delta : (n, 3)
    """

    vertex: Index
    delta: Array


def target_names(mesh: Tree) -> tuple[str, ...]:
    """Names of a mesh's targets, from its extras as nearly all programs write them, else "target N"."""
    counts = [len(primitive.get("targets", [])) for primitive in mesh["primitives"]]
    extras = mesh.get("extras")
    told = extras.get("targetNames") if isinstance(extras, dict) else None
    most = max(counts, default=0)
    if most > MOST_TARGETS:
        raise ValueError(f"a mesh has {most:,} morph targets, more than {MOST_TARGETS:,}")
    given = [str(name) for name in told[:most]] if isinstance(told, list) else []
    return tuple(given[k] if k < len(given) else f"target {k}" for k in range(most))


def read_targets(
    document: Document, mesh: Tree, names: tuple[str, ...], primitive: Tree, count: int
) -> dict[str, Displaced]:
    """Displacements of a primitive's vertices by name, in the mesh's space.

    names : of the mesh's targets
    count : of the primitive's vertices

    Raises DermisError for a target of another count, or with numbers that are none.
    """
    found: dict[str, Displaced] = {}
    for name, target in zip(names, primitive.get("targets", []), strict=False):
        if "POSITION" not in target:
            continue
        delta = document.real(target["POSITION"])
        if delta.shape != (count, 3):
            came = f"{name!r} of mesh {mesh.get('name', '')!r} moves {len(delta)}"
            refuse(document.path, f"targets of {count} vertices", came, "Export the file again")
        if not np.isfinite(delta).all():
            came = f"{name!r} of mesh {mesh.get('name', '')!r} has some that are NaN or infinite"
            refuse(document.path, "finite displacements", came, "The file is damaged: export it again")
        moved = np.flatnonzero(delta.any(axis=1))
        found[name] = Displaced(moved, delta[moved])
    return found


def resting_weights(document: Document, nodes: Nodes) -> dict[str, float]:
    """Weights that the scene's meshes have while nothing moves them, by name, where they are not 0.

    A node's weights go before its mesh's. Of a name in several meshes the first counts: it is one target.
    """
    found: dict[str, float] = {}
    names: dict[int, tuple[str, ...]] = {}
    for index in nodes.shown or ():
        node = document.all("nodes")[index]
        mesh: Tree = document.one("meshes", node["mesh"]) if "mesh" in node else {"primitives": []}
        weights: Any = node.get("weights", mesh.get("weights", []))
        if weights and id(mesh) not in names:
            names[id(mesh)] = target_names(mesh)
        for name, weight in zip(names[id(mesh)] if weights else (), weights, strict=False):
            found.setdefault(name, float(weight))
    if not np.isfinite(list(found.values())).all():
        refuse(document.path, "finite weights of targets", "some are not", "Export the file again")
    return {name: weight for name, weight in found.items() if weight}


def displaced(positions: Array, targets: Mapping[str, Displaced], weights: Mapping[str, float]) -> Array:
    """(v, 3) positions with targets at some weights."""
    moved = positions
    for name, target in targets.items():
        if weights.get(name):
            moved = moved.copy() if moved is positions else moved
            moved[target.vertex] += weights[name] * target.delta
    return moved
