"""A head written as one .glb file with all that moves it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.gltf.binary import CLAMPED, VERTICES, Binary, glb_bytes, placed
from dermis.mesh.gltf.moved_points import MovedPoints, Target
from dermis.mesh.gltf.textures import material_of, skin_pictures
from dermis.mesh.head import Head
from dermis.mesh.skeleton import Skeleton

Doubles = NDArray[np.float64]
Tree = dict[str, Any]

_M = 1e-3  # of a millimetre


def encode_head(
    head: Head,
    *,
    roughness: float,
    weights: Mapping[str, float] | None = None,
    slopes: NDArray[np.float32] | None = None,
    notes: Mapping[str, Any] | None = None,
) -> bytes:
    """The bytes of a .glb file: metres, a primitive for each material, morph targets, a skin of four bones.

    roughness : Beckmann's m of skin without a map of it [-]
    weights : of morph targets at rest, beside the head's own
    slopes : (n, n, 2) of the relief for programs that read no height map
    notes : what goes into the file's extras

    The same head gives the same bytes.
    """
    binary, points = Binary(), MovedPoints(head)
    pictures, roles = skin_pictures(head.maps, slopes)
    images = [
        {"bufferView": binary.view(data), "mimeType": "image/png", "name": name}
        for name, data in pictures.items()
    ]
    used = np.unique(head.mesh.material)
    places = {name: index for index, name in enumerate(pictures)}
    kinds = [material_of(head.mesh.materials[k], pictures, roles, roughness) for k in used]
    nodes, roots, skin = _nodes(head, binary)
    tree = {
        "asset": _asset(head, notes),
        "extensionsUsed": sorted({name for kind in kinds for name in kind.get("extensions", {})}),
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [_mesh(head, points, binary, used, weights or {})],
        "skins": skin,
        "materials": [placed(kind, places) for kind in kinds],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [CLAMPED] if images else [],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    return glb_bytes({key: value for key, value in tree.items() if value != []}, binary.data)


def _asset(head: Head, notes: Mapping[str, Any] | None) -> Tree:
    asset: Tree = {"version": "2.0", "generator": "dermis"}
    if head.attribution:
        asset["copyright"] = head.attribution
    return asset | ({"extras": dict(notes)} if notes else {})


def _mesh(
    head: Head, points: MovedPoints, binary: Binary, used: NDArray[Any], weights: Mapping[str, float]
) -> Tree:
    """A primitive for each material, each with the vertices that it uses."""
    faces = [np.flatnonzero(head.mesh.material == kind) for kind in used]
    vertices = [np.unique(head.mesh.triangles[those]) for those in faces]
    primitives: list[Tree] = []
    for number, (own, those) in enumerate(zip(vertices, faces, strict=True)):
        index = binary.triangles(np.searchsorted(own, head.mesh.triangles[those]), len(own))
        attributes = _attributes(head, points, binary, own)
        primitives.append({"attributes": attributes, "indices": index, "material": number})
        kept = {"quads": _halves_of_quads(head, those), "alone": _alone(head, those)}
        if any(kept.values()):
            primitives[-1]["extras"] = {"dermis": {key: True for key, value in kept.items() if value}}
    mesh: Tree = {"name": _name(head), "primitives": primitives}
    names, rest = points.rig.targets.names, points.rig.targets.rest
    if not names:
        return mesh
    for target in points.targets():
        for primitive, own in zip(primitives, vertices, strict=True):
            primitive.setdefault("targets", []).append(_target(binary, target, own))
    resting = {} if rest is None else dict(zip(names, rest.tolist(), strict=True))
    told = [float({**resting, **weights}.get(name, 0.0)) for name in names]
    return mesh | {"weights": told, "extras": {"targetNames": list(names)}}


def _attributes(head: Head, points: MovedPoints, binary: Binary, own: NDArray[Any]) -> dict[str, int]:
    """Accessors of some vertices."""
    found = {
        "POSITION": binary.array(_metres(points.positions_mm[own]), VERTICES, bounded=True),
        "NORMAL": binary.array(points.normals[own], VERTICES),
        "TEXCOORD_0": binary.array(head.mesh.uv[own], VERTICES),
    }
    if points.rig.skeleton is not None:
        bone, share = points.bones
        found["JOINTS_0"] = binary.array(bone[own], VERTICES)
        found["WEIGHTS_0"] = binary.array(share[own], VERTICES)
    return found


def _halves_of_quads(head: Head, faces: NDArray[Any]) -> bool:
    """Whether of some triangles each two are the halves of a quad."""
    other = np.full(len(head.mesh.triangles), -1)
    other[head.mesh.quads[:, 0]] = head.mesh.quads[:, 1]
    return len(faces) % 2 == 0 and bool((other[faces[::2]] == faces[1::2]).all())


def _alone(head: Head, faces: NDArray[Any]) -> bool:
    """Whether no other triangles have points of these."""
    others = np.delete(np.arange(len(head.mesh.triangles)), faces)
    own, foreign = (head.mesh.point[head.mesh.triangles[part]] for part in (faces, others))
    return len(others) > 0 and len(np.intersect1d(own, foreign)) == 0


def _target(binary: Binary, target: Target, own: NDArray[Any]) -> dict[str, int]:
    """Accessors of what a target does to some vertices."""
    here = np.flatnonzero(np.isin(target.vertex, own, assume_unique=True))
    row = np.searchsorted(own, target.vertex[here])
    columns = [_metres(target.delta_mm[here]), target.normal[here]]
    return dict(zip(("POSITION", "NORMAL"), binary.displacements(row, columns, len(own)), strict=True))


def _metres(places_mm: NDArray[np.float32]) -> NDArray[np.float32]:
    return (places_mm.astype(np.float64) * _M).astype(np.float32)


def _name(head: Head) -> str:
    """The head's name, apart from those of its bones."""
    name = Path(head.name).stem or "head"
    return f"{name} mesh" if name in head.bones else name


def _nodes(head: Head, binary: Binary) -> tuple[list[Tree], list[int], list[Tree]]:
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
    skin["inverseBindMatrices"] = binary.array(rows)
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
        node = {"name": name, **_placed(above @ skeleton.local[bone] @ shrunk)}
        nodes.append(node | ({"children": children} if children else {}))
    return nodes, np.asarray(grown @ skeleton.inverse_bind @ np.linalg.inv(to_file))


def _placed(matrix: Doubles) -> Tree:
    """A node's place: a translation where it is no more."""
    if np.abs(matrix[:3, :3] - np.eye(3)).max() < 1e-9:
        return {"translation": [float(x) for x in matrix[:3, 3]]}
    return {"matrix": [float(x) for x in matrix.T.ravel()]}
