"""Closed surfaces around a scattering medium: the skin with its openings closed, offset inwards."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.geometry import triangle_areas, vertex_normals
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Index = NDArray[np.int32]
_MIN_INRADIUS_MM = 0.05  # least 3 V / A for volume V and surface area A; for a ball, this is its radius
_MAX_FOLDED_FRACTION = 0.02


@dataclass(frozen=True)
class ClosedSurface:
    """Closed triangle surface that bounds a medium.

    positions : (p, 3) vertex positions [mm]
    triangles : (f, 3) vertex indices
    caps : number of openings that were closed
    cap_area : total area of the triangles that close these openings [mm2]
    """

    positions: Floats
    triangles: Index
    caps: int = 0
    cap_area: float = 0.0


def closed_skin(mesh: Mesh, head_name: str) -> ClosedSurface:
    """Return the skin with welded uv seams, and each opening closed by a triangle fan around its centroid.

    head_name : name of the head, for messages

    Raises DermisError when the skin encloses no volume, because it is open or its normals point inwards.
    """
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    if not skin.any():
        refuse(head_name, "skin to trace", "all of its groups are opaque", "Leave a group out of opaque")
    used, triangles = np.unique(mesh.point[mesh.triangles[skin]], return_inverse=True)
    positions = mesh.points_mm[used].astype(np.float32)
    solid = _close_openings(positions, triangles.reshape(-1, 3).astype(np.int32))
    corners = solid.positions[solid.triangles].astype(np.float64)
    depth = 3.0 * _enclosed_volume(corners) / float(triangle_areas(corners).sum())
    if depth < _MIN_INRADIUS_MM:
        actual = "it is a sheet or inside out" if depth < 0.0 else f"it is {depth:.2g} mm deep on average"
        refuse(head_name, "a surface with a volume behind it", actual, "Close it, or reverse its triangles")
    return solid


def offset_inwards(
    closed_surface: ClosedSurface, depth_mm: Doubles, head_name: str
) -> tuple[ClosedSurface, float]:
    """Return a surface offset inwards by a depth at each point, and the fraction of its area that folds over.

    depth_mm : (p,) depth of each point; negative for an offset outwards [mm]
    head_name : name of the head, for messages

    The enclosed body must be thicker than twice the depth everywhere. Where it is thinner, its opposite sides
    cross after the offset, and this is not detected.

    Raises DermisError when more than 2 % of the surface folds over, or when no volume is left.
    """
    shifted = (closed_surface.positions - depth_mm[:, None] * _mitre_vectors(closed_surface)).astype(
        np.float32
    )
    before, after = (
        _area_vectors(vertices[closed_surface.triangles]) for vertices in (closed_surface.positions, shifted)
    )
    area = np.linalg.norm(before, axis=1)
    folded = float(area[(before * after).sum(axis=1) <= 0.0].sum() / area.sum())
    is_empty = _enclosed_volume(shifted[closed_surface.triangles].astype(np.float64)) <= 0.0
    if is_empty or folded > _MAX_FOLDED_FRACTION:
        actual = "nothing is left of it" if is_empty else f"{folded:.1%} of the surface folds over"
        advice = "Trace its layers as one medium"
        where = f"a body deeper than its layers, moved {depth_mm.mean():.2g} mm inwards"
        refuse(head_name, where, actual, advice)
    return replace(closed_surface, positions=shifted), folded


def _mitre_vectors(closed_surface: ClosedSurface) -> Doubles:
    """Return for each point the outward shift (p, 3) that offsets the planes of the adjacent faces by 1.

    At sharp edges the shift is longer than 1, but at most 2.
    """
    points = np.arange(len(closed_surface.positions), dtype=np.int32)
    normals = vertex_normals(closed_surface.positions, points, closed_surface.triangles).astype(np.float64)
    face = _area_vectors(closed_surface.positions[closed_surface.triangles])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-30)
    corner = closed_surface.triangles.ravel()
    along = (normals[corner] * np.repeat(face, 3, axis=0)).sum(axis=1)
    faces = np.bincount(corner, minlength=len(points))
    cosine = np.bincount(corner, along, minlength=len(points)) / np.maximum(faces, 1)
    return normals / np.maximum(cosine, 0.5)[:, None]


def _close_openings(positions: Floats, triangles: Index) -> ClosedSurface:
    open_sides = _boundary_edges(triangles, len(positions))
    if not len(open_sides):
        return ClosedSurface(positions, triangles)
    group = _edge_components(open_sides)
    labels, opening = np.unique(group, return_inverse=True)
    outlines = (positions[open_sides[opening == k]] for k in range(len(labels)))
    centroids = np.stack([outline.mean(axis=(0, 1)) for outline in outlines]).astype(np.float32)
    apex = (len(positions) + opening).astype(np.int32)
    fan = np.column_stack((open_sides[:, 1], open_sides[:, 0], apex)).astype(np.int32)
    vertices = np.vstack((positions, centroids))
    area = float(triangle_areas(vertices[fan]).sum())
    return ClosedSurface(vertices, np.vstack((triangles, fan)), len(labels), area)


def _boundary_edges(triangles: Index, point_count: int) -> NDArray[np.int64]:
    """Return the directed edges (n, 2) of a triangle mesh that lack an edge in the opposite direction.

    If an edge occurs n + k times and the opposite edge occurs n times, the edge is listed k times.

    point_count : number of points
    """
    sides = np.vstack((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]])).astype(np.int64)
    low, high = sides.min(axis=1), sides.max(axis=1)
    edge, edge_of_side = np.unique(low * point_count + high, return_inverse=True)
    surplus = np.bincount(edge_of_side, np.where(sides[:, 0] == low, 1.0, -1.0), len(edge)).astype(np.int64)
    ends = np.column_stack((edge // point_count, edge % point_count))
    directed = np.where((surplus > 0)[:, None], ends, ends[:, ::-1])
    return np.repeat(directed, np.abs(surplus), axis=0)


def _edge_components(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each boundary edge of a mesh the index (n,) of the opening that the edge borders.

    Edges that share points, directly or through other edges, border the same opening.

    edges : (n, 2) point indices at the ends of the edges
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    labels, ends = np.unique(edges, return_inverse=True)
    a, b = ends.reshape(-1, 2).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(labels), len(labels)))
    _, label = connected_components(graph, directed=False)
    return np.asarray(label[a], np.int64)


def _area_vectors(corners: Floats) -> Doubles:
    """Return the normals (f, 3) of triangles, each as long as twice the area of its triangle.

    corners : (f, 3, 3) corner positions
    """
    vertices = corners.astype(np.float64)
    return np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])


def _enclosed_volume(corners: Doubles) -> float:
    """Return the volume enclosed by triangles [mm3]; negative for inward normals.

    corners : (f, 3, 3) corner positions [mm]
    """
    centred = corners - corners.mean(axis=(0, 1))
    return float((centred[:, 0] * np.cross(centred[:, 1], centred[:, 2])).sum() / 6.0)
