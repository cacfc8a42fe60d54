"""Triangles of a mesh in their own planes, with their neighbours in space and in uv, for stitching."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import opposite_sides
from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.mesh.geometry import MIN_DOUBLE_UV_AREA, cross_2d, tangents, triangle_areas, uv_cross, weld
from dermis.mesh.mesh import Mesh

_MIN_SIDE_LENGTH_MM = 1e-9


class Adjacency(NamedTuple):
    """Adjacency of triangles, used to continue geodesics across edges.

    The sides 0, 1 and 2 of a triangle connect the corners 01, 12 and 20.

    planar_corners : (f, 3, 2) corners in the triangle's own plane, counter-clockwise from outside [mm]
    neighbour : (f, 3) index of the triangle across each side, -1 if there is none
    neighbour_side : (f, 3) side of the neighbour that is the shared edge
    flipped : (f, 3) mask of neighbours that face the opposite way
    apex : (f, 3, 2) for each side, the position of the opposite corner: the distance from the start of the
        side along it, and the distance to its left, as fractions of the side's length
    passable : (f,) mask of triangles that geodesics may cross
    """

    planar_corners: Doubles
    neighbour: Ints
    neighbour_side: NDArray[np.int8]
    flipped: Mask
    apex: Doubles
    passable: Mask


@dataclass(frozen=True)
class FlatSurface:
    """Triangles of a mesh with their planar corners, uv metric and neighbours.

    The sides 0, 1 and 2 of a triangle connect the corners 01, 12 and 20.

    corners : (f, 3, 3) positions of the corners [mm]
    uv : (f, 3, 2) uv of the corners in the mesh's own layout
    area_mm2 : (f,) area on the surface [mm2]
    uv_area : (f,) area in uv, negative where uv is mirrored as seen from outside
    skin : (f,) mask of skin triangles, the only triangles that geodesics may cross
    valid : (f,) mask of skin triangles with an area in space and in uv
    adjacency : neighbours in space, for geodesics
    uv_neighbour : (f, 3) index of the triangle across each side in uv; the triangle itself at a seam
    uv_tangents : (f, 3, 2, 2) surface vectors per unit of uv at each corner [mm]. The third axis is for u and
        v, the last for the components of the vector in the triangle's plane
    uv_metric : (f, 3, 3) lengths of the two vectors in `uv_tangents` [mm], and the cosine of the angle
        between these vectors [-]
    """

    corners: Doubles
    uv: Doubles
    area_mm2: Doubles
    uv_area: Doubles
    skin: Mask
    valid: Mask
    adjacency: Adjacency
    uv_neighbour: Index
    uv_tangents: Doubles
    uv_metric: Doubles

    def points(self, triangle: NDArray[np.integer], weights: NDArray[np.floating]) -> Doubles:
        """Return the surface points (n, 3) at barycentric weights in triangles [mm].

        triangle : (n,) triangle indices
        weights : (n, 2) barycentric weights of the second and third corner
        """
        return interpolate_corners(self.corners, triangle, weights.astype(np.float64))

    def subset(self, member_triangles: Index) -> FlatSurface:
        """Return the surface with only some of its triangles; its adjacency is not valid for geodesics."""
        names = [field.name for field in fields(self) if field.name != "adjacency"]
        return replace(self, **{name: getattr(self, name)[member_triangles] for name in names})


def interpolate_corners(
    corner_values: NDArray[np.floating], triangle: NDArray[np.integer], weights: NDArray[np.floating]
) -> NDArray[Any]:
    """Interpolate data (f, 3, c) at triangle corners to points on the triangles, (n, c).

    triangle : (n,) triangle index of each point
    weights : (n, 2) barycentric weights of the second and third corner
    """
    second, third = weights[:, :1], weights[:, 1:]
    found = (1.0 - second - third) * corner_values[:, 0][triangle]
    found += second * corner_values[:, 1][triangle]
    found += third * corner_values[:, 2][triangle]
    return np.asarray(found)


def flat_surface(mesh: Mesh) -> FlatSurface:
    """Represent each triangle of a mesh in its own plane, and compute uv metric and neighbours."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    uv = mesh.uv[mesh.triangles].astype(np.float64)
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    # v runs down, so uv that is not mirrored has a negative cross product in (u, v)
    uv_area = -uv_cross(uv) / 2
    area = triangle_areas(corners)
    valid = skin & (2 * np.abs(uv_area) > MIN_DOUBLE_UV_AREA) & (area > 0)
    flat, axes = _planar_corners(corners)
    uv_tangents, uv_metric = _uv_tangents_and_metric(mesh, flat, axes, uv, uv_area)
    same_uv = weld(np.hstack((mesh.positions, mesh.uv)))[mesh.triangles]
    uv_neighbour = (opposite_sides(same_uv.astype(np.int64)) % len(uv)).reshape(3, -1).T
    return FlatSurface(
        corners,
        uv,
        area,
        uv_area,
        skin,
        valid,
        Adjacency(flat, *side_neighbours(mesh), _apexes(flat), skin),
        uv_neighbour,
        uv_tangents,
        uv_metric,
    )


def _planar_corners(corners: Doubles) -> tuple[Doubles, Doubles]:
    """Return each triangle's corners in its plane (f, 3, 2) [mm], and the axes of the plane (f, 2, 3).

    The first corner is at 0 and the second to its right.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    x = first / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), _MIN_SIDE_LENGTH_MM)
    up = second - (second * x).sum(axis=1, keepdims=True) * x
    y = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), _MIN_SIDE_LENGTH_MM)
    axes = np.stack((x, y), axis=1)
    return np.einsum("fki,fai->fka", corners - corners[:, :1], axes), axes


def side_neighbours(mesh: Mesh) -> tuple[Ints, NDArray[np.int8], Mask]:
    """Return the neighbour across each side: triangle index, side of the shared edge, and flip, (f, 3) each.

    The index is -1 if there is no neighbour. The flip is true if the neighbour faces the opposite way.
    """
    points, count = mesh.point[mesh.triangles].astype(np.int64), len(mesh.triangles)
    side = np.arange(3 * count)
    other = opposite_sides(points)
    start = points.T.ravel()
    neighbour = np.where(other == side, -1, other % count).reshape(3, -1).T
    neighbour_side = (other // count).reshape(3, -1).T
    flipped = (start[other] == start).reshape(3, -1).T
    return (
        np.ascontiguousarray(neighbour, np.int32),
        np.ascontiguousarray(neighbour_side, np.int8),
        np.ascontiguousarray(flipped),
    )


def _apexes(planar_corners: Doubles) -> Doubles:
    """Return the position of the opposite corner for each side of each triangle, (f, 3, 2).

    The two coordinates are the distance from the start of the side along it, and the distance to its left,
    both as fractions of the side's length.

    planar_corners : (f, 3, 2) corners in the plane of each triangle [mm]
    """
    side = np.roll(planar_corners, -1, axis=1) - planar_corners
    third = np.roll(planar_corners, -2, axis=1) - planar_corners
    square = np.maximum((side**2).sum(axis=2), _MIN_SIDE_LENGTH_MM**2)
    along = (side * third).sum(axis=2) / square
    left = cross_2d(side, third) / square
    return np.stack((along, left), axis=-1)


def _uv_tangents_and_metric(
    mesh: Mesh, planar_corners: Doubles, plane_axes: Doubles, uv: Doubles, uv_area: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the fields `uv_tangents` and `uv_metric` of `FlatSurface`.

    Both fields are averaged over those triangles around a vertex that have the same orientation in uv.

    planar_corners, plane_axes : results of `_planar_corners`
    uv, uv_area : as in `FlatSurface`
    """
    count = len(mesh.positions)
    corner = mesh.triangles + count * (uv_area < 0)[:, None].astype(np.int32)
    positions, uvs, normals = (np.concatenate((a, a)) for a in (mesh.positions, mesh.uv, mesh.normals))
    steps = np.stack(tangents(positions, uvs, normals, corner), axis=1)[corner].astype(np.float64)
    length = np.linalg.norm(steps, axis=-1)
    product = length.prod(axis=-1)
    cosine = (steps[:, :, 0] * steps[:, :, 1]).sum(axis=-1) / np.maximum(product, 1e-12)
    # projected to the triangle's plane, with the length preserved
    uv_tangents = np.einsum("fksi,fai->fksa", steps, plane_axes)
    uv_tangents *= (length / np.maximum(np.linalg.norm(uv_tangents, axis=-1), 1e-12))[..., None]
    triangle_steps = _triangle_uv_tangents(planar_corners, uv)[:, None]
    # the mean over triangles of very different normals may be meaningless: use the triangle's own steps there
    area = cross_2d(uv_tangents[..., 0, :], uv_tangents[..., 1, :])
    is_meaningless = area * np.sign(uv_area)[:, None] >= -0.05 * product
    uv_tangents = np.where(is_meaningless[..., None, None], triangle_steps, uv_tangents)
    return uv_tangents, np.concatenate((length, cosine[..., None]), axis=-1)


def _triangle_uv_tangents(planar_corners: Doubles, uv: Doubles) -> Doubles:
    """Return the surface vectors (f, 2, 2) per unit of u and of v, constant over each triangle [mm]."""
    e, d = planar_corners[:, 1:] - planar_corners[:, :1], uv[:, 1:] - uv[:, :1]
    cross = cross_2d(d[:, 0], d[:, 1])
    cross = np.where(np.abs(cross) > MIN_DOUBLE_UV_AREA, cross, np.inf)[:, None]
    u = (e[:, 0] * d[:, 1, 1:] - e[:, 1] * d[:, 0, 1:]) / cross
    v = (e[:, 1] * d[:, 0, :1] - e[:, 0] * d[:, 1, :1]) / cross
    return np.stack((u, v), axis=1)
