"""Subdivision of meshes and heads; points of the finer mesh are weighted means of control points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats, Index, Ints
from dermis.base.disk import Arrays, cached_arrays
from dermis.base.errors import format_value, refuse
from dermis.base.progress import logged_step
from dermis.mesh.geometry import split_quads
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.rig import Stencils
from dermis.mesh.subdivision_rules import Cage, catmull_clark_limit, refine_catmull_clark, refine_loop

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MAX_SUBDIVISION_LEVELS = 3
_CACHE_VERSION = "subdivision 1"  # change it when weights or corners change for the same mesh
_MIN_CACHED_TRIANGLES = 500_000
"""Smallest number of triangles of a finer mesh whose weights are cached on disk, to save half a second."""
CornerIndices = NDArray[np.integer]


class SubdividedMesh(NamedTuple):
    """Subdivided mesh with the stencils of its points; the stencils are None at level 0."""

    mesh: Mesh
    stencils: Stencils | None


@dataclass(frozen=True, eq=False)
class Refinement:
    """Subdivision that applies to all meshes with the same triangles, whatever their positions.

    weights : (q, p) weights of the p control points in each of the q points of the finer mesh
    stencils : the same weights, as the stencils of a rig
    uv, point : (v, 2) uv and (v,) point index of each vertex of the finer mesh
    triangles, material, quads : arrays of the finer mesh, see `Mesh`
    """

    weights: csr_array
    stencils: Stencils
    uv: Floats
    point: Ints
    triangles: Ints
    material: Ints
    quads: Ints

    def subdivided_mesh(self, coarse_mesh: Mesh) -> Mesh:
        """Return a subdivided mesh.

        coarse_mesh : mesh before subdivision, with the triangles for which this refinement was computed
        """
        positions = (self.weights @ coarse_mesh.points_mm)[self.point]
        topology = {"point": self.point, "quads": self.quads}
        return build_mesh(
            positions, self.uv, self.triangles, self.material, coarse_mesh.materials, **topology
        )


def subdivide_head(head: Head, levels: int | Callable[[Head], int]) -> Head:
    """Return a head with a subdivided mesh; the head's rig continues to move the control points.

    head : head that is not subdivided yet
    levels : 0 to 3, or a function that returns the levels for the head
    """
    levels = resolve_levels(head, levels)
    mesh, stencils = subdivide(head.mesh, levels)
    if stencils is None:
        return head
    strands = head.strands and head.strands.refined(head.mesh, mesh, levels)
    hair = head.hair and head.hair.refined(head.mesh, levels)
    rig = replace(head.control_rig, stencils=stencils)
    return replace(head, mesh=mesh, rig=rig, strands=strands, hair=hair, levels=int(levels), template=None)


def resolve_levels(head: Head, levels: int | Callable[[Head], int]) -> int:
    """Return the number of subdivision levels for a head, given as a number or as a function of the head.

    Raises DermisError if the number is not 0, 1, 2 or 3.
    """
    return _check_levels(levels(head) if callable(levels) else levels)


def _check_levels(levels: int) -> int:
    if not isinstance(levels, int | np.integer) or levels not in range(MAX_SUBDIVISION_LEVELS + 1):
        actual = f"got {format_value(levels)}"
        refuse("subdivide", f"0 to {MAX_SUBDIVISION_LEVELS} levels", actual, "Each level takes 4x the memory")
    return int(levels)


def subdivide(mesh: Mesh, levels: int) -> SubdividedMesh:
    """Return a mesh subdivided `levels` times, with smoothed positions and linearly interpolated uv.

    A mesh that has more quads than triangles is subdivided by the rules of Catmull and Clark, and its points
    are moved to the limit surface. Other meshes are subdivided by the rules of Loop. Vertices at the same
    point stay together, so that the surface has no cracks or creases at uv seams. Open borders are smoothed
    as curves. Normals are computed from the subdivided mesh; normals of the file are dropped.

    levels : number of subdivisions, 0 to 3; each subdivision multiplies the number of triangles by about four
    """
    if _check_levels(levels) == 0:
        return SubdividedMesh(mesh, None)
    refined = refinement(mesh, levels)
    return SubdividedMesh(refined.subdivided_mesh(mesh), refined.stencils)


def refinement(mesh: Mesh, levels: int) -> Refinement:
    """Return the weights and arrays by which `subdivide` computes the finer mesh.

    They do not depend on positions, so they also apply to other meshes with the same triangles, quads and uv.

    levels : number of subdivisions, 1 to 3
    """
    from scipy.sparse import csr_array

    by_quads = 2 * len(mesh.quads) > len(mesh.triangles) - len(mesh.quads)
    finer = _cached_refinement(mesh, levels, by_quads)
    first, column, weight, point = (finer[name] for name in ("first", "control", "weight", "point"))
    triangles = split_quads(finer["corner"].reshape(-1, 4)) if by_quads else finer["corner"].reshape(-1, 3)
    quads = np.arange(len(triangles) if by_quads else 0, dtype=np.int32).reshape(-1, 2)
    return Refinement(
        csr_array((weight, column, first), shape=(len(first) - 1, int(mesh.point.max()) + 1)),
        Stencils(first, column, weight.astype(np.float32)),
        finer["uv"],
        point,
        triangles.astype(np.int32),
        finer["material"],
        quads,
    )


def _cached_refinement(mesh: Mesh, levels: int, by_quads: bool) -> Arrays:
    """Return the arrays of `_compute_refinement`, cached on disk for large meshes.

    by_quads : whether to use Catmull and Clark's rules instead of Loop's
    """
    if len(mesh.triangles) * 4**levels < _MIN_CACHED_TRIANGLES:
        return _compute_refinement(mesh, levels, by_quads)
    sources = [mesh.uv, mesh.point, mesh.triangles, mesh.material, mesh.quads]
    names = ["first", "control", "weight", "uv", "point", "corner", "material"]
    return cached_arrays(
        sources, f"{_CACHE_VERSION} {levels}", names, lambda: _compute_refinement(mesh, levels, by_quads)
    )


@logged_step("subdividing the mesh")
def _compute_refinement(mesh: Mesh, levels: int, by_quads: bool) -> Arrays:
    """Return connectivity and weights of the subdivided mesh, as a dictionary from name to array.

    Each of its points is a weighted mean of control points; "first", "control" and "weight" are the fields of
    `Stencils`. Its vertices have "uv" and "point". Its faces have vertices "corner" and a "material".

    by_quads : whether to use Catmull and Clark's rules instead of Loop's
    """
    triangles = mesh.triangles.astype(np.int64).ravel(), np.full(len(mesh.triangles), 3), mesh.material
    faces = polygons(mesh) if by_quads else triangles
    cage = Cage(mesh.uv.astype(np.float64), mesh.point.astype(np.int64), *faces)
    refine = refine_catmull_clark if by_quads else refine_loop
    weights, cage = refine(cage)
    for _ in range(levels - 1):
        finer, cage = refine(cage)
        weights = finer @ weights
    if by_quads:
        weights = catmull_clark_limit(cage) @ weights
    weights.sort_indices()
    return {
        "first": weights.indptr.astype(np.int32),
        "control": weights.indices.astype(np.int32),
        "weight": weights.data,
        "uv": cage.uv.astype(np.float32),
        "point": cage.point.astype(np.int32),
        "corner": cage.corner.astype(np.int32),
        "material": np.repeat(cage.material, 2 if by_quads else 1),
    }


def polygons(mesh: Mesh) -> tuple[Index, Index, Ints]:
    """Return the triangles and quads of a mesh as f polygons.

    The arrays are the vertices (n,) at the corners of all polygons, and the number (f,) of corners and the
    material (f,) of each polygon. Triangles that belong to no quad come first, then quads.
    """
    first, second = mesh.quads.T
    loose = np.delete(np.arange(len(mesh.triangles)), mesh.quads.ravel())
    quads = np.column_stack((mesh.triangles[first], mesh.triangles[second, 1]))
    corner = np.concatenate((mesh.triangles[loose].ravel(), quads.ravel())).astype(np.int64)
    sides = np.repeat(np.array([3, 4]), (len(loose), len(quads)))
    return corner, sides, np.concatenate((mesh.material[loose], mesh.material[first]))


def coarse_triangles(head: Head, min_faces: int, tolerance_mm: float) -> Ints:
    """Return triangles (t, 3) of a subdivided head, coarser in flat regions.

    There, the faces of an earlier level of subdivision replace the finest faces. The triangles are indices of
    vertices of the subdivided mesh. Triangles from which an opacity map cuts out parts are left out.

    min_faces : levels are dropped only as long as the coarser mesh has at least this number of faces
    tolerance_mm : a coarse face counts as flat if, on each of its edges, the vertex that the next finer level
        adds is at most this far from the middle of the edge [mm]
    """
    mesh, levels = head.mesh, head.levels
    by_quads = len(mesh.quads) > 0
    count = len(mesh.quads) if by_quads else len(mesh.triangles)
    while levels > 0 and count // 4 >= min_faces:
        levels, count = levels - 1, count // 4
    skipped = head.levels - levels
    if skipped == 0:
        return mesh.triangles[~mesh.cut_out_mask]
    if by_quads:
        solid = mesh.quads[~mesh.cut_out_mask[mesh.quads[:, 0]]]
        quads = np.column_stack((mesh.triangles[solid[:, 0]], mesh.triangles[solid[:, 1], 1]))
        coarse = _coarsen_quads(quads, mesh.positions, skipped, tolerance_mm)
        worn = mesh.triangles[len(head.body.mesh.triangles) :]
        return np.concatenate([coarse, worn]) if len(worn) else coarse
    return _coarsen_triangles(mesh.triangles[~mesh.cut_out_mask], mesh.positions, skipped, tolerance_mm)


def _coarsen_triangles(
    triangles: Ints, positions_mm: Floats, dropped_levels: int, tolerance_mm: float
) -> Ints:
    """Return triangles (t, 3) of a mesh after Loop subdivision, coarser in flat regions.

    There, the faces of an earlier level of subdivision replace the finest faces. Elsewhere, the finest faces
    are kept.

    triangles : (f, 3) triangles of the finest level; Loop's rules divide a triangle into four, of which the
        first three are at its corners
    dropped_levels : number of subdivision levels to leave out in flat regions
    positions_mm : (v, 3) vertices of the finest level [mm]
    tolerance_mm : a coarse face counts as flat if, on each of its edges, the vertex that the next finer level
        adds is at most this far from the middle of the edge [mm]
    """
    coarse, finer = triangles, triangles
    for _ in range(dropped_levels):
        coarse, finer = coarse.reshape(-1, 4, 3)[:, :3, 0], coarse
    middles = finer.reshape(-1, 4, 3)[:, :3, 1]
    deviation = _edge_deviation_mm(positions_mm, middles, coarse, np.roll(coarse, -1, axis=1))
    is_curved = deviation.max(axis=1) > tolerance_mm
    return np.concatenate((coarse[~is_curved], triangles[np.repeat(is_curved, 4**dropped_levels)]))


def _coarsen_quads(
    quads: CornerIndices, positions_mm: Floats, dropped_levels: int, tolerance_mm: float
) -> Ints:
    """Return triangles (t, 3) of a mesh after Catmull-Clark subdivision, coarser in flat regions.

    There, the faces of an earlier level of subdivision replace the finest faces. Elsewhere, the finest faces
    are kept.

    quads : (q, 4) quads of the finest level; Catmull and Clark's rules divide a polygon with k corners into
        k quads, which meet at its centre
    dropped_levels : number of subdivision levels to leave out in flat regions
    positions_mm : (v, 3) vertices of the finest level [mm]
    tolerance_mm : a coarse face counts as flat if, on each of its edges, the vertex that the next finer level
        adds is at most this far from the middle of the edge [mm]
    """
    coarse = quads
    for _ in range(dropped_levels - 1):
        coarse = coarse[:, 0].reshape(-1, 4)
    corner, side, centre = coarse[:, 0], coarse[:, 1], coarse[:, 2]
    is_first = np.append(True, centre[1:] != centre[:-1])
    is_last, polygon = np.append(is_first[1:], True), np.cumsum(is_first) - 1
    first = np.flatnonzero(is_first)[polygon]
    following = np.where(is_last, corner[first], np.roll(corner, -1))
    is_curved = np.zeros(polygon[-1] + 1, bool)
    is_curved[polygon[_edge_deviation_mm(positions_mm, side, corner, following) > tolerance_mm]] = True
    in_fan = ~is_first & ~is_last & ~is_curved[polygon]
    fans = np.column_stack((corner[first], corner, following))[in_fan]
    fine = quads[np.repeat(is_curved[polygon], 4 ** (dropped_levels - 1))]
    return np.concatenate((fans, split_quads(fine))).astype(np.int32)


def _edge_deviation_mm(
    positions_mm: Floats, middle_vertex: CornerIndices, start_vertex: CornerIndices, end_vertex: CornerIndices
) -> Floats:
    """Return the distance between the middle vertex of each coarse edge and the midpoint of this edge [mm].

    positions_mm : (v, 3) positions of all vertices [mm]
    middle_vertex, start_vertex, end_vertex : for each coarse edge, the indices of the vertex in its middle
        and of the vertices at its ends
    """
    halfway = 0.5 * (positions_mm[start_vertex] + positions_mm[end_vertex])
    return np.asarray(np.linalg.norm(positions_mm[middle_vertex] - halfway, axis=-1))
