"""A small glTF head with openings for eyes and a ball behind each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gltf_file import GltfFile, add_mesh
from numpy.typing import NDArray

from dermis.mesh.eyeball import build_eyeball
from dermis.mesh.geometry import split_quads
from dermis.mesh.primitives import uv_sphere

Floats = NDArray[np.float64]

HALF_MM = np.array([78.0, 115.0, 92.0])
"""Half axes of the head."""
EYE_MM = np.array([31.0, 12.0, 68.0])
"""Middle of the left eyeball; the right one mirrors it."""
OPENING_MM = np.array([12.0, 6.0])
"""Half the width and half the height of what lids leave open."""
MIRROR = np.array([-1.0, 1.0, 1.0])


def ball(radius_mm: float = 12.0, stretch: float = 1.0) -> tuple[Floats, NDArray[np.int32]]:
    """Return a plain ball."""
    mesh = uv_sphere(radius_mm, 24, 16)
    return mesh.positions * np.array([1.0, stretch, 1.0]), mesh.triangles


def ball_with_cornea(radius_mm: float, axis: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return an eyeball that looks along an axis (3,)."""
    points, quads = build_eyeball(16)
    across = np.cross((0.0, 1.0, 0.0), axis)
    across /= np.linalg.norm(across)
    size = radius_mm / -points[:, 2].min()
    return size * points @ np.stack([across, np.cross(axis, across), axis]), split_quads(quads)


def skin() -> tuple[Floats, NDArray[np.int32]]:
    """Return an ellipsoid with two openings."""
    mesh = uv_sphere(1.0, 112, 112)
    places = mesh.positions * HALF_MM
    middle = places[mesh.triangles].mean(axis=1)
    aside = np.stack([np.abs(middle[:, 0]) - EYE_MM[0], middle[:, 1] - EYE_MM[1]], axis=1) / OPENING_MM
    kept = (np.linalg.norm(aside, axis=1) > 1) | (middle[:, 2] < 0)
    return places, mesh.triangles[kept]


def write_head(
    path: Path,
    left: Any = None,
    right: Any = None,
    *,
    names: tuple[str, str] = ("eye_L", "eye_R"),
    targets: dict[str, Floats] | None = None,
    joints: tuple[str, ...] = (),
) -> Path:
    """Write the head in millimetres.

    left, right : (points around the centre, triangles); plain balls if omitted
    targets : displacements of the left ball's points by name
    joints : names of joints of the head and of each ball
    """
    file, nodes, made = GltfFile(), list[int](), {}
    parts = [("skin", *skin())]
    for name, part, side in zip(names, (left, right), (np.ones(3), MIRROR), strict=True):
        points, triangles = part or ball()
        parts.append((name, points + EYE_MM * side, triangles))
    bones = [file.add("nodes", name=name) for name in joints]
    if bones:
        file.tree["nodes"][bones[0]]["children"] = bones[1:]
        for bone, side in zip(bones[1:], (np.ones(3), MIRROR), strict=True):
            file.tree["nodes"][bone]["translation"] = (EYE_MM * side).tolist()
        file.add("skins", joints=bones, inverseBindMatrices=file.numbers(_inverse(len(bones))))
    for k, (name, points, triangles) in enumerate(parts):
        if bones:
            joint = np.zeros((len(points), 4))
            joint[:, 0] = k
            weight = np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1))
            made = {"JOINTS_0": file.numbers(joint, "<u1"), "WEIGHTS_0": file.numbers(weight)}
        moved = {one: file.numbers(delta) for one, delta in (targets or {}).items()} if k == 1 else None
        mesh = add_mesh(file, points, triangles, moved, made, name=name)
        nodes.append(file.add("nodes", mesh=mesh, **({"skin": 0} if bones else {})))
    return file.write(path, *nodes, *bones[:1])


def _inverse(count: int) -> Floats:
    matrices = np.tile(np.eye(4), (count, 1, 1))
    for matrix, side in zip(matrices[1:], (np.ones(3), MIRROR), strict=False):
        matrix[:3, 3] = -EYE_MM * side
    return matrices.transpose(0, 2, 1).reshape(count, 16)
