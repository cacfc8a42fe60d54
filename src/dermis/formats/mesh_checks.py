"""Checks of meshes and rigs from files; each error says how to correct the file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Mask
from dermis.base.errors import refuse
from dermis.formats import size_limits as limits
from dermis.formats.parts import MeshPart
from dermis.mesh.geometry import cross_columns, dot_columns, edge_keys, edges
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import Rig

UV_TOLERANCE = 1e-4
MAX_DISTANCE_FROM_ORIGIN_MM = 1e6
"""Largest distance of a vertex from the origin along an axis [mm]. Beyond a kilometre, the rounding errors of
single precision are too large for skin."""
MIN_RELATIVE_AREA = 1e-6
"""Limit of the ratio of a triangle's area to the square of its longest side [-]. Triangles with a smaller
ratio count as triangles without area, because single precision is too coarse for them."""
_UNIT_ADVICE = "Set the millimetres per unit of the file with --unit-mm"


def check_mesh(mesh: Mesh, error_subject: object, *, has_pictures: bool = False) -> None:
    """Refuse a mesh that cannot be rendered as skin.

    error_subject : source of the mesh for errors, usually its file
    has_pictures : whether the file has pictures; uv outside [0, 1] are then valid, because pictures are
        packed into a new uv layout later

    Raises `DermisError` for numbers that are not finite, indices out of range, uv outside [0, 1], degenerate
    triangles, edges shared by more than two triangles, and a mesh without skin.
    """
    check_arrays(mesh.positions, mesh.uv, mesh.triangles, error_subject)
    for name in ("normals", "dpdu", "dpdv"):
        _check_finite(name, getattr(mesh, name), error_subject)
    _check_areas(mesh, error_subject)
    _check_manifold(mesh, error_subject)
    _check_has_skin(mesh, error_subject)
    if not has_pictures:
        check_uv_range(mesh, error_subject)


def check_arrays(
    positions: NDArray[np.floating],
    uv: NDArray[np.floating],
    triangles: NDArray[np.integer],
    error_subject: object,
) -> None:
    """Refuse positions, uv and triangles from which no valid `Mesh` can be built.

    positions : (v, 3) vertex positions [mm]
    uv : (v, 2) vertex uv
    triangles : (f, 3) vertex indices
    error_subject : source of the mesh for errors, usually its file
    """
    if len(triangles) == 0:
        refuse(error_subject, "a mesh of triangles", "it has none", "Export the head as a polygon mesh")
    if triangles.min() < 0 or triangles.max() >= len(positions):
        actual = f"they run from {triangles.min()} to {triangles.max()}"
        refuse(
            error_subject, f"triangle indices from 0 to {len(positions) - 1}", actual, limits.DAMAGED_ADVICE
        )
    for name, values in (("positions", positions), ("uv", uv)):
        _check_finite(name, values, error_subject)
    farthest = float(np.abs(positions).max())
    if farthest > MAX_DISTANCE_FROM_ORIGIN_MM:
        expected = f"positions within {MAX_DISTANCE_FROM_ORIGIN_MM:g} mm of the origin"
        advice = f"{_UNIT_ADVICE}, or move the head to the origin"
        refuse(error_subject, expected, f"one is {farthest:.3g} mm away", advice)


def _check_finite(
    quantity: str, array: NDArray[np.floating], error_subject: object, items_noun: str = "vertices"
) -> None:
    lost = np.flatnonzero(~np.isfinite(array).all(axis=tuple(range(1, array.ndim))))
    if len(lost):
        actual = f"{len(lost)} {items_noun} are NaN or infinite, first {lost[0]}"
        refuse(error_subject, f"finite {quantity}", actual, limits.DAMAGED_ADVICE)


def check_rig(rig: Rig, error_subject: object) -> None:
    """Refuse a rig with displacements, weights or matrices that are not finite."""
    _check_finite("displacements of targets", rig.targets.delta_mm, error_subject, "of them")
    if rig.targets.rest is not None:
        _check_finite("weights of targets", rig.targets.rest, error_subject, "of them")
    if rig.skeleton is not None:
        for name in ("local", "inverse_bind", "rest_matrices", "weight"):
            _check_finite(f"bones ({name})", getattr(rig.skeleton, name), error_subject, "of them")


def check_mesh_counts(mesh_parts: Sequence[MeshPart], error_subject: object) -> None:
    """Refuse mesh parts with too many triangles or vertices in total, before they are joined."""
    triangles = sum(len(part.triangles) for part in mesh_parts)
    limits.check_limit(error_subject, triangles, limits.MAX_TRIANGLES, "triangles", limits.DECIMATE_ADVICE)
    vertices = sum(len(part.positions) for part in mesh_parts)
    limits.check_limit(error_subject, vertices, limits.MAX_VERTICES, "vertices", limits.DECIMATE_ADVICE)


def check_uv_range(mesh: Mesh, error_subject: object) -> None:
    """Refuse a mesh whose skin has uv outside [0, 1].

    error_subject : source of the mesh for errors, usually its file
    """
    skin = np.array([one.kind == "skin" for one in mesh.materials])[mesh.material]
    uv = mesh.uv[mesh.triangles[skin].ravel()]
    low, high = uv.min(axis=0), uv.max(axis=0)
    if min(low) < -UV_TOLERANCE or max(high) > 1 + UV_TOLERANCE:
        actual = f"u runs from {low[0]:.4g} to {high[0]:.4g} and v from {low[1]:.4g} to {high[1]:.4g}"
        advice = "Move every uv island into the one tile (in Blender: UV Editor, UV > Pack Islands)"
        refuse(error_subject, "uv in [0, 1], without UDIM tiles and repeats", actual, advice)


def flat_triangles(positions: NDArray[np.floating], triangles: NDArray[np.integer]) -> Mask:
    """Return the mask (f,) of triangles without area in single precision.

    positions : (v, 3) vertex positions [mm]
    triangles : (f, 3) vertex indices
    """
    columns = np.ascontiguousarray(positions.T, np.float64)
    a, b, c = (columns.take(corner, axis=1) for corner in np.ascontiguousarray(triangles.T))
    ab, bc, ca = b - a, c - b, a - c
    squares = [dot_columns(side, side) for side in (ab, bc, ca)]
    normal = cross_columns(ab, ca)
    longest = np.maximum(np.maximum(squares[0], squares[1]), squares[2])
    return np.asarray(np.sqrt(dot_columns(normal, normal)) / 2 <= MIN_RELATIVE_AREA * longest)


def _check_areas(mesh: Mesh, error_subject: object) -> None:
    flat = np.flatnonzero(flat_triangles(mesh.positions, mesh.triangles))
    if len(flat):
        actual = f"{len(flat)} have none (zero area): the first are {', '.join(map(str, flat[:5]))}"
        advice = "In Blender: Edit Mode, Mesh > Clean Up > Degenerate Dissolve"
        refuse(error_subject, "triangles with an area", actual, advice)


def _check_manifold(mesh: Mesh, error_subject: object) -> None:
    corners = mesh.point[mesh.triangles]
    keys = np.sort(edge_keys(corners), axis=None)
    if not (keys[2:] == keys[:-2]).any():
        return
    ends, _, counts = edges(corners)
    non_manifold = np.flatnonzero(counts > 2)
    if len(non_manifold):
        position = mesh.positions[np.flatnonzero(mesh.point == ends[non_manifold[0], 0])[0]]
        where = f"{counts[non_manifold[0]]} triangles at ({', '.join(f'{x:.4g}' for x in position)}) mm"
        actual = f"{len(non_manifold)} edges are non-manifold, the first has {where}"
        advice = "In Blender: Select > All by Trait > Non Manifold, delete inner or double faces, "
        advice += "then Mesh > Merge > By Distance"
        refuse(error_subject, "a surface of one sheet, two triangles to an edge", actual, advice)


def _check_has_skin(mesh: Mesh, error_subject: object) -> None:
    if mesh.material.min() < 0 or mesh.material.max() >= len(mesh.materials):
        actual = f"they run from {mesh.material.min()} to {mesh.material.max()}"
        refuse(error_subject, f"material indices below {len(mesh.materials)}", actual, "Build the mesh again")
    for one in mesh.materials:
        if not all(0 <= value <= 1 for value in one.colour):  # rejects NaN as well
            actual = f"that of {one.name!r} is {', '.join(f'{value:g}' for value in one.colour)}"
            refuse(error_subject, "colours of materials from 0 to 1", actual, "Correct it in the file")
    used = np.bincount(mesh.material, minlength=len(mesh.materials))
    skins = [(one.name, n) for one, n in zip(mesh.materials, used, strict=True) if one.kind == "skin"]
    empty = [name for name, count in skins if count == 0]
    if not skins or empty:
        groups = ", ".join(material.name for material in mesh.materials)
        no_skin = f"none of its groups is skin ({groups})"
        actual = f"skin group {empty[0]!r} has no triangles" if empty else no_skin
        advice = "Assign the skin's faces to a material called skin, or name fewer groups opaque"
        refuse(error_subject, "a group of triangles that is skin", actual, advice)
