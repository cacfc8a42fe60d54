"""VRM avatars: the direction in which they face, their expressions, and notes on ignored data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dermis.base.file_properties import drawn_property, noted_property, property_without_effect
from dermis.formats.axes import DEFAULT_AXES, Axes
from dermis.formats.gltf.document import Document, Tree
from dermis.formats.gltf.rigs import VertexDisplacements
from dermis.formats.size_limits import MAX_DISPLACEMENTS, MAX_TARGETS, check_limit
from dermis.formats.text_files import join_names

VRM_0, VRM_1 = "VRM", "VRMC_vrm"
"""Extensions of VRM 0.x, whose avatars look along -Z, and of VRM 1.0, whose avatars look along +Z."""
_TOON_EXTENSION = "VRMC_materials_mtoon"
_UNREAD_PROPERTIES = {
    "springs of hair and cloth": ("secondaryAnimation", "VRMC_springBone"),
    "constraints of bones": ("VRMC_node_constraint",),
    "visibility in first person": ("firstPerson",),
}
VRM_PROPERTIES = (
    drawn_property(
        f"`{VRM_0}` (0.x)",
        "the face looks along -Z and is turned to the viewer, unless `--front` is given",
        VRM_0,
    ),
    property_without_effect(f"`{VRM_1}` (1.0)", "the face looks along +Z, as in other files", VRM_1),
    drawn_property(
        "expressions: presets and custom ones",
        "morph targets beside those of the file (`happy`, `aa`, `blink`, in VRM 0 `joy`, `a`); "
        "a target of the file keeps its name",
    ),
    noted_property("changes of materials by expressions"),
    noted_property(
        f"MToon (`{_TOON_EXTENSION}`, in VRM 0 `VRM/MToon`)", "only the base colour is drawn", _TOON_EXTENSION
    ),
    *(noted_property(text, "", *keys) for text, keys in _UNREAD_PROPERTIES.items()),
)
"""Properties of VRM files in addition to those of glTF."""
_MATERIAL_BIND_KEYS = ("materialValues", "materialColorBinds", "textureTransformBinds")
_CUSTOM_PRESET_NAMES = ("", "unknown")  # values of presetName for expressions that have a name of their own
_FRACTION_PER_PERCENT = 0.01
_MAX_TARGET_WEIGHT = 100.0


@dataclass(frozen=True)
class Avatar:
    """Properties that a VRM file adds to glTF; the defaults describe glTF files without VRM.

    expressions : weights of the morph targets of expressions, in three nested dictionaries. The keys are the
        Python `id` of a mesh's JSON tree, the name of the expression, and the index of the morph target
    """

    axes: Axes = DEFAULT_AXES
    expressions: Mapping[int, Mapping[str, Mapping[int, float]]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def with_expressions(
        self, mesh: Tree, target_names: Sequence[str], targets: dict[str, VertexDisplacements]
    ) -> dict[str, VertexDisplacements]:
        """Return the morph targets of a primitive, with the expressions added as further morph targets.

        mesh : JSON tree of the mesh that contains the primitive
        target_names : names of the morph targets of the mesh
        targets : morph targets of the primitive, by name

        Expressions that have the same name as a morph target are omitted.

        Raises ValueError if the expressions displace too many vertices.
        """
        combined, displaced = dict[str, VertexDisplacements](), 0
        for name, weights in self.expressions.get(id(mesh), {}).items():
            bound = {target_names[k]: weight for k, weight in weights.items() if 0 <= k < len(target_names)}
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
    is_vrm_0 = VRM_0 in extensions and VRM_1 not in extensions
    avatar: Tree | None = extensions.get(VRM_0 if is_vrm_0 else VRM_1)
    if avatar is None:
        return Avatar()
    expressions: dict[int, dict[str, dict[int, float]]] = {}
    names = set()
    for name, mesh, target, weight in (_vrm_0_binds if is_vrm_0 else _vrm_1_binds)(document, avatar):
        expressions.setdefault(id(mesh), {}).setdefault(name, {})[target] = weight
        names.add(name)
        check_limit(document.path, len(names), MAX_TARGETS, "expressions", "Export it with fewer")
    axes = Axes(front="-z" if is_vrm_0 else "z")
    return Avatar(axes, expressions, tuple(_avatar_notes(extensions, avatar, is_vrm_0)))


class _TargetBind(NamedTuple):
    """Morph target that an expression moves.

    name : name of the expression
    mesh : JSON tree of the mesh with the morph target
    target : index of the morph target in the mesh
    weight : weight that the expression gives the morph target
    """

    name: str
    mesh: Tree
    target: int
    weight: float


def _vrm_0_binds(document: Document, vrm_extension: Tree) -> Iterator[_TargetBind]:
    """Yield the morph targets of all expressions in a VRM 0.x file; weights are converted from percent.

    vrm_extension : VRM extension of the file
    """
    for group in _expression_groups(vrm_extension):
        preset = str(group.get("presetName", "")).casefold()
        name = str(group.get("name", "")) if preset in _CUSTOM_PRESET_NAMES else preset
        for bind in group.get("binds") or () if name else ():
            mesh = document.top_level_object("meshes", bind["mesh"])
            yield _TargetBind(name, mesh, int(bind["index"]), _FRACTION_PER_PERCENT * _bind_weight(bind))


def _vrm_1_binds(document: Document, vrm_extension: Tree) -> Iterator[_TargetBind]:
    """Yield the morph targets of all expressions in a VRM 1.0 file.

    vrm_extension : VRM extension of the file
    """
    for name, expression in _expression_trees(vrm_extension).items():
        for bind in expression.get("morphTargetBinds") or ():
            node = document.top_level_object("nodes", bind["node"])
            if "mesh" in node:
                mesh = document.top_level_object("meshes", node["mesh"])
                yield _TargetBind(name, mesh, int(bind["index"]), _bind_weight(bind))


def _bind_weight(bind: Tree) -> float:
    weight = float(bind["weight"])
    if not abs(weight) <= _MAX_TARGET_WEIGHT:
        raise ValueError(f"the weight of an expression is {weight:g}")
    return weight


def _expression_groups(vrm_extension: Tree) -> list[Tree]:
    groups: list[Tree] = (vrm_extension.get("blendShapeMaster") or {}).get("blendShapeGroups") or []
    return groups


def _expression_trees(vrm_extension: Tree) -> Tree:
    expressions: Tree = vrm_extension.get("expressions") or {}
    return {**(expressions.get("preset") or {}), **(expressions.get("custom") or {})}


def _avatar_notes(extensions: Tree, vrm_extension: Tree, is_vrm_0: bool) -> Iterator[str]:
    expressions = (
        _expression_groups(vrm_extension) if is_vrm_0 else list(_expression_trees(vrm_extension).values())
    )
    if any(one.get(key) for one in expressions for key in _MATERIAL_BIND_KEYS):
        yield "changes of materials by expressions are left out"
    present = {*vrm_extension, *extensions}
    not_read = [text for text, keys in _UNREAD_PROPERTIES.items() if present.intersection(keys)]
    if not_read:
        yield f"these properties of the avatar are left out: {', '.join(not_read)}"
    materials = vrm_extension.get("materialProperties") or ()
    toon = [str(one.get("name")) for one in materials if "MToon" in str(one.get("shader"))]
    if toon:
        yield f"cartoon shading (shade colour, outline, rim light) is not drawn: {join_names(toon)}"


def _sum_displacements(
    weighted_displacements: Sequence[tuple[VertexDisplacements, float]],
) -> VertexDisplacements:
    """Return the weighted sum of the displacements of several morph targets."""
    vertex, row = np.unique(
        np.concatenate([own.vertex for own, _ in weighted_displacements]), return_inverse=True
    )
    delta = np.zeros((len(vertex), 3))
    np.add.at(delta, row, np.concatenate([weight * own.delta for own, weight in weighted_displacements]))
    return VertexDisplacements(vertex, delta)
