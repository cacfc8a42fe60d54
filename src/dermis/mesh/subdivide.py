"""Loop subdivision: four triangles for each, smoothed over the welded surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.mesh.geometry import Doubles, build_mesh, edges, sum_at
from dermis.mesh.mesh import Mesh

Index = NDArray[np.int64]

MAX_LEVELS = 3


def subdivide(mesh: Mesh, levels: int) -> Mesh:
    """The mesh refined `levels` times: positions smoothed, uv halved linearly, materials kept.

    Positions follow the welded points, so uv seams neither crack nor crease; open borders are smoothed
    as curves of their own. Normals and tangents are computed anew, normals of the file are given up.

    levels : 0 to 3, each takes four times the triangles

    Source: Loop, Smooth subdivision surfaces based on triangles, 1987, with Warren's weights.
    """
    if levels not in range(MAX_LEVELS + 1):
        refuse("subdivide", f"0 to {MAX_LEVELS} levels", f"{levels} came", "Each level takes 4x the memory")
    if levels == 0:
        return mesh
    uv = mesh.uv.astype(np.float64)
    point, triangles = mesh.point.astype(np.int64), mesh.triangles.astype(np.int64)
    places = np.zeros((int(point.max()) + 1, 3))
    places[point] = mesh.positions
    for _ in range(levels):
        places, uv, point, triangles = _refine(places, uv, point, triangles)
    material = np.repeat(mesh.material, 4**levels)
    return build_mesh(places[point], uv, triangles, material, mesh.materials, point=point)


def _refine(
    places: Doubles, uv: Doubles, point: Index, triangles: Index
) -> tuple[Doubles, Doubles, Index, Index]:
    """One level: places (p, 3), uv (v, 2), point (v,) and triangles (f, 3), all of the finer mesh."""
    welded = point[triangles]
    ends, of_side, counts = edges(welded)
    finer_places = np.vstack(
        (_old_points(places, ends, counts), _edge_points(places, welded, ends, of_side, counts))
    )
    cuts, cut_of_side, _ = edges(triangles)
    edge_of_cut = np.empty(len(cuts), dtype=np.int64)
    edge_of_cut[cut_of_side] = of_side
    finer_uv = np.vstack((uv, uv[cuts].mean(axis=1)))
    finer_point = np.concatenate((point, len(places) + edge_of_cut))
    return finer_places, finer_uv, finer_point, _quarter(triangles, len(uv) + cut_of_side)


def _quarter(triangles: Index, middle: Index) -> Index:
    """(4f, 3) three corner triangles and the middle one, the four of a triangle side by side."""
    a, b, c = triangles.T
    ab, bc, ca = middle.reshape(3, -1)
    four = np.array([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]])
    return np.ascontiguousarray(four.transpose(2, 0, 1).reshape(-1, 3))


def _edge_points(places: Doubles, welded: Index, ends: Index, of_side: Index, counts: Index) -> Doubles:
    """New point on each edge: 3/8 of its ends and 1/8 of the two corners across; the middle on a border."""
    middle = places[ends].mean(axis=1)
    across = sum_at(of_side, places[welded[:, [2, 0, 1]].T.ravel()], len(ends))
    inside = (counts == 2)[:, None]
    return np.asarray(np.where(inside, 0.75 * middle + across / 8, middle))


def _old_points(places: Doubles, ends: Index, counts: Index) -> Doubles:
    """Old points moved towards their neighbours; on a border only towards the two along it."""
    beta_sum, mean = _towards(places, ends)
    border = ends[counts != 2]
    on_border = np.bincount(border.ravel(), minlength=len(places))
    _, border_mean = _towards(places, border)
    moved = (1 - beta_sum) * places + beta_sum * mean
    along = 0.75 * places + 0.25 * border_mean
    # where borders meet, and where the surface is not one sheet, the point stays
    held = np.where((on_border == 2)[:, None], along, places)
    return np.asarray(np.where((on_border == 0)[:, None], moved, held))


def _towards(places: Doubles, ends: Index) -> tuple[Doubles, Doubles]:
    """Weight of all neighbours together (p, 1) by Warren, and the neighbours' mean (p, 3)."""
    both = np.concatenate((ends[:, 0], ends[:, 1]))
    other = np.concatenate((ends[:, 1], ends[:, 0]))
    valence = np.bincount(both, minlength=len(places)).astype(np.float64)[:, None]
    mean = sum_at(both, places[other], len(places)) / np.maximum(valence, 1)
    # 3/8 in all, 9/16 for valence 3; a point without neighbours stays
    weight = np.where(valence == 3, 9 / 16, np.where(valence > 0, 3 / 8, 0))
    return weight, mean
