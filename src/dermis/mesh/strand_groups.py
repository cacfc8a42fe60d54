"""Strands of a head for exports: named groups, reduction of knots, and displacements by morph targets."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Index, Intp
from dermis.mesh.grown_strands import MAX_EXPORTED_STRANDS, grow_strands, is_beard
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, Strands, quad_weights, root_frames

KNOT_COUNTS = 4, 5, 6, 8, 10, 13, 17, 22, 30, 40
"""Possible numbers of knots of exported hairs."""
SCALP_HAIR = "hair"
"""Name of the group that does not move with expressions."""
_SAMPLE_COUNT = 2000  # strands from which the deviation is estimated


def strand_groups(head: Head, max_grown_strands: int = MAX_EXPORTED_STRANDS) -> dict[str, Strands]:
    """Return the visible strands of a head in the groups "brows", "lashes", "beard" and "hair".

    Groups without strands are left out.

    max_grown_strands : largest number of strands of beard and hair, see `grow_strands`
    """
    groups = dict[str, Strands]()
    if (fine := head.strands) is not None:
        is_lash = np.zeros(len(fine), bool) if fine.is_lash is None else fine.is_lash
        groups |= {"brows": fine.select(~is_lash), "lashes": fine.select(is_lash)}
    if head.hair is not None:
        grown = grow_strands(head.hair, head.mesh, head.mesh.points_mm, max_grown_strands)
        beard = is_beard(head.hair, max_grown_strands)
        groups |= {"beard": grown.select(beard), SCALP_HAIR: grown.select(~beard).without_hidden}
    return {name: strands for name, strands in groups.items() if len(strands)}


def sufficient_knots(strands: Strands, max_deviation_mm: float, max_count: int) -> Intp:
    """Return the indices of the fewest knots through which polylines stay close to the strands.

    max_deviation_mm : largest distance of nine tenths of all knots from the polylines [mm]
    max_count : largest number of kept knots, which limits the number even if the deviation is larger
    """
    last = strands.knots_mm.shape[1] - 1
    sample = strands.knots_mm[:_SAMPLE_COUNT].astype(np.float64)
    for count in (one for one in KNOT_COUNTS if one <= max_count):
        knot = np.unique(np.rint(np.linspace(0, last, count)).astype(int))
        if _deviation_mm(sample, knot) < max_deviation_mm:
            break
    return knot


def _deviation_mm(knots_mm: Doubles, kept: Intp) -> float:
    """Return the 90th percentile of the distances of knots from polylines through some of them [mm].

    knots_mm : (n, k, 3) knots of hairs
    kept : indices of the knots through which the polylines run
    """
    place = np.interp(np.arange(knots_mm.shape[1]), kept, np.arange(len(kept)))
    first = np.minimum(place.astype(int), len(kept) - 2)
    part = (place - first)[:, None]
    on_line = (1.0 - part) * knots_mm[:, kept[first]] + part * knots_mm[:, kept[first + 1]]
    return float(np.percentile(np.linalg.norm(knots_mm - on_line, axis=-1), 90.0))


def root_vertices(mesh: Mesh, roots: Roots) -> Intp:
    """Return the index of the vertex nearest to each of n roots, (n,)."""
    nearest = quad_weights(roots.position).argmax(axis=1)
    first, second = mesh.quads[roots.quad].T
    corners = np.column_stack([mesh.triangles[first], mesh.triangles[second, 1]])
    return np.asarray(corners[np.arange(len(corners)), nearest], np.intp)


def moved_strands(
    mesh: Mesh, roots: Roots, offsets_mm: Doubles, points_mm: Doubles, delta_mm: Doubles, threshold_mm: float
) -> tuple[Index, Doubles]:
    """Return which of n strands move when the skin is displaced, and the displacements of their points.

    These are the indices (k,) of k strands, and the displacements (k, m, 3) of m points of each [mm].

    mesh, roots : skin, and the roots of the strands on it
    offsets_mm : (n, m, 3) points of each strand in the frame of its root, see `root_frames`
    points_mm, delta_mm : (p, 3) points of the skin at rest, and their displacements
    threshold_mm : displacement below which a strand is left out [mm]
    """
    first, second = mesh.quads[roots.quad].T
    corners = mesh.point[np.column_stack([mesh.triangles[first], mesh.triangles[second]])]
    strand = np.flatnonzero((np.abs(delta_mm).max(axis=1) > 0)[corners].any(axis=1))
    near = Roots(roots.quad[strand], roots.position[strand])
    (before, rest), (after, frame) = (
        root_frames(mesh, near, points) for points in (points_mm, points_mm + delta_mm)
    )
    delta = (after - before)[:, None] + np.einsum("nic,nki->nkc", frame - rest, offsets_mm[strand])
    moving = np.flatnonzero(np.abs(delta).max(axis=(1, 2), initial=0.0) >= threshold_mm)
    return strand[moving], delta[moving]
