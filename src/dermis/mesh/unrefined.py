"""The faces that a subdivided mesh comes from, between those of its vertices that were there before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.head import Head
from dermis.mesh.mesh import Floats, Ints
from dermis.mesh.quads import halves

Corners = NDArray[np.integer]


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
