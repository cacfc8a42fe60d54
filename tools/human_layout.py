"""uv layout of the human bust: the published cuts, flattened again with the most texels for the face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from dermis.atlas.unwrap.charts import smooth_charts
from dermis.atlas.unwrap.flatten import flatten, singular_values
from dermis.atlas.unwrap.seams import border_edges
from dermis.atlas.unwrap.unwrap import pack_charts
from dermis.mesh.geometry import split_quads

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

CHART_PADDING = 1 / 256
_CROWN_Z, _CROWN_SLOPE, _EAR_Y = 15.0, 0.25, 715.0  # seam over the crown of the mean person [mm]
_FILLING_WEIGHT = 0.05  # weight of the triangles that fill holes during flattening
FACE, SCALP, EARS, TRUNK, HIDDEN, PLAIN = 1.0, 0.35, 0.7, 0.26, 0.14, 0.06
"""Texels per mm relative to the face: face, back of the head, ears, neck and chest, mouth and eye sockets,
and parts that are not skin."""


def human_layout(
    points_mm: Doubles, quads: Index, published: Index, uv: Doubles, group: Index
) -> tuple[Doubles, Index]:
    """Return the (m, 2) uv, v down, and the (q, 4) uv corners of the quads.

    points_mm : (n, 3) points of the mean person [mm]
    quads : (q, 4) points, caps last
    published : (k, 4) uv corners of all quads but the caps, in the published layout
    uv : (v, 2) uv of the published layout, v up
    group : (q,) group of each quad, 0 for skin
    """
    published, uv = _with_seams(points_mm, quads[: len(published)], published, uv)
    corner = np.concatenate([published, len(uv) + _cap_corners(quads[len(published) :])])
    flat = np.zeros((int(corner.max()) + 1, 2))
    island = _islands(corner)
    pieces = list[Index]()
    for k in np.unique(island[corner[:, 0]]):
        own = np.flatnonzero(island[corner[:, 0]] == k)
        pieces.append(own)
        points = np.unique(corner[own])
        flat[points] = _flattened(points_mm, quads[own], corner[own], uv, int(group[own[0]]))[points]
    outlines = [flat[border_edges(split_quads(corner[own]))[0]] for own in pieces]
    scale, offset = pack_charts(outlines, CHART_PADDING)
    for own, move in zip(pieces, offset, strict=True):
        points = np.unique(corner[own])
        flat[points] = scale * flat[points] + move
    used, again = np.unique(corner, return_inverse=True)
    return flat[used] * [1, -1] + [0, 1], again.reshape(-1, 4)


def _flattened(points_mm: Doubles, quads: Index, corner: Index, uv: Doubles, group: int) -> Doubles:
    """Return the (v, 2) flattened corners of one island, y up [mm times density]."""
    made = np.zeros((int(corner.max()) + 1, 2))
    used, local = np.unique(corner, return_inverse=True)
    triangles = split_quads(local.reshape(-1, 4))
    points = np.zeros((len(used), 3))
    points[local.ravel()] = points_mm[quads.ravel()]
    middle = points[triangles].mean(axis=1)
    if group or middle[:, 2].min() > 40.0:  # parts that are not skin; mouth and sockets
        is_cap = used.max() >= len(uv)
        flat = points[:, [0, 2]] if is_cap else uv[used]  # the cap is seen from below
        stretch = np.median(singular_values(points[triangles], flat[triangles] * [1, -1]).prod(axis=1))
        made[used] = flat * (PLAIN if group else HIDDEN) / np.sqrt(abs(stretch))
        return made
    density = _head_density(middle) if middle[:, 1].max() > 800 else np.full(len(middle), TRUNK)
    filled, more = _filled(triangles, points)
    rest = len(filled) - len(triangles)
    weight = np.r_[np.ones(len(triangles)), np.full(rest, _FILLING_WEIGHT)]
    dense = np.r_[density, np.full(rest, float(np.max(density)))]
    made[used] = _upright(flatten(more, filled, dense, weight)[: len(used)], points)
    return made


def _with_seams(points_mm: Doubles, quads: Index, corner: Index, uv: Doubles) -> tuple[Index, Doubles]:
    """Return the uv corners and the uv, after an additional cut over the crown and behind the ears."""
    island, middle = _islands(corner)[corner[:, 0]], points_mm[quads].mean(axis=1)
    head = np.flatnonzero(island == island[middle[:, 1].argmax()])
    behind = middle[head, 2] < _CROWN_Z + _CROWN_SLOPE * (middle[head, 1] - _EAR_Y)
    behind = smooth_charts(np.repeat(behind, 2).astype(np.int64), split_quads(quads[head]))[::2] > 0
    far, made = head[behind], corner.copy()
    used, again = np.unique(made[far], return_inverse=True)
    made[far] = len(uv) + again.reshape(-1, 4)
    return made, np.vstack([uv, uv[used]])


def smooth_step(values: Doubles, low: float, high: float) -> Doubles:
    """Return a smooth step from 0 at `low` to 1 at `high`; decreasing if `low` is greater."""
    t: Doubles = np.clip((values - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _head_density(middle: Doubles) -> Doubles:
    """Return the (f,) texels per mm of the head's triangles with centres (f, 3) [mm]."""
    x, y, z = np.abs(middle[:, 0]), middle[:, 1], middle[:, 2]
    front = smooth_step(z, -10, 100) * smooth_step(y, 850, 790) * smooth_step(y, 600, 650)
    density = SCALP + (FACE - SCALP) * front
    ear = smooth_step(np.hypot(x - 75, (y - 715) / 1.6) + 0.5 * np.abs(z - 42), 45, 20)
    return np.asarray(np.maximum(density, EARS * ear))


def _filled(triangles: Index, points: Doubles) -> tuple[Index, Doubles]:
    """Return the triangles with each hole filled by a fan, and the points with the centres of the fans."""
    sides, _ = border_edges(triangles)
    _, loop = connected_components(
        coo_array((np.ones(len(sides)), sides.T), shape=(len(points),) * 2), directed=False
    )
    owner = loop[sides[:, 0]]
    length = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
    outer = np.bincount(owner, length).argmax()
    for k in np.setdiff1d(np.unique(owner), outer):
        around = sides[owner == k]
        middle = len(points)
        points = np.vstack([points, points[around[:, 0]].mean(axis=0)])
        fan = np.column_stack([around[:, ::-1], np.full(len(around), middle)])
        triangles = np.vstack([triangles, fan])
    return triangles, points


def _upright(flat: Doubles, points: Doubles) -> Doubles:
    """Return the flattened points rotated so that up in space is up."""
    z = (flat - flat.mean(axis=0)) @ [1, 1j]
    slope = (np.conj(z) * (points[:, 1] - points[:, 1].mean())).sum()
    z = z * slope / abs(slope) * 1j
    return np.column_stack([z.real, z.imag])


def _cap_corners(caps: Index) -> Index:
    """Return the uv corners of the caps: one corner for each of their points."""
    return np.unique(caps, return_inverse=True)[1].reshape(-1, 4) if len(caps) else caps


def _islands(corner: Index) -> Index:
    ends = np.concatenate([corner[:, [0, k]] for k in (1, 2, 3)])
    n = int(corner.max()) + 1
    return np.asarray(
        connected_components(coo_array((np.ones(len(ends)), ends.T), shape=(n, n)), directed=False)[1]
    )
