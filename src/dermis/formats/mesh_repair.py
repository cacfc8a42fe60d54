"""Repair of meshes from files: faults that other programs tolerate are corrected, with a note on each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask
from dermis.formats.materials import IDENTITY_UV_TRANSFORM, FileMaterial, Wrap
from dermis.formats.mesh_checks import UV_TOLERANCE, flat_triangles
from dermis.formats.parts import MeshPart
from dermis.formats.read import select_vertices
from dermis.mesh.geometry import (
    compact_vertices,
    cross_columns,
    dot_columns,
    edge_keys,
    fibonacci_sphere,
    triangle_areas,
    triangle_keys,
    weld,
)
from dermis.mesh.mesh import Material, Mesh, build_mesh

_MAX_FLAT_FRACTION = 0.5
"""Fraction of triangles without area above which a mesh is refused instead of repaired [-]."""
_MAX_NON_MANIFOLD_EDGES = 100_000
"""Number of non-manifold edges above which a mesh is refused instead of repaired."""
_MAX_TRIANGLES_PER_EDGE = 8
"""An edge with more triangles is cut open, without a search for surfaces that continue across the edge."""
_MIN_MEAN_CONVEXITY_COSINE = -0.05
"""Limit of the mean cosine between a component's normals and the directions from its centroid [-]. If the
mean cosine is smaller, the component may be inside out."""
_MAX_COSINE_OF_OPPOSITE_NORMALS = -0.5
"""Limit of a component's mean cosine between the normals in the file and the normals of the triangles [-]. If
the mean cosine is smaller, the two kinds of normals count as opposite."""
_MIN_VISIBILITY_BALANCE = 0.25
"""Limit of the absolute value of the number that `visible_sides` returns for a component [-]. If the absolute
value is larger, the more visible side of the component counts as its outer side."""
_MIN_VISIBLE_SAMPLES = 8
_MIN_VIEW_COSINE = 0.05  # smallest cosine of normal and view; surfaces seen at grazing angles do not count
_MIN_VISIBLE_FRACTION = 0.02  # smallest ratio of visible samples to those visible without other components
_VIEW_COUNT, _CELLS_PER_VIEW_SIDE = 20, 64  # views from outside, and cells along a side of each view
_VISIBILITY_SAMPLE_COUNT = 120_000  # points on the mesh whose visibility is tested
_DOUBTFUL_SAMPLE_FRACTION = 0.25  # reserved for components that may be inside out
_MAX_UV_EXCESS = 0.02
"""Largest distance outside [0, 1] at which uv are still clamped to [0, 1] [-]."""
_UNLIMITED_UV_PERIOD = 1e9
_UV_PERIOD_OF_WRAP: dict[Wrap, float] = {"repeat": 1.0, "mirror": 2.0, "clamp": _UNLIMITED_UV_PERIOD}


@dataclass(frozen=True)
class RawMesh:
    """Triangles of a file in the head's space, before they become a `Mesh`.

    Vertices that differ only in uv or normal lie at the same point, where the triangles are connected.

    positions : (v, 3) vertex positions [mm]
    normals : (v, 3) normals of the file, NaN where the file has none
    uv : (v, 2) uv with v down
    point : (v,) index of the point at which each vertex lies
    triangles : (f, 3) vertex indices
    material : (f,) material index of each triangle
    quads : (q, 2) pairs of triangles that are the halves of a quad
    vertices : mesh part with the same vertices in the file's space, with their morph targets and bones
    file_vertex : (v,) index of the file's vertex from which each vertex was made; vertices of the file that
        no triangle uses are not counted
    """

    positions: Floats
    normals: Doubles
    uv: Floats
    point: Ints
    triangles: Index
    material: Ints
    quads: Index
    vertices: MeshPart
    file_vertex: Index

    def build_mesh(self, materials: tuple[Material, ...]) -> Mesh:
        """Build a `Mesh` from these arrays.

        The indices in `point` are kept. Normals that are not unit vectors, such as NaN, are replaced by
        computed ones.

        materials : materials to which the indices in `material` refer
        """
        arrays = self.positions, self.uv, self.triangles, self.material
        return build_mesh(*arrays, materials, self.normals, self.point, self.quads)

    @cached_property
    def corner_points(self) -> Index:
        """Return the point index at each corner of the triangles, (f, 3)."""
        return self.point[self.triangles].astype(np.int64)

    @cached_property
    def sides(self) -> _Sides:
        """Return the sides of the triangles, grouped by edge."""
        return _group_sides(self.corner_points)

    def with_triangles(self, triangle_mask: Mask) -> RawMesh:
        """Return the mesh with only those triangles that a mask (f,) selects."""
        quads = (np.cumsum(triangle_mask) - 1)[self.quads[triangle_mask[self.quads].all(axis=1)]]
        return replace(
            self, triangles=self.triangles[triangle_mask], material=self.material[triangle_mask], quads=quads
        )

    def with_corner_points(self, corner_points: Index) -> RawMesh:
        """Return the mesh with new point indices at the corners of triangles.

        A vertex whose corners lie at several points is duplicated, once for each of these points.

        corner_points : (f, 3) new point index at each corner
        """
        triangles, stride = self.triangles.copy(), int(corner_points.max()) + 1
        moved = corner_points != self.point[triangles]
        copies, number = np.unique(triangles[moved] * stride + corner_points[moved], return_inverse=True)
        triangles[moved] = len(self.point) + number.reshape(-1)
        source = np.concatenate((np.arange(len(self.point)), copies // stride))
        point = np.concatenate((self.point, copies % stride)).astype(np.int32)
        return replace(self._select_vertices(source), point=point, triangles=triangles)

    def without_unused_points(self) -> RawMesh:
        """Return the mesh without unused vertices and points.

        Pairs of triangles that no longer share two vertices are removed from `quads`.
        """
        used, triangles = compact_vertices(self.triangles)
        point = np.unique(self.point[used], return_inverse=True)[1].reshape(-1).astype(np.int32)
        first, second = triangles[self.quads[:, 0]], triangles[self.quads[:, 1]]
        whole = (first[:, [0, 2]] == second[:, [2, 0]]).all(axis=1)
        return replace(self._select_vertices(used), point=point, triangles=triangles, quads=self.quads[whole])

    def _select_vertices(self, vertex_index: Index) -> RawMesh:
        """Return the mesh with the vertices at the given indices (n,); points and triangles are unchanged."""
        return replace(
            self,
            positions=self.positions[vertex_index],
            normals=self.normals[vertex_index],
            uv=self.uv[vertex_index],
            vertices=select_vertices(self.vertices, vertex_index),
            file_vertex=self.file_vertex[vertex_index],
        )


def repair_mesh(
    mesh: RawMesh, materials: Sequence[FileMaterial | None], is_skin: Mask
) -> tuple[RawMesh, tuple[str, ...]]:
    """Return a mesh without the faults that can be repaired, and a note on each fault.

    Degenerate and repeated triangles are dropped. Sheets of the surface that meet at non-manifold edges
    (shared by more than two triangles) are separated. Connected components that are wound inside out are
    reversed, and inward normals are turned outwards. uv slightly outside [0, 1] are clamped, and uv charts in
    other tiles are moved to [0, 1]. A mesh without faults is returned unchanged.

    materials : for each material of the mesh, its description in the file; None for a material without
        description
    is_skin : (m,) mask of the materials that are skin
    """
    notes: list[str] = []
    flat = flat_triangles(mesh.positions, mesh.triangles)
    if flat.mean() > _MAX_FLAT_FRACTION:
        return mesh, ()
    repaired = _turn_outwards(_separate_sheets(_drop_triangles(mesh, flat, is_skin, notes), notes), notes)
    return _move_uv_charts(
        repaired if repaired is mesh else repaired.without_unused_points(), materials, notes
    ), tuple(notes)


def _count_with_noun(item_count: int, noun: str) -> str:
    return f"{item_count:,} {noun}{'' if item_count == 1 else 's'}"


def _drop_triangles(mesh: RawMesh, flat_mask: Mask, is_skin: Mask, notes: list[str]) -> RawMesh:
    """Return the mesh without duplicate triangles and without flat triangles.

    Among triangles of one material with the same three points, the first is kept. Among materials with
    exactly the same triangles, skin is kept, or else the first material.

    flat_mask : (f,) mask of flat triangles
    is_skin : (m,) mask of the materials that are skin
    notes : list to which this function appends a note on the removed triangles
    """
    if flat_mask.any():
        notes.append(f"left out {_count_with_noun(int(flat_mask.sum()), 'triangle')} without area")
        mesh = mesh.with_triangles(~flat_mask)
    key = triangle_keys(mesh.corner_points, int(mesh.point.max()) + 1)
    ordered = np.sort(key)
    if (ordered[1:] == ordered[:-1]).any():
        order = np.lexsort((np.arange(len(key)), mesh.material, key))
        again = (key[order][1:] == key[order][:-1]) & (np.diff(mesh.material[order]) == 0)
        kept = np.ones(len(key), bool)
        kept[order[1:][again]] = False
        kept &= ~_duplicate_materials(key[kept], mesh.material[kept], is_skin)[mesh.material]
        if not kept.all():
            notes.append(f"left out {_count_with_noun(int((~kept).sum()), 'triangle')} that repeat others")
            mesh = mesh.with_triangles(kept)
    return mesh


def _duplicate_materials(triangle_key: Index, material: Ints, is_skin: Mask) -> Mask:
    """Return the mask (m,) of materials to drop, because a kept material has exactly the same triangles.

    triangle_key : (f,) number that is equal for triangles with the same three points, see `triangle_keys`
    material : (f,) material index of each triangle
    is_skin : (m,) mask of the materials that are skin, which are kept in preference to others
    """
    ends = np.cumsum(np.bincount(material, minlength=len(is_skin)))
    triangles = np.split(triangle_key[np.lexsort((triangle_key, material))], ends[:-1])
    is_duplicate, seen = np.zeros(len(is_skin), bool), {b""}
    for index in np.argsort(~is_skin, kind="stable"):
        content = triangles[index].tobytes()
        is_duplicate[index] = content in seen
        seen.add(content)
    return is_duplicate


class _Sides(NamedTuple):
    """Sides of triangles, grouped by the edge that they share.

    Side 3 t + k runs from corner k of triangle t to the next corner.

    side : (3f,) sides, ordered by edge
    first : (e,) index in `side` of the first side of each edge
    counts : (e,) number of sides of each edge
    start : (3f,) index of the point at which each side starts
    end : (3f,) index of the point at which each side ends
    """

    side: Index
    first: Index
    counts: Index
    start: Index
    end: Index

    @property
    def manifold_pairs(self) -> Index:
        """Return the two sides of each edge that has exactly two triangles, (n, 2)."""
        first = self.first[self.counts == 2]
        return np.column_stack((self.side[first], self.side[first + 1]))


def _group_sides(corner_points: Index) -> _Sides:
    start, end = corner_points.ravel(), corner_points[:, [1, 2, 0]].ravel()
    key = edge_keys(corner_points).ravel()
    side = np.argsort(key)
    ordered = key[side]
    first = np.flatnonzero(np.concatenate(([True], ordered[1:] != ordered[:-1])))
    return _Sides(side, first, np.diff(first, append=len(key)), start, end)


def _label_components(node_count: int, node_pairs: NDArray[np.integer]) -> Index:
    """Return the index (node_count,) of the connected component of each node of a graph.

    node_pairs : (n, 2) nodes at the ends of each link
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array(
        (np.ones(len(node_pairs), bool), (node_pairs[:, 0], node_pairs[:, 1])), shape=(node_count, node_count)
    )
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _separate_sheets(mesh: RawMesh, notes: list[str]) -> RawMesh:
    """Return the mesh with separate points for sheets that meet at non-manifold edges.

    A sheet is one of the surfaces that meet at such an edge.

    notes : list to which this function appends a note on the separated sheets
    """
    count = int((mesh.sides.counts > 2).sum())
    if not 0 < count <= _MAX_NON_MANIFOLD_EDGES:
        return mesh
    notes.append(
        f"separated the sheets that meet at {_count_with_noun(count, 'edge')} of more than two triangles"
    )
    links = np.vstack((mesh.sides.manifold_pairs, _pair_continuing_sides(mesh)))
    mesh = mesh.with_corner_points(_split_points(mesh, links))
    sides = mesh.sides
    if (sides.counts > 2).any():  # sheets that are also connected around both ends of an edge
        kept = np.zeros(len(sides.side), bool)
        kept[sides.side[sides.first[sides.counts == 1]]] = True
        kept[np.concatenate((sides.manifold_pairs, _pair_continuing_sides(mesh, max_pairs_per_edge=1)))] = (
            True
        )
        apart, corners = ~kept.reshape(-1, 3).all(axis=1), mesh.corner_points.copy()
        corners[apart] = corners.max() + 1 + np.arange(3 * int(apart.sum())).reshape(-1, 3)
        mesh = mesh.with_corner_points(corners)
    return mesh


def _pair_continuing_sides(mesh: RawMesh, max_pairs_per_edge: int = _MAX_TRIANGLES_PER_EDGE // 2) -> Index:
    """Return pairs of triangle sides (n, 2) across which a surface continues at non-manifold edges.

    The pairs of an edge are chosen one after another. Two sides of the same material are preferred, then two
    sides that run in opposite directions, then two sides whose triangles are closest to a common plane.
    After the first pair of an edge, only sides that run in opposite directions are paired.

    max_pairs_per_edge : largest number of pairs at an edge
    """
    sides, material = mesh.sides, mesh.material
    crowded = np.flatnonzero((sides.counts > 2) & (sides.counts <= _MAX_TRIANGLES_PER_EDGE))
    count = sides.counts[crowded, None]
    column = np.arange(int(count.max(initial=0)))
    table = np.where(
        column < count, sides.side[sides.first[crowded, None] + np.minimum(column, count - 1)], -1
    )
    table = -np.sort(-table, axis=1)
    inwards = _directions_from_sides(mesh, table)
    forward, component = (
        sides.start < sides.end,
        _label_components(len(mesh.triangles), sides.manifold_pairs // 3),
    )
    found = [np.empty((0, 2), np.int64)]
    for turn in range(max_pairs_per_edge):
        best, chosen = np.full(len(table), np.inf), np.zeros((len(table), 2), np.int64)
        for a, b in combinations(range(len(column)), 2):
            row = np.flatnonzero((table[:, a] >= 0) & (table[:, b] >= 0))
            one, two = table[row, a], table[row, b]
            cost = (inwards[row, a] * inwards[row, b]).sum(axis=1)
            cost += 0.5 * (component[one // 3] != component[two // 3]) + 8 * (
                material[one // 3] != material[two // 3]
            )
            cost += np.where(forward[one] == forward[two], np.inf if turn else 4, 0)
            better = cost < best[row]
            best[row[better]], chosen[row[better]] = cost[better], (a, b)
        row = np.flatnonzero(best < np.inf)
        found.append(np.column_stack((table[row, chosen[row, 0]], table[row, chosen[row, 1]])))
        table[row[:, None], chosen[row]] = -1
    return np.vstack(found)


def _directions_from_sides(mesh: RawMesh, sides: Index) -> Floats:
    """Return unit vectors (..., 3) from sides into their triangles, perpendicular to the sides.

    sides : (...) sides of triangles, see `_Sides`
    """
    p, q, r = (mesh.positions[np.roll(mesh.triangles, -k, axis=1).ravel()[sides]] for k in range(3))
    along, inwards = q - p, r - p
    scale = (inwards * along).sum(axis=-1) / (along * along).sum(axis=-1)
    inwards -= along * scale[..., None]
    return np.asarray(inwards / np.linalg.norm(inwards, axis=-1, keepdims=True))


def _split_points(mesh: RawMesh, side_pairs: Index) -> Index:
    """Split points at non-manifold edges; return the new point index at each corner, (f, 3).

    The corners at a point are grouped: triangles that `side_pairs` connects around the point are in the same
    group. The largest group keeps the point, and each other group gets a new point.

    side_pairs : (n, 2) pairs of triangle sides that stay connected
    """
    sides, flat = mesh.sides, mesh.corner_points.ravel()
    crowded = sides.side[sides.first[sides.counts > 2]]
    busy = np.zeros(int(flat.max()) + 1, bool)
    busy[sides.start[crowded]] = busy[sides.end[crowded]] = True
    first, second = side_pairs.T  # the index of a side is also that of the corner at its start
    following = [3 * (one // 3) + (one + 1) % 3 for one in (first, second)]
    crossed = flat[first] != flat[second]
    ends = np.concatenate((first, following[0]))
    others = np.concatenate(
        (np.where(crossed, following[1], second), np.where(crossed, second, following[1]))
    )
    affected = np.flatnonzero(busy[flat])
    number = np.cumsum(busy[flat]) - 1
    used = busy[flat[ends]]
    fan = _label_components(len(affected), number[np.column_stack((ends[used], others[used]))])
    point = np.zeros(int(fan.max()) + 1, np.int64)
    point[fan] = flat[affected]
    order = np.lexsort((-np.bincount(fan), point))
    smaller = order[1:][point[order][1:] == point[order][:-1]]
    point[smaller] = len(busy) + np.arange(len(smaller))
    result = flat.copy()
    result[affected] = point[fan]
    return result.reshape(-1, 3)


def _turn_outwards(mesh: RawMesh, notes: list[str]) -> RawMesh:
    """Return the mesh with consistently wound triangles and outward normals.

    notes : list to which this function appends a note on the reversed triangles and normals
    """
    component, reverse = _components_and_reversals(mesh)
    x = np.ascontiguousarray(mesh.positions.T, np.float64)
    a, b, c = (x.take(one, axis=1) for one in np.ascontiguousarray(mesh.triangles.T))
    area = cross_columns(b - a, c - a) * np.where(reverse, -1.0, 1.0)
    surface = _ComponentSurface(component, area, np.stack((a, b, c)))
    agreement = surface.mean_cosine(_corner_normal_sums(mesh))
    doubtful = (surface.mean_cosine(surface.outward_directions()) < _MIN_MEAN_CONVEXITY_COSINE) | (
        agreement < _MAX_COSINE_OF_OPPOSITE_NORMALS
    )
    if doubtful.any():
        turned = _inside_out_components(surface, doubtful, agreement)
        reverse ^= turned[component]
        agreement[turned] *= -1
    if reverse.any():
        count = _count_with_noun(int(reverse.sum()), "triangle")
        notes.append(f"reversed {count} of {len(reverse):,} that are wound inside out")
        triangles = np.where(reverse[:, None], mesh.triangles[:, ::-1], mesh.triangles)
        mesh = replace(mesh, triangles=triangles)
    inwards = np.unique(mesh.triangles[(agreement < _MAX_COSINE_OF_OPPOSITE_NORMALS)[component]])
    if len(inwards):
        notes.append(f"turned {_count_with_noun(len(inwards), 'normal')} outwards")
        normals = mesh.normals.copy()
        normals[inwards] *= -1
        mesh = replace(mesh, normals=normals)
    return mesh


def _components_and_reversals(mesh: RawMesh) -> tuple[Index, Mask]:
    """Return each triangle's connected component (f,), and the mask (f,) of triangles to reverse.

    After reversal of these triangles, the winding of each component is consistent, and the same as before on
    most of its area. A component that cannot be wound consistently, such as a Moebius strip, is unchanged.
    """
    count, pairs = len(mesh.triangles), mesh.sides.manifold_pairs
    forward = mesh.sides.start < mesh.sides.end
    links = pairs // 3
    conflict = forward[pairs[:, 0]] == forward[pairs[:, 1]]
    if not conflict.any():
        return _label_components(count, links), np.zeros(count, bool)
    # graph with two nodes per triangle, one for each winding; edges connect consistent windings
    one, two = links.T
    first, second = np.concatenate((one, one + count)), np.concatenate((two, two + count))
    second = np.where(np.tile(conflict, 2), (second + count) % (2 * count), second)
    kept, reversed_ = _label_components(2 * count, np.column_stack((first, second))).reshape(2, -1)
    component = np.unique(np.minimum(kept, reversed_), return_inverse=True)[1].reshape(-1)
    reverse = kept > reversed_
    size = triangle_areas(mesh.positions[mesh.triangles])
    balance = np.bincount(component, np.where(reverse, size, -size))
    return component, reverse ^ ((balance > 0)[component] & (kept != reversed_))


def _corner_normal_sums(mesh: RawMesh) -> Doubles:
    """Return the sum (3, f) of the file's normals at the three corners of each triangle."""
    normals = np.where(np.isfinite(mesh.normals), mesh.normals, 0).T
    return np.asarray(sum(normals.take(one, axis=1) for one in np.ascontiguousarray(mesh.triangles.T)))


@dataclass(frozen=True)
class _ComponentSurface:
    """Triangles, and the connected component of each.

    component : (f,) index of each triangle's component
    area_normals : (3, f) normals with twice the triangle's area as their length [mm²]
    corners : (3, 3, f) positions of the corners; axes: corner, coordinate, triangle [mm]
    """

    component: Index
    area_normals: Doubles
    corners: Doubles

    @cached_property
    def double_area(self) -> Doubles:
        """Return twice the area of each triangle (f,) [mm²]."""
        return np.sqrt(dot_columns(self.area_normals, self.area_normals))

    def outward_directions(self) -> Doubles:
        """Return the vector (3, f) to each triangle from the centroid of its component."""
        centre = self.corners.mean(axis=0)
        total = np.maximum(np.bincount(self.component, self.double_area), np.finfo(np.float64).tiny)
        for axis in centre:
            axis -= (np.bincount(self.component, axis * self.double_area) / total)[self.component]
        centre[np.abs(centre) < 1e-6 * np.sqrt(self.double_area)] = 0  # rounding errors of single triangles
        return np.asarray(centre)

    def mean_cosine(self, direction: Doubles) -> Doubles:
        """Return, for each component, the mean cosine of the angle between its normals and given directions.

        direction : (3, f) direction for each triangle; a component whose directions are all zero gets 0
        """
        length = np.bincount(self.component, self.double_area * np.sqrt(dot_columns(direction, direction)))
        total = np.bincount(self.component, dot_columns(self.area_normals, direction))
        return total / np.where(length > 0, length, 1)

    def visible_sides(self, doubtful_components: Mask) -> tuple[Doubles, bool]:
        """Return which side of each component is visible from outside, and whether backs prevail overall.

        The first result is a number for each component: 1 if only its front is visible, -1 if only its back
        is visible, a number between -1 and 1 if both are visible, and 0 if hardly any of it is visible. The
        second result is whether, on the whole mesh, the backs of triangles are seen more than twice as often
        as their fronts.

        doubtful_components : mask of components that may be inside out; they get additional sample points
        """
        component_area = np.bincount(self.component, self.double_area)
        more = _DOUBTFUL_SAMPLE_FRACTION * doubtful_components / (component_area * doubtful_components.sum())
        triangle, sample = self._sample_triangles(
            self.double_area * ((1 - _DOUBTFUL_SAMPLE_FRACTION) / component_area.sum() + more[self.component])
        )
        normal, component = (
            self.area_normals[:, triangle] / self.double_area[triangle],
            self.component[triangle],
        )
        radius, seen = (
            float(np.sqrt(dot_columns(sample, sample).max())),
            np.zeros((2, len(component_area)), np.int64),
        )
        for view in fibonacci_sphere(_VIEW_COUNT):
            across = np.linalg.svd(view[None])[2][1:]
            cell = ((across @ sample / radius + 1) * (_CELLS_PER_VIEW_SIDE / 2)).astype(np.int64)
            nearest, order = (
                np.full((_CELLS_PER_VIEW_SIDE + 1, _CELLS_PER_VIEW_SIDE + 1), -1),
                np.argsort(view @ sample),
            )
            nearest[tuple(cell[:, order])] = order  # the last, nearest sample of a cell remains
            visible = nearest[nearest >= 0]
            cosine = view @ normal[:, visible]
            facings = cosine > _MIN_VIEW_COSINE, cosine < -_MIN_VIEW_COSINE
            for side, facing in zip(seen, facings, strict=True):
                side += np.bincount(component[visible[facing]], minlength=len(component_area))
        cells = (
            component_area / 8 * (_CELLS_PER_VIEW_SIDE / 2 / radius) ** 2
        )  # that a convex component would cover alone
        alone = _VIEW_COUNT * np.minimum(cells, np.bincount(component, minlength=len(component_area)) / 2)
        front, back = seen
        is_seen = front + back >= np.maximum(_MIN_VISIBLE_FRACTION * alone, _MIN_VISIBLE_SAMPLES)
        balance = np.where(is_seen, (front - back) / np.maximum(front + back, 1), 0)
        return balance, bool(back.sum() > 2 * front.sum())

    def _sample_triangles(self, triangle_weights: Doubles) -> tuple[Index, Doubles]:
        """Return random points on the triangles: index of the triangle (n,), and position (3, n) [mm].

        Positions are relative to the centre of the mesh.

        triangle_weights : (f,) relative probability of each triangle
        """
        total = np.cumsum(triangle_weights)
        triangle = np.searchsorted(
            total, (np.arange(_VISIBILITY_SAMPLE_COUNT) + 0.5) / _VISIBILITY_SAMPLE_COUNT * total[-1]
        )
        shares = np.sort(np.random.default_rng(0).random((2, _VISIBILITY_SAMPLE_COUNT)), axis=0)
        shares = np.diff(shares, axis=0, prepend=0, append=1)
        points = (self.corners[:, :, triangle] * shares[:, None]).sum(axis=0)
        return triangle, points - self.corners.mean(axis=(0, 2))[:, None]


def _inside_out_components(
    surface: _ComponentSurface, doubtful_components: Mask, normals_cosine: Doubles
) -> Mask:
    """Return the mask of connected components that are wound inside out.

    A component is inside out in any of these cases:

    1. Its back is the side that is mainly visible from outside.
    2. Neither side is mainly visible, and the file's normals point away from the triangles' normals.
    3. Neither side is visible at all, and most visible triangles of the whole mesh show their backs.

    surface : triangles of all components
    doubtful_components : mask of components that may be inside out
    normals_cosine : for each component, the mean cosine between the file's normals and the triangles' normals
    """
    balance, backs_prevail = surface.visible_sides(doubtful_components)
    opposed = (normals_cosine < _MAX_COSINE_OF_OPPOSITE_NORMALS) & (balance <= _MIN_VISIBILITY_BALANCE)
    return np.asarray((balance < -_MIN_VISIBILITY_BALANCE) | opposed | ((balance == 0) & backs_prevail))


def _move_uv_charts(mesh: RawMesh, materials: Sequence[FileMaterial | None], notes: list[str]) -> RawMesh:
    """Return the mesh with uv charts moved by whole tiles to [0, 1]; charts that do not fit stay in place.

    The uv of charts that fit are clamped to [0, 1].

    materials : for each material of the mesh, its description in the file, or None
    notes : list to which this function appends a note on the moved charts
    """
    if mesh.uv.min() >= -UV_TOLERANCE and mesh.uv.max() <= 1 + UV_TOLERANCE:
        return mesh
    place = weld(np.column_stack((mesh.point, mesh.uv)))
    corners = place[mesh.triangles]
    links = np.column_stack((corners.ravel(), np.roll(corners, -1, axis=1).ravel()))
    chart = _label_components(int(place.max()) + 1, links)[place]
    low, high = (np.full((int(chart.max()) + 1, 2), sign * np.inf) for sign in (1, -1))
    np.minimum.at(low, chart, mesh.uv)
    np.maximum.at(high, chart, mesh.uv)
    outside = (np.minimum(low, 1 - high) < -UV_TOLERANCE).any(axis=1, keepdims=True)
    shift, period = np.where(outside, np.floor((low + high) / 2), 0), np.ones((len(low), 2))
    periods = np.array([_uv_periods(material) for material in materials])
    np.maximum.at(period, chart[mesh.triangles[:, 0]], periods[mesh.material])
    shift = np.where(shift % period == 0, shift, 0)
    fits = (np.minimum(low - shift, 1 + shift - high) >= -_MAX_UV_EXCESS).all(axis=1, keepdims=True)
    shift = np.where(fits, shift, 0)
    moved = mesh.uv - shift[chart]
    clamped = np.where(fits[chart], np.clip(moved, 0, 1), moved)
    count, excess = int(shift.any(axis=1).sum()), float(np.abs(clamped - moved).max())
    if count:
        notes.append(
            f"moved {count:,} of {_count_with_noun(len(shift), 'uv chart')} by whole tiles into [0, 1]"
        )
    if excess > UV_TOLERANCE:
        notes.append(f"clamped uv that are up to {excess:.2g} outside the tile")
    return replace(mesh, uv=clamped.astype(np.float32))


def _uv_periods(material: FileMaterial | None) -> tuple[float, float]:
    """Return the number of tiles along u and v after which a material's pictures repeat."""
    periods = [(1.0, 1.0)]
    for texture in material.textures.values() if material else ():
        if texture.uv_mapping == (0, IDENTITY_UV_TRANSFORM):
            periods.append((_UV_PERIOD_OF_WRAP[texture.wrap[0]], _UV_PERIOD_OF_WRAP[texture.wrap[1]]))
        elif texture.uv_set == 0:
            periods.append((_UNLIMITED_UV_PERIOD, _UNLIMITED_UV_PERIOD))
    u, v = zip(*periods, strict=True)
    return max(u), max(v)
