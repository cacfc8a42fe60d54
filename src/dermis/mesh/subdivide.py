"""Subdivision: a finer mesh, smoothed over the welded surface, whose points are means of control points."""

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
from dermis.mesh.geometry import halves
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.rig import Stencils
from dermis.mesh.subdivision_rules import Cage, catmull_clark_limit, refine_catmull_clark, refine_loop

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MAX_LEVELS = 3
_FORM = "subdivision 1"  # raise when weights or corners change for the same mesh
_MANY = 500_000
"""Finer triangles from which on reading weights from disk saves half a second or more."""
Corners = NDArray[np.integer]


class Subdivided(NamedTuple):
    """A finer mesh, and its points as means of those of the coarser one; None where they are the same."""

    mesh: Mesh
    stencils: Stencils | None


@dataclass(frozen=True, eq=False)
class Refinement:
    """How meshes of one topology are refined.

    weights : (q, p) of the control points in each finer point
    stencils : the same, as single numbers
    uv, point : (v, 2) and (v,) of the finer vertices
    triangles, material, quads : as `Mesh` has them
    """

    weights: csr_array
    stencils: Stencils
    uv: Floats
    point: Ints
    triangles: Ints
    material: Ints
    quads: Ints

    def mesh(self, coarse: Mesh) -> Mesh:
        """The finer mesh of one with this topology."""
        places, kinds = (self.weights @ coarse.points_mm)[self.point], coarse.materials
        rest = {"point": self.point, "quads": self.quads}
        return build_mesh(places, self.uv, self.triangles, self.material, kinds, **rest)


def subdivide_head(head: Head, levels: int | Callable[[Head], int]) -> Head:
    """The head on a finer mesh; what moved its points now moves the control points of that mesh.

    head : not subdivided yet
    levels : 0 to 3, or what finds them for the head
    """
    levels = levels_of(head, levels)
    mesh, stencils = subdivide(head.mesh, levels)
    if stencils is None:
        return head
    strands, hair = (part and part.refined(head.mesh, mesh, levels) for part in (head.strands, head.hair))
    rig = replace(head.control, stencils=stencils)
    return replace(head, mesh=mesh, rig=rig, strands=strands, hair=hair, levels=int(levels), template=None)


def levels_of(head: Head, levels: int | Callable[[Head], int]) -> int:
    """Levels of subdivision, or those that are found for a head.

    Raises DermisError for other numbers than 0 to 3.
    """
    return _checked(levels(head) if callable(levels) else levels)


def _checked(levels: int) -> int:
    if not isinstance(levels, int | np.integer) or levels not in range(MAX_LEVELS + 1):
        actual = f"got {format_value(levels)}"
        refuse("subdivide", f"0 to {MAX_LEVELS} levels", actual, "Each level takes 4x the memory")
    return int(levels)


def subdivide(mesh: Mesh, levels: int) -> Subdivided:
    """The mesh refined `levels` times: positions smoothed, uv halved linearly, materials kept.

    A mesh of more quads than triangles is refined by Catmull's and Clark's rules and put on the surface that
    further levels tend to; others are refined by Loop's. Positions follow the welded points, so uv seams
    neither crack nor crease; open borders are smoothed as curves of their own. Normals and tangents are
    computed anew, normals of the file are given up.

    levels : 0 to 3, each takes four times the triangles
    """
    if _checked(levels) == 0:
        return Subdivided(mesh, None)
    found = refinement(mesh, levels)
    return Subdivided(found.mesh(mesh), found.stencils)


def refinement(mesh: Mesh, levels: int) -> Refinement:
    """How meshes of this one's topology are refined `levels` times, see `subdivide`.

    levels : 1 to 3
    """
    from scipy.sparse import csr_array

    by_quads = 2 * len(mesh.quads) > len(mesh.triangles) - len(mesh.quads)
    finer = _kept(mesh, levels, by_quads)
    first, column, weight, point = (finer[name] for name in ("first", "control", "weight", "point"))
    triangles = halves(finer["corner"].reshape(-1, 4)) if by_quads else finer["corner"].reshape(-1, 3)
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


def _kept(mesh: Mesh, levels: int, by_quads: bool) -> Arrays:
    """What `_refined` returns, of large meshes kept on disk for all heads of the same topology."""
    if len(mesh.triangles) * 4**levels < _MANY:
        return _refined(mesh, levels, by_quads)
    sources = [mesh.uv, mesh.point, mesh.triangles, mesh.material, mesh.quads]
    names = ["first", "control", "weight", "uv", "point", "corner", "material"]
    return cached_arrays(sources, f"{_FORM} {levels}", names, lambda: _refined(mesh, levels, by_quads))


@logged_step("subdividing the mesh")
def _refined(mesh: Mesh, levels: int, by_quads: bool) -> Arrays:
    """Corners of the finer faces, and weights of control points, row after row as `Stencils` have them."""
    alone = mesh.triangles.astype(np.int64).ravel(), np.full(len(mesh.triangles), 3), mesh.material
    faces = polygons(mesh) if by_quads else alone
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
    """Corner vertices of all faces (n,), the number of each one's corners (f,) and its material (f,).

    Triangles come first, then quads.
    """
    first, second = mesh.quads.T
    alone = np.delete(np.arange(len(mesh.triangles)), mesh.quads.ravel())
    quads = np.column_stack((mesh.triangles[first], mesh.triangles[second, 1]))
    corner = np.concatenate((mesh.triangles[alone].ravel(), quads.ravel())).astype(np.int64)
    sides = np.repeat(np.array([3, 4]), (len(alone), len(quads)))
    return corner, sides, np.concatenate((mesh.material[alone], mesh.material[first]))


def coarse_triangles(head: Head, least: int, off_mm: float) -> Ints:
    """(t, 3) vertices of the head's mesh: its triangles, less the levels of subdivision that can be spared.

    Vertices stay where they are, on the finer surface.

    least : faces that are left at least
    off_mm : by how much the middles of sides may move for that, at most
    """
    mesh, levels = head.mesh, head.levels
    by_quads = len(mesh.quads) > 0
    count = len(mesh.quads) if by_quads else len(mesh.triangles)
    while levels > 0 and count // 4 >= least:
        levels, count = levels - 1, count // 4
    spared = head.levels - levels
    if spared == 0:
        return mesh.triangles
    if by_quads:
        quads = np.column_stack((mesh.triangles[mesh.quads[:, 0]], mesh.triangles[mesh.quads[:, 1], 1]))
        return _of_quads(quads, mesh.positions, spared, off_mm)
    return _of_triangles(mesh.triangles, mesh.positions, spared, off_mm)


def _of_triangles(triangles: Ints, places_mm: Floats, levels: int, off_mm: float) -> Ints:
    """By Loop's rules four triangles come of one, the first three at its corners."""
    coarse, near = triangles, triangles
    for _ in range(levels):
        coarse, near = coarse.reshape(-1, 4, 3)[:, :3, 0], coarse
    middles = near.reshape(-1, 4, 3)[:, :3, 1]
    kept = _off_mm(places_mm, middles, coarse, np.roll(coarse, -1, axis=1)).max(axis=1) > off_mm
    return np.concatenate((coarse[~kept], triangles[np.repeat(kept, 4**levels)]))


def _of_quads(quads: Corners, places_mm: Floats, levels: int, off_mm: float) -> Ints:
    """By Catmull's and Clark's a quad for each corner of a polygon, from that to the polygon's middle."""
    near = quads
    for _ in range(levels - 1):
        near = near[:, 0].reshape(-1, 4)
    corner, side, middle = near[:, 0], near[:, 1], near[:, 2]
    begins = np.append(True, middle[1:] != middle[:-1])
    ends, polygon = np.append(begins[1:], True), np.cumsum(begins) - 1
    first = np.flatnonzero(begins)[polygon]
    after = np.where(ends, corner[first], np.roll(corner, -1))
    kept = np.zeros(polygon[-1] + 1, bool)
    kept[polygon[_off_mm(places_mm, side, corner, after) > off_mm]] = True
    fan = ~begins & ~ends & ~kept[polygon]
    between = np.column_stack((corner[first], corner, after))[fan]
    fine = quads[np.repeat(kept[polygon], 4 ** (levels - 1))]
    return np.concatenate((between, halves(fine))).astype(np.int32)


def _off_mm(places_mm: Floats, middle: Corners, start: Corners, end: Corners) -> Floats:
    """How far the middles of sides are from halfway between their ends [mm]."""
    halfway = 0.5 * (places_mm[start] + places_mm[end])
    return np.asarray(np.linalg.norm(places_mm[middle] - halfway, axis=-1))
