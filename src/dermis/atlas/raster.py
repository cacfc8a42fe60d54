"""Rasterised uv layouts: charts that texture space can hold, and the triangles of texels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER, MOST_SHEAR, Atlas
from dermis.base.arrays import Doubles, Ints
from dermis.mesh.geometry import MIN_UV_CROSS, components, edges, uv_cross, weld
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
_EDGE = 1e-6  # texels this near outside an edge count as on it
_LEAST_TEXELS = 4.0  # a chart with less uv area than this holds nothing that could be blurred


def charts(mesh: Mesh) -> Ints:
    """Chart of each triangle (f,), counted from 0: triangles that share an edge in space and in uv."""
    # by place and uv, not by corner vertex: a vertex split for its normal only does not cut a chart
    corner = weld(np.hstack((mesh.positions, mesh.uv)))
    _, of_side, _ = edges(corner[mesh.triangles])
    faces = np.tile(np.arange(len(mesh.triangles)), 3)
    order = np.argsort(of_side, kind="stable")
    shared = of_side[order][1:] == of_side[order][:-1]
    a, b = faces[order][:-1][shared], faces[order][1:][shared]
    return components(len(mesh.triangles), a, b).astype(np.int32)


def triangle_uv_area(mesh: Mesh) -> Doubles:
    """Unsigned uv area of each triangle (f,), 1 being the whole map."""
    return np.asarray(np.abs(uv_cross(mesh.uv[mesh.triangles])) / 2)


def chart_uv_area(mesh: Mesh, chart: Ints) -> Doubles:
    """Unsigned uv area of each chart (c,), 1 being the whole map.

    chart : (f,) from `charts`
    """
    return np.asarray(np.bincount(chart, weights=triangle_uv_area(mesh)), dtype=np.float64)


def usable(mesh: Mesh, atlas: int, min_texels: float = 4.0) -> NDArray[np.bool_]:
    """Whether each triangle (f,) can be processed in texture space.

    False for triangles without uv area and for all triangles of a chart that is collapsed.

    atlas : width and height of the square map [texels]
    min_texels : a chart whose whole uv area is below this is collapsed [texels]
    """
    chart = charts(mesh)
    roomy = chart_uv_area(mesh, chart) * atlas**2 >= min_texels
    return np.asarray(roomy[chart] & (2 * triangle_uv_area(mesh) > MIN_UV_CROSS))


def texel_corners(mesh: Mesh, size: int, triangle: NDArray[np.integer]) -> Floats:
    """(t, 3, 2) uv corners in texels, whole numbers at texel centres."""
    return np.asarray(mesh.uv[mesh.triangles[triangle]].astype(np.float64) * size - 0.5)


def rasterise(mesh: Mesh, size: int, triangle: NDArray[np.integer]) -> tuple[Index, Index]:
    """Texels whose centre lies in a triangle, as (flat texel index, triangle), by spans of rows."""
    texel, which = texels_in(texel_corners(mesh, size, triangle), (size, size))
    return texel, triangle[which].astype(np.int64)


def texels_in(p: Floats, shape: tuple[int, int], margin: float = -_EDGE) -> tuple[Index, Index]:
    """Texels of a grid (h, w) whose centre lies in a triangle: flat index, and which triangle (t,).

    p : (t, 3, 2) corners [texel], whole numbers at texel centres
    margin : how far inside its edges along rows and columns they have to be [texel]
    """
    height, width = shape
    low, high = (least(least(p[:, 0, 1], p[:, 1, 1]), p[:, 2, 1]) for least in (np.minimum, np.maximum))
    top, bottom = _inside(low, high, height, margin)
    which, y = expand(top, np.maximum(bottom - top + 1, 0))
    left, right = _inside(*_span(p, which, y), width, margin)
    span, x = expand(left, np.maximum(right - left + 1, 0))
    return y[span] * width + x, which[span]


def _inside(low: Floats, high: Floats, size: int, margin: float) -> tuple[Index, Index]:
    """First and last whole number between two bounds, within 0 .. size - 1."""
    first = np.clip(np.ceil(low + margin), 0, size).astype(np.int64)
    return first, np.clip(np.floor(high - margin), -1, size - 1).astype(np.int64)


def expand(first: Index, count: Index) -> tuple[Index, Index]:
    """Each run first, first + 1, ... of `count` numbers, with the index of the run it belongs to."""
    which = np.repeat(np.arange(len(count)), count)
    start = np.repeat(np.cumsum(count) - count, count)
    return which, np.arange(len(which)) - start + first[which]


def _span(p: Floats, which: Index, y: Index) -> tuple[Floats, Floats]:
    """Where each row y enters and leaves its triangle."""
    lowest = np.full(len(y), -np.inf)
    highest = np.full(len(y), np.inf)
    sign = np.where(cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) >= 0, 1.0, -1.0)[:, None]
    edge = np.roll(p, -1, axis=1) - p
    # inside: cross(edge, q - a) * sign >= 0, linear in q.x with slope -edge.y * sign
    slopes, across = -edge[..., 1] * sign, edge[..., 0] * sign
    levels = edge[..., 1] * p[..., 0] * sign - across * p[..., 1]
    for k in range(3):
        slope, level = slopes[which, k], levels[which, k] + across[which, k] * y
        crossing = -level / np.where(slope == 0, 1.0, slope)
        np.maximum(lowest, crossing, out=lowest, where=slope > 0)
        np.minimum(highest, crossing, out=highest, where=slope < 0)
        highest[(slope == 0) & (level < 0)] = -np.inf
    return np.where(np.isfinite(lowest), lowest, 1.0), np.where(np.isfinite(highest), highest, 0.0)


def cross(a: Floats, b: Floats) -> Floats:
    """z of the cross product of (..., 2) vectors."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def build_own_layout(mesh: Mesh, size: int) -> Atlas:
    """The atlas whose texels are those of the mesh's own maps."""
    chart = charts(mesh)
    skin = np.array([material.kind == "skin" for material in mesh.materials])
    fit = usable(mesh, size, _LEAST_TEXELS) & skin[mesh.material]
    texel, triangle = rasterise(mesh, size, np.flatnonzero(fit))
    mapped = fit & ~_overlapped(chart, texel, triangle, size)
    owner, lost = _owners(mesh, mapped, texel, triangle, size)
    mapped &= ~lost
    for _ in range(GUTTER):
        owner = _dilate(owner)
    mapped &= _readable(mesh, size, owner)
    barycentric = _barycentric(mesh, size, owner)
    chart_map = np.where(owner >= 0, chart[np.maximum(owner, 0)], -1)
    stretch, shear = _metric(mesh, size, owner, barycentric)
    place = mesh.uv[mesh.triangles]
    none = np.zeros((0, 2), np.uint16)
    return Atlas(
        triangle=owner,
        barycentric=barycentric,
        stretch=stretch,
        shear=shear,
        reach=_reach(chart_map),
        place=place,
        gutter=none,
        source=none.astype(np.float32),
        beyond=none,
        root=np.zeros(0, np.int32),
        root_weight=none,
        per_uv=np.full(len(place), size, np.float32),
        mapped=mapped,
    )


def _overlapped(
    chart: NDArray[np.integer], texel: NDArray[np.int64], triangle: NDArray[np.int64], size: int
) -> NDArray[np.bool_]:
    """Triangles of charts most of whose texels a larger chart covers too."""
    count = int(chart.max()) + 1
    area = np.bincount(chart[triangle], minlength=count)
    order = np.argsort(area[chart[triangle]], kind="stable")  # the largest chart writes last and wins
    winner = np.full(size * size, -1, dtype=np.int64)
    winner[texel[order]] = chart[triangle[order]]
    own = np.bincount(chart[triangle][winner[texel] == chart[triangle]], minlength=count)
    lost: NDArray[np.bool_] = own < 0.5 * np.maximum(area, 1)
    return np.asarray(lost[chart])


def _owners(
    mesh: Mesh, mapped: NDArray[np.bool_], texel: NDArray[np.int64], triangle: NDArray[np.int64], size: int
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The triangle of each texel, and the triangles that lose most of theirs to others of their own chart.

    Two mirrored halves folded onto each other are one chart: the half that is not mirrored in uv wins.
    """
    keep = mapped[triangle]
    texel, triangle = texel[keep], triangle[keep]
    order = np.argsort(uv_cross(mesh.uv[mesh.triangles])[triangle] < 0, kind="stable")
    owner: NDArray[np.int32] = np.full((size, size), -1, dtype=np.int32)
    owner.ravel()[texel[order]] = triangle[order]
    count = len(mapped)
    area = np.bincount(triangle, minlength=count)
    own = np.bincount(triangle[owner.ravel()[texel] == triangle], minlength=count)
    return owner, own < 0.5 * area


def _dilate(owner: NDArray[np.int32]) -> NDArray[np.int32]:
    """Empty texels take the owner of one of their eight neighbours, straight ones first."""
    grown = owner.copy()
    padded = np.pad(owner, 1, constant_values=-1)
    n = len(owner)
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        neighbour = padded[1 + dy : 1 + dy + n, 1 + dx : 1 + dx + n]
        np.copyto(grown, neighbour, where=(grown < 0) & (neighbour >= 0))
    return grown


def _readable(mesh: Mesh, size: int, owner: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Triangles at whose corners interpolation finds surface; slivers thinner than a texel may have none."""
    low = np.floor(texel_corners(mesh, size, np.arange(len(mesh.triangles)))).astype(np.int64)
    found = np.ones(len(low), dtype=bool)
    for offset in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x, y = np.moveaxis(np.clip(low + offset, 0, size - 1), -1, 0)
        found &= (owner[y, x] >= 0).all(axis=1)
    return found


def _barycentric(mesh: Mesh, size: int, owner: NDArray[np.int32]) -> NDArray[np.uint16]:
    """Weights at each texel's centre; in the gutter those of the nearest place in the triangle."""
    y, x = np.nonzero(owner >= 0)
    p = texel_corners(mesh, size, owner[y, x])
    q = np.stack([x, y], axis=-1) - p[:, 0]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    area = cross(e1, e2)
    area = np.where(area == 0, 1.0, area)
    b = np.clip(np.stack([cross(q, e2) / area, cross(e1, q) / area], axis=-1), 0.0, 1.0)
    b /= np.maximum(b.sum(axis=-1, keepdims=True), 1.0)
    whole = np.zeros((size, size, 2), dtype=np.uint16)
    whole[y, x] = np.floor(b * 65535.0).astype(np.uint16)
    return whole


def _metric(
    mesh: Mesh, size: int, owner: NDArray[np.int32], barycentric: NDArray[np.uint16]
) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    """Texels per mm along u and v, and the cosine between the two, from the interpolated derivatives."""
    y, x = np.nonzero(owner >= 0)
    corners = mesh.triangles[owner[y, x]]
    b = barycentric[y, x] / np.float32(65535)
    weights = np.stack([1 - b[:, 0] - b[:, 1], b[:, 0], b[:, 1]])
    du, dv = (np.linalg.norm(d, axis=1) for d in (mesh.dpdu, mesh.dpdv))
    cosine = (mesh.dpdu * mesh.dpdv).sum(axis=1) / np.maximum(du * dv, 1e-12)
    corner = np.stack([du, dv, cosine], axis=-1)
    interpolated = sum(weights[k][:, None] * corner[corners[:, k]] for k in range(3))
    stretch = np.zeros((size, size, 2), dtype=np.float16)
    stretch[y, x] = np.clip(size / np.maximum(interpolated[:, :2], 1e-3), 0.0, 6e4)
    shear = np.zeros((size, size), dtype=np.float16)
    shear[y, x] = np.clip(interpolated[:, 2], -MOST_SHEAR, MOST_SHEAR)
    return stretch, shear


def _reach(chart: NDArray[np.integer]) -> NDArray[np.uint16]:
    """Run lengths of equal chart to the left, right, up and down of each texel."""

    def before(rows: NDArray[np.integer]) -> NDArray[np.int64]:
        index = np.arange(rows.shape[1])[None, :]
        breaks = np.ones(rows.shape, dtype=bool)
        breaks[:, 1:] = rows[:, 1:] != rows[:, :-1]
        start: NDArray[np.int64] = np.maximum.accumulate(np.where(breaks, index, 0), axis=1)
        return index - start

    right, down = before(chart[:, ::-1])[:, ::-1], before(chart.T[:, ::-1])[:, ::-1].T
    runs = before(chart), right, before(chart.T).T, down
    return np.stack(runs, axis=-1).astype(np.uint16)
