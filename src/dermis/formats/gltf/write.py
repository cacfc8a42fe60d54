"""A head written as one .glb file with all that moves it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.binary import CLAMPED_SAMPLER, BufferBuilder, glb_bytes, resolve_textures
from dermis.formats.gltf.document import FrozenTree, Tree
from dermis.formats.gltf.materials import (
    SkinAdditions,
    colours_png,
    eye_material,
    eye_pictures,
    hair_material,
    skin_pictures,
    surface_material,
)
from dermis.formats.gltf.primitives import FibreTubes, HairPrimitive, PrimitiveSource, SurfacePrimitive
from dermis.mesh.eyeball import EyePictures
from dermis.mesh.head import Head
from dermis.mesh.skeleton import Skeleton

BROWS, HAIR = "brows and lashes", "hair"
"""Names of the materials of hairs, and of their pictures."""
_KNOTS = {BROWS: 5, HAIR: 4}
_MAX_HAIRS = 16_000  # fewer stand for all, wider
_M = 1e-3  # of a millimetre


def encode_head(
    head: Head,
    *,
    roughness: float,
    weights: Mapping[str, float] | None = None,
    slopes: Floats | None = None,
    notes: FrozenTree | None = None,
    eyes: EyePictures | None = None,
    added: SkinAdditions | None = None,
) -> bytes:
    """The bytes of a .glb file: metres, a primitive for each material, morph targets, a skin of four bones.

    Hairs are thin tubes, of which this package reads none back.

    roughness : Beckmann's m of skin without a map of it [-]
    weights : of morph targets at rest, beside the head's own
    slopes : (n, n, 2) of the relief for programs that read no height map
    notes : what goes into the file's extras
    eyes : what its eyes look like; of one colour where None
    added : to the materials of skin

    The same head gives the same bytes.
    """
    binary, points = BufferBuilder(), DeformableMesh(head)
    pictures, roles = skin_pictures(head.maps, slopes)
    pictures |= {} if added is None else added.pictures
    parts, kinds = _parts(points, pictures, roles, roughness, eyes)
    if added is not None:
        kinds = [added.applied_to(kind) if "dermis" in kind.get("extras", {}) else kind for kind in kinds]
    images = [
        {"bufferView": binary.add_view(data), "mimeType": "image/png", "name": name}
        for name, data in pictures.items()
    ]
    places = {name: index for index, name in enumerate(pictures)}
    nodes, roots, bound = _nodes(head, binary)
    tree = {
        "asset": _asset(head, notes),
        "extensionsUsed": sorted({name for kind in kinds for name in kind.get("extensions", {})}),
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [_mesh(points, binary, parts, weights or {})],
        "skins": bound,
        "materials": [resolve_textures(kind, places) for kind in kinds],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [CLAMPED_SAMPLER] if images else [],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    return glb_bytes({key: value for key, value in tree.items() if value != []}, binary.data)


def _parts(
    points: DeformableMesh,
    pictures: dict[str, bytes],
    roles: FrozenTree,
    roughness: float,
    eyes: EyePictures | None,
) -> tuple[list[PrimitiveSource], list[Tree]]:
    """What becomes primitives, and the material of each; adds the pictures of eyes and hairs."""
    head = points.head
    painted = [] if eyes is None or head.eyes is None else head.eyes.material.tolist()
    if eyes is not None and painted:
        pictures |= eye_pictures(eyes)
    parts, kinds = list[PrimitiveSource](), list[Tree]()
    for kind in np.unique(head.mesh.material).tolist():
        eye = painted.index(kind) if kind in painted else -1
        parts.append(SurfacePrimitive(points, np.flatnonzero(head.mesh.material == kind), eye))
        one = head.mesh.materials[kind]
        kinds.append(surface_material(one, pictures, roles, roughness) if eye < 0 else eye_material(one))
    for name, strands in ((BROWS, head.strands), (HAIR, head.hair)):
        if strands is not None and len(strands):
            fibres = FibreTubes.from_strands(strands, head.mesh, _MAX_HAIRS, _KNOTS[name])
            parts.append(HairPrimitive(points, fibres))
            kinds.append(hair_material(name))
            pictures[name] = colours_png(fibres.colours()[0])
    return parts, kinds


def _asset(head: Head, notes: FrozenTree | None) -> Tree:
    asset: Tree = {"version": "2.0", "generator": "dermis"}
    if head.attribution:
        asset["copyright"] = head.attribution
    return asset | ({"extras": dict(notes)} if notes else {})


def _mesh(
    points: DeformableMesh, binary: BufferBuilder, parts: list[PrimitiveSource], weights: Mapping[str, float]
) -> Tree:
    """A primitive for each part; its material has the same number."""
    primitives = [part.primitive(binary) | {"material": number} for number, part in enumerate(parts)]
    mesh: Tree = {"name": _name(points.head), "primitives": primitives}
    names, rest = points.rig.targets.names, points.rig.targets.rest
    if not names:
        return mesh
    for target in points.targets():
        for primitive, part in zip(primitives, parts, strict=True):
            primitive.setdefault("targets", []).append(part.target(binary, target))
    resting = {} if rest is None else dict(zip(names, rest.tolist(), strict=True))
    told = [float({**resting, **weights}.get(name, 0.0)) for name in names]
    return mesh | {"weights": told, "extras": {"targetNames": list(names)}}


def _name(head: Head) -> str:
    """The head's name, apart from those of its bones."""
    name = Path(head.name).stem or "head"
    return f"{name} mesh" if name in head.bones else name


def _nodes(head: Head, binary: BufferBuilder) -> tuple[list[Tree], list[int], list[Tree]]:
    """All nodes, those at the top, and the skin; bones first, the mesh last."""
    skeleton = head.control.skeleton
    if skeleton is None:
        return [{"name": _name(head), "mesh": 0}], [0], []
    nodes, bound = _bones(skeleton)
    tops = np.flatnonzero(skeleton.parent < 0).tolist()
    if len(tops) > 1:  # a skin's joints have one node above them
        nodes.append({"name": f"{_name(head)} bones", "children": tops})
        tops = [len(nodes) - 1]
    skin = {"joints": list(range(len(skeleton.names))), "skeleton": tops[0]}
    rows = bound.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
    skin["inverseBindMatrices"] = binary.add_accessor(rows)
    nodes.append({"name": _name(head), "mesh": 0, "skin": 0})
    return nodes, [*tops, len(nodes) - 1], [skin]


def _bones(skeleton: Skeleton) -> tuple[list[Tree], Doubles]:
    """Nodes in metres, and (b, 4, 4) from the file's space to each bone's, where its points are bound."""
    to_file = np.diag([_M, _M, _M, 1.0]) @ skeleton.to_head
    size = float(np.cbrt(abs(np.linalg.det(to_file[:3, :3]))))
    grown, shrunk = (np.diag([one, one, one, 1.0]) for one in (size, 1.0 / size))
    nodes: list[Tree] = []
    for bone, (name, parent) in enumerate(zip(skeleton.names, skeleton.parent.tolist(), strict=True)):
        above = to_file if parent < 0 else grown
        children = np.flatnonzero(skeleton.parent == bone).tolist()
        node = {"name": name, **_node_transform(above @ skeleton.local[bone] @ shrunk)}
        nodes.append(node | ({"children": children} if children else {}))
    return nodes, np.asarray(grown @ skeleton.inverse_bind @ np.linalg.inv(to_file))


def _node_transform(matrix: Doubles) -> Tree:
    """A node's place: a translation where it is no more."""
    if np.abs(matrix[:3, :3] - np.eye(3)).max() < 1e-9:
        return {"translation": [float(x) for x in matrix[:3, 3]]}
    return {"matrix": [float(x) for x in matrix.T.ravel()]}
