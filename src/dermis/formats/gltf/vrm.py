"""VRM avatars: the direction of their face, their expressions, and properties that are not read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dermis.base.file_properties import drawn, no_effect, noted
from dermis.formats.axes import DEFAULT_AXES, Axes
from dermis.formats.gltf.document import Document, Tree
from dermis.formats.gltf.rigs import VertexDisplacements
from dermis.formats.size_limits import MAX_DISPLACEMENTS, MAX_TARGETS, check_limit
from dermis.formats.text_files import listed

OLD, NEW = "VRM", "VRMC_vrm"
"""Extensions of VRM 0.x, whose avatars look along -Z, and of VRM 1.0, whose avatars look along +Z."""
_TOON = "VRMC_materials_mtoon"
_NOT_READ = {
    "springs of hair and cloth": ("secondaryAnimation", "VRMC_springBone"),
    "constraints of bones": ("VRMC_node_constraint",),
    "visibility in first person": ("firstPerson",),
}
VRM_PROPERTIES = (
    drawn(
        f"`{OLD}` (0.x)",
        "the face looks along -Z and is turned to the viewer, unless `--front` is given",
        OLD,
    ),
    no_effect(f"`{NEW}` (1.0)", "the face looks along +Z, as in other files", NEW),
    drawn(
        "expressions: presets and custom ones",
        "morph targets beside those of the file (`happy`, `aa`, `blink`, in VRM 0 `joy`, `a`); "
        "a target of the file keeps its name",
    ),
    noted("changes of materials by expressions"),
    noted(f"MToon (`{_TOON}`, in VRM 0 `VRM/MToon`)", "only the base colour is drawn", _TOON),
    *(noted(text, "", *keys) for text, keys in _NOT_READ.items()),
)
"""Properties of VRM files in addition to those of glTF."""
_MATERIAL_BINDS = ("materialValues", "materialColorBinds", "textureTransformBinds")
_UNNAMED = ("", "unknown")
_PERCENT = 0.01
_MAX_WEIGHT = 100.0


@dataclass(frozen=True)
class Avatar:
    """Properties that a VRM file adds to glTF; the defaults are for other glTF files.

    expressions : for each mesh (by `id`) and expression (by name), the weights by morph target index
    """

    axes: Axes = DEFAULT_AXES
    expressions: Mapping[int, Mapping[str, Mapping[int, float]]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def with_expressions(
        self, mesh: Tree, names: Sequence[str], targets: dict[str, VertexDisplacements]
    ) -> dict[str, VertexDisplacements]:
        """Return the morph targets of a primitive and its expressions; targets keep their names.

        names : names of the morph targets of the mesh
        targets : targets of the primitive, by name

        Raises ValueError if the expressions displace too many vertices.
        """
        combined, displaced = dict[str, VertexDisplacements](), 0
        for name, weights in self.expressions.get(id(mesh), {}).items():
            bound = {names[k]: weight for k, weight in weights.items() if 0 <= k < len(names)}
            sources = [(targets[own], weight) for own, weight in bound.items() if own in targets]
            displaced += sum(len(own.vertex) for own, _ in sources)
            if displaced > MAX_DISPLACEMENTS:
                raise ValueError(f"its expressions displace more than {MAX_DISPLACEMENTS:,} vertices")
            if sources and name not in targets:
                combined[name] = _sum_displacements(sources)
        return targets | combined


def read_avatar(document: Document) -> Avatar:
    """Return the VRM properties of a file."""
    extensions: Tree = document.tree.get("extensions") or {}
    old = OLD in extensions and NEW not in extensions
    version: Tree | None = extensions.get(OLD if old else NEW)
    if version is None:
        return Avatar()
    expressions: dict[int, dict[str, dict[int, float]]] = {}
    names = set()
    for name, mesh, target, weight in (_old_binds if old else _new_binds)(document, version):
        expressions.setdefault(id(mesh), {}).setdefault(name, {})[target] = weight
        names.add(name)
        check_limit(document.path, len(names), MAX_TARGETS, "expressions", "Export it with fewer")
    axes = Axes(front="-z" if old else "z")
    return Avatar(axes, expressions, tuple(_notes(extensions, version, old)))


class _Bind(NamedTuple):
    """Morph target that an expression moves.

    name : name of the expression
    target : index of the target in the mesh
    """

    name: str
    mesh: Tree
    target: int
    weight: float


def _old_binds(document: Document, version: Tree) -> Iterator[_Bind]:
    """Yield the binds of VRM 0.x, whose weights are percentages."""
    for group in _groups(version):
        preset = str(group.get("presetName", "")).casefold()
        name = str(group.get("name", "")) if preset in _UNNAMED else preset
        for bind in group.get("binds") or () if name else ():
            mesh = document.item("meshes", bind["mesh"])
            yield _Bind(name, mesh, int(bind["index"]), _PERCENT * _weight(bind))


def _new_binds(document: Document, version: Tree) -> Iterator[_Bind]:
    """Yield the binds of VRM 1.0."""
    for name, expression in _expressions(version).items():
        for bind in expression.get("morphTargetBinds") or ():
            node = document.item("nodes", bind["node"])
            if "mesh" in node:
                mesh = document.item("meshes", node["mesh"])
                yield _Bind(name, mesh, int(bind["index"]), _weight(bind))


def _weight(bind: Tree) -> float:
    weight = float(bind["weight"])
    if not abs(weight) <= _MAX_WEIGHT:
        raise ValueError(f"the weight of an expression is {weight:g}")
    return weight


def _groups(version: Tree) -> list[Tree]:
    groups: list[Tree] = (version.get("blendShapeMaster") or {}).get("blendShapeGroups") or []
    return groups


def _expressions(version: Tree) -> Tree:
    expressions: Tree = version.get("expressions") or {}
    return {**(expressions.get("preset") or {}), **(expressions.get("custom") or {})}


def _notes(extensions: Tree, version: Tree, is_vrm0: bool) -> Iterator[str]:
    expressions = _groups(version) if is_vrm0 else list(_expressions(version).values())
    if any(one.get(key) for one in expressions for key in _MATERIAL_BINDS):
        yield "changes of materials by expressions are left out"
    present = {*version, *extensions}
    not_read = [text for text, keys in _NOT_READ.items() if present.intersection(keys)]
    if not_read:
        yield f"these properties of the avatar are left out: {', '.join(not_read)}"
    materials = version.get("materialProperties") or ()
    toon = [str(one.get("name")) for one in materials if "MToon" in str(one.get("shader"))]
    if toon:
        yield f"cartoon shading (shade colour, outline, rim light) is not drawn: {listed(toon)}"


def _sum_displacements(sources: Sequence[tuple[VertexDisplacements, float]]) -> VertexDisplacements:
    """Return the weighted sum of displacements."""
    vertex, row = np.unique(np.concatenate([own.vertex for own, _ in sources]), return_inverse=True)
    delta = np.zeros((len(vertex), 3))
    np.add.at(delta, row, np.concatenate([weight * own.delta for own, weight in sources]))
    return VertexDisplacements(vertex, delta)
