"""What texels show, and how far runs of texels go without a gap on the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import cross, texels_in

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

_WELL = 1e-3  # texels this far from an edge are on no other triangle that only shares it


def fill(places: Doubles, triangles: Index, owner: NDArray[np.int32]) -> None:
    """Write the number of each triangle into the texels whose centre lies in it; later ones win.

    places : (f, 3, 2) corners [texel]
    triangles : those to be drawn
    owner : (h, w) is written to
    """
    texel, which = texels_in(places[triangles], owner.shape)
    owner.ravel()[texel] = triangles[which]


def lost(places: Doubles, triangles: Index, owner: NDArray[np.int32]) -> Flags:
    """Triangles (f,) most of whose texels are owned by others; arguments as for `fill`."""
    texel, which = texels_in(places[triangles], owner.shape, _WELL)
    drawn, count = triangles[which], len(places)
    inside, owned = (
        np.bincount(one, minlength=count) for one in (drawn, drawn[owner.ravel()[texel] == drawn])
    )
    return np.asarray(owned < 0.5 * inside)


def weigh(places: Doubles, owner: NDArray[np.int32], weights: Singles) -> None:
    """Fill weights (h, w, 2) of the second and third corner at the centre of each texel that has an owner."""
    first, second, third = np.moveaxis(places, 1, 0)
    e1, e2 = second - first, third - first
    area = cross(e1, e2)
    area = np.where(area == 0, 1.0, area)
    y, x = np.nonzero(owner >= 0)
    f = owner[y, x]
    qx, qy = x - first[f, 0], y - first[f, 1]
    e1, e2 = e1 / area[:, None], e2 / area[:, None]
    b = np.clip(qx * e2[f, 1] - qy * e2[f, 0], 0.0, 1.0)
    c = np.clip(qy * e1[f, 0] - qx * e1[f, 1], 0.0, 1.0)
    total = np.maximum(b + c, 1.0)
    weights[y, x, 0], weights[y, x, 1] = b / total, c / total


def read(triangle: NDArray[np.int32], weights: Singles, corners: Doubles, values: Singles) -> None:
    """Fill values (h, w, c) with what triangles have at their corners (f, 3, c), where there is one."""
    there = triangle >= 0
    f, (second, third) = triangle[there], weights[there].T
    singles = corners.astype(np.float32)
    shares = (1.0 - second - third, second, third)
    values[there] = sum(share[:, None] * singles[:, k][f] for k, share in enumerate(shares))


def runs(
    chart: NDArray[np.int32],
    points: Singles,
    roots: Singles,
    metric: Singles,
    steps: float,
    slack_mm: float,
    reach: NDArray[np.uint16],
) -> None:
    """Fill reach (h, w, 4): texels to the left, right, up and down of the same chart without a gap.

    points : (h, w, 3) what each texel shows [mm]
    roots : (h, w, 2) nearest place on its chart [texel]
    metric : (h, w, 3) texels per mm along u and v, and a third number
    steps, slack_mm : neighbours have a gap between them if their points are farther apart than so many of
        their steps on the surface plus the slack, and their roots farther apart than either texel is from its
        root
    """
    y, x = np.indices(chart.shape, np.float32)
    away2 = (roots[..., 0] - x) ** 2 + (roots[..., 1] - y) ** 2
    for axis, first in ((1, 0), (0, 2)):
        grids = chart, points, roots, metric[..., 1 - axis], away2
        rows = _Rows._make(np.moveaxis(grid, axis, 1) for grid in grids)
        before, after = _lengths(_joined(rows, steps, slack_mm))
        reach[..., first], reach[..., first + 1] = (np.moveaxis(one, 1, axis) for one in (before, after))


class _Rows(NamedTuple):
    """What `runs` is given, in rows along which runs go.

    density : texels per mm along the row
    away2 : squared distance of each texel from its root
    """

    chart: NDArray[np.int32]
    points: Singles
    roots: Singles
    density: Singles
    away2: Singles


def _joined(rows: _Rows, steps: float, slack_mm: float) -> Flags:
    """(h, w) whether each texel goes on where the one before it in its row ends."""
    chart, points, roots, density, away2 = rows
    here, before = np.s_[:, 1:], np.s_[:, :-1]
    joined = np.zeros(chart.shape, np.bool_)
    joined[here] = (chart[here] >= 0) & (chart[here] == chart[before])
    step = points[here] - points[before]
    limit = steps / np.maximum(np.minimum(density[here], density[before]), 1e-6) + slack_mm
    y, x = np.nonzero(joined[here] & (np.einsum("yxc,yxc->yx", step, step) > limit**2))
    apart2 = ((roots[y, x + 1] - roots[y, x]) ** 2).sum(axis=1)
    gap = apart2 > np.maximum(away2[y, x], away2[y, x + 1])
    joined[y[gap], x[gap] + 1] = False
    return joined


def _lengths(joined: Flags) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """How many texels of each row are joined before each, and after it."""
    after = np.zeros_like(joined)
    after[:, :-1] = joined[:, 1:]
    return _before(joined), _before(after[:, ::-1])[:, ::-1]


def _before(joined: Flags) -> NDArray[np.int32]:
    index = np.arange(joined.shape[1], dtype=np.int32)
    return index - np.maximum.accumulate(np.where(joined, 0, index), axis=1)
