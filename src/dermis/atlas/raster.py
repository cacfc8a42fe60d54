"""Rasterisation of triangles in uv, search for charts, and the atlas of a mesh's own uv layout."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER_TEXELS, MAX_SHEAR, Atlas
from dermis.base.arrays import Doubles, Index, Ints, Mask
from dermis.mesh.geometry import (
    MIN_DOUBLE_UV_AREA,
    cross_2d,
    edges,
    expand_runs,
    label_components,
    uv_cross,
    weld,
)
from dermis.mesh.mesh import Mesh

_EDGE_TOLERANCE_TEXELS = 1e-6  # texel centres this far outside an edge still count as covered [texel]
_MIN_BLURRED_CHART_TEXELS = 4.0  # area of the smallest chart in which light can be blurred


def find_charts(mesh: Mesh) -> Ints:
    """Return the index of the chart of each triangle (f,); charts are numbered from 0.

    A chart is a set of triangles connected by edges that are shared both in space and in uv.
    """
    # vertices are compared by position and uv: where they differ only in their normals, there is no seam
    corner = weld(np.hstack((mesh.positions, mesh.uv)))
    _, edge_of_side, _ = edges(corner[mesh.triangles])
    faces = np.tile(np.arange(len(mesh.triangles)), 3)
    order = np.argsort(edge_of_side, kind="stable")
    shared = edge_of_side[order][1:] == edge_of_side[order][:-1]
    a, b = faces[order][:-1][shared], faces[order][1:][shared]
    return label_components(len(mesh.triangles), a, b).astype(np.int32)


def triangle_uv_area(mesh: Mesh) -> Doubles:
    """Return the unsigned uv area of each triangle (f,), as a fraction of the map."""
    return np.asarray(np.abs(uv_cross(mesh.uv[mesh.triangles])) / 2)


def chart_uv_area(mesh: Mesh, triangle_chart: Ints) -> Doubles:
    """Return the unsigned uv area of each chart (c,), as a fraction of the map.

    triangle_chart : (f,) chart index of each triangle
    """
    return np.asarray(np.bincount(triangle_chart, weights=triangle_uv_area(mesh)), dtype=np.float64)


def usable_triangles(mesh: Mesh, map_side: int, min_texels: float = _MIN_BLURRED_CHART_TEXELS) -> Mask:
    """Return the mask (f,) of triangles that have enough texels for light to be diffused in them.

    The mask excludes triangles without uv area, and all triangles of charts with fewer than `min_texels`
    texels.

    map_side : texels along each side of the map
    min_texels : smallest uv area of a chart [texel]
    """
    chart = find_charts(mesh)
    large_enough = chart_uv_area(mesh, chart) * map_side**2 >= min_texels
    return np.asarray(large_enough[chart] & (2 * triangle_uv_area(mesh) > MIN_DOUBLE_UV_AREA))


def texel_corners(mesh: Mesh, map_side: int, triangle_index: NDArray[np.integer]) -> Doubles:
    """Return the uv of triangle corners in units of texels (t, 3, 2); texel centres are at integers.

    triangle_index : (t,) indices of the triangles
    """
    return np.asarray(mesh.uv[mesh.triangles[triangle_index]].astype(np.float64) * map_side - 0.5)


def rasterise(mesh: Mesh, map_side: int, triangle_index: NDArray[np.integer]) -> tuple[Index, Index]:
    """Rasterise triangles in uv; return flat indices of covered texels, and the triangle that covers each.

    map_side : texels along each side of the map
    triangle_index : (t,) indices of the triangles
    """
    texel, which = covered_texels(texel_corners(mesh, map_side, triangle_index), (map_side, map_side))
    return texel, triangle_index[which].astype(np.int64)


def covered_texels(
    corners: Doubles, grid_shape: tuple[int, int], margin: float = -_EDGE_TOLERANCE_TEXELS
) -> tuple[Index, Index]:
    """Find the texels whose centre is in a triangle; return their flat indices, and triangle indices.

    The result has one entry for each pair of a texel and a triangle that covers its centre. Triangle indices
    refer to `corners`.

    corners : (t, 3, 2) corners of the triangles [texel]; texel centres are at integers
    grid_shape : height and width of the grid of texels
    margin : distance by which a covered centre must be inside the triangle [texel]. It is measured along x to
        the two edges that the centre's row crosses, and along y to the lowest and the highest corner. If
        negative, centres up to this distance outside also count as covered
    """
    height, width = grid_shape
    low, high = corners[..., 1].min(axis=1), corners[..., 1].max(axis=1)
    top, bottom = _integers_between(low, high, height, margin)
    which, y = expand_runs(top, np.maximum(bottom - top + 1, 0))
    left, right = _integers_between(*_row_interval(corners, which, y), width, margin)
    span, x = expand_runs(left, np.maximum(right - left + 1, 0))
    return y[span] * width + x, which[span]


def _integers_between(low: Doubles, high: Doubles, grid_side: int, margin: float) -> tuple[Index, Index]:
    """Return the first and last integer between low + margin and high - margin, limited to the grid."""
    first = np.clip(np.ceil(low + margin), 0, grid_side).astype(np.int64)
    return first, np.clip(np.floor(high - margin), -1, grid_side - 1).astype(np.int64)


def _row_interval(corners: Doubles, row_triangle: Index, y: Index) -> tuple[Doubles, Doubles]:
    """Return the lowest and highest x, (n,) each, of the intersections of texel rows with triangles.

    corners : (t, 3, 2) corners of the triangles [texel]
    row_triangle : (n,) index of the triangle that each row intersects
    y : (n,) index of the row of texels
    """
    lowest = np.full(len(y), -np.inf)
    highest = np.full(len(y), np.inf)
    sign = np.where(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) >= 0, 1.0, -1.0)[
        :, None
    ]
    edge = np.roll(corners, -1, axis=1) - corners
    # inside: cross(edge, q - a) * sign >= 0, linear in q.x with slope -edge.y * sign
    slopes, across = -edge[..., 1] * sign, edge[..., 0] * sign
    offsets = edge[..., 1] * corners[..., 0] * sign - across * corners[..., 1]
    for k in range(3):
        slope, offset = slopes[row_triangle, k], offsets[row_triangle, k] + across[row_triangle, k] * y
        crossing = -offset / np.where(slope == 0, 1.0, slope)
        np.maximum(lowest, crossing, out=lowest, where=slope > 0)
        np.minimum(highest, crossing, out=highest, where=slope < 0)
        highest[(slope == 0) & (offset < 0)] = -np.inf
    return np.where(np.isfinite(lowest), lowest, 1.0), np.where(np.isfinite(highest), highest, 0.0)


def build_mesh_layout(mesh: Mesh, atlas_side: int) -> Atlas:
    """Build the atlas of a mesh in the mesh's own uv layout, the layout of the mesh's texture maps."""
    chart = find_charts(mesh)
    skin = np.array([material.kind == "skin" for material in mesh.materials])
    usable = usable_triangles(mesh, atlas_side) & skin[mesh.material]
    texel, triangle = rasterise(mesh, atlas_side, np.flatnonzero(usable))
    mapped = usable & ~_triangles_of_overlapped_charts(chart, texel, triangle, atlas_side)
    owner, hidden = _assign_texels(mesh, mapped, texel, triangle, atlas_side)
    mapped &= ~hidden
    for _ in range(GUTTER_TEXELS):
        owner = _dilate_texel_triangles(owner)
    mapped &= _interpolable_triangles(mesh, atlas_side, owner)
    barycentric = _texel_weights(mesh, atlas_side, owner)
    chart_map = np.where(owner >= 0, chart[np.maximum(owner, 0)], -1)
    stretch, shear = _texel_metric(mesh, atlas_side, owner, barycentric)
    corner_uv = mesh.uv[mesh.triangles]
    none = np.zeros((0, 2), np.uint16)
    return Atlas(
        triangle=owner,
        barycentric=barycentric,
        stretch=stretch,
        shear=shear,
        edge_distance=_chart_edge_distances(chart_map),
        corner_uv=corner_uv,
        gutter=none,
        source=none.astype(np.float32),
        outside=none,
        border_triangle=np.zeros(0, np.int32),
        border_weights=none,
        texels_per_uv=np.full(len(corner_uv), atlas_side, np.float32),
        mapped=mapped,
    )


def _triangles_of_overlapped_charts(
    triangle_chart: NDArray[np.integer], covered_texel: Index, covering_triangle: Index, atlas_side: int
) -> Mask:
    """Return the mask (f,) of triangles in charts that are mostly covered in uv by a larger chart.

    triangle_chart : (f,) chart index of each triangle
    covered_texel : (k,) flat index of each covered texel, once for each triangle that covers its centre
    covering_triangle : (k,) index of this triangle
    """
    count = int(triangle_chart.max()) + 1
    area = np.bincount(triangle_chart[covering_triangle], minlength=count)
    order = np.argsort(
        area[triangle_chart[covering_triangle]], kind="stable"
    )  # the largest chart writes last and wins
    winner = np.full(atlas_side * atlas_side, -1, dtype=np.int64)
    winner[covered_texel[order]] = triangle_chart[covering_triangle[order]]
    own = np.bincount(
        triangle_chart[covering_triangle][winner[covered_texel] == triangle_chart[covering_triangle]],
        minlength=count,
    )
    hidden: Mask = own < 0.5 * np.maximum(area, 1)
    return np.asarray(hidden[triangle_chart])


def _assign_texels(
    mesh: Mesh, mapped_triangles: Mask, texel: Index, triangle: Index, atlas_side: int
) -> tuple[Ints, Mask]:
    """Assign each texel to one of the triangles that cover its centre.

    Returns the triangle index of each texel (n, n), -1 for texels without a triangle. Also returns the mask
    (f,) of hidden triangles, which get less than half of the texels that they cover.

    Where a chart is folded onto itself in uv, texels are assigned to its unmirrored triangles.

    mapped_triangles : (f,) mask of triangles to which texels may be assigned
    texel, triangle : (k,) flat texel index and triangle index of each covered texel centre
    """
    is_mapped = mapped_triangles[triangle]
    texel, triangle = texel[is_mapped], triangle[is_mapped]
    order = np.argsort(uv_cross(mesh.uv[mesh.triangles])[triangle] < 0, kind="stable")
    owner: Ints = np.full((atlas_side, atlas_side), -1, dtype=np.int32)
    owner.ravel()[texel[order]] = triangle[order]
    count = len(mapped_triangles)
    area = np.bincount(triangle, minlength=count)
    own = np.bincount(triangle[owner.ravel()[texel] == triangle], minlength=count)
    return owner, own < 0.5 * area


def _dilate_texel_triangles(texel_triangle: Ints) -> Ints:
    """Assign to each empty texel the triangle of one of its eight neighbours, diagonal neighbours last."""
    dilated = texel_triangle.copy()
    padded = np.pad(texel_triangle, 1, constant_values=-1)
    n = len(texel_triangle)
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        neighbour = padded[1 + dy : 1 + dy + n, 1 + dx : 1 + dx + n]
        np.copyto(dilated, neighbour, where=(dilated < 0) & (neighbour >= 0))
    return dilated


def _interpolable_triangles(mesh: Mesh, atlas_side: int, texel_triangle: Ints) -> Mask:
    """Return the mask (f,) of triangles at whose corners bilinear interpolation reads no empty texel.

    Bilinear interpolation at a corner reads the four texels around the corner. At thin triangles, some of
    these texels may be empty, that is, assigned to no triangle.

    texel_triangle : (n, n) index of the triangle to which each texel is assigned, -1 for empty texels
    """
    low = np.floor(texel_corners(mesh, atlas_side, np.arange(len(mesh.triangles)))).astype(np.int64)
    found = np.ones(len(low), dtype=bool)
    for offset in ((0, 0), (1, 0), (0, 1), (1, 1)):
        x, y = np.moveaxis(np.clip(low + offset, 0, atlas_side - 1), -1, 0)
        found &= (texel_triangle[y, x] >= 0).all(axis=1)
    return found


def _texel_weights(mesh: Mesh, atlas_side: int, texel_triangle: Ints) -> NDArray[np.uint16]:
    """Return the barycentric weights of the second and third corner at each texel centre (n, n, 2) [1/65535].

    A gutter texel has the weights of the nearest point of its triangle.

    texel_triangle : (n, n) index of the triangle to which each texel is assigned, -1 for empty texels
    """
    y, x = np.nonzero(texel_triangle >= 0)
    weights = barycentric_weights(
        texel_corners(mesh, atlas_side, texel_triangle[y, x]), np.column_stack((x, y))
    )
    packed = np.zeros((atlas_side, atlas_side, 2), dtype=np.uint16)
    packed[y, x] = np.floor(weights * 65535.0).astype(np.uint16)
    return packed


def barycentric_weights(corners: Doubles, points: NDArray[Any]) -> Doubles:
    """Return the barycentric weights (n, 2) of the second and third corner at points.

    Points outside their triangle are moved to its border.

    corners : (n, 3, 2) corners of each point's triangle
    points : (n, 2) points
    """
    e1, e2, offset = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    area = cross_2d(e1, e2)
    area = np.where(area == 0, 1.0, area)
    weights = np.clip(np.stack((cross_2d(offset, e2) / area, cross_2d(e1, offset) / area), axis=1), 0.0, 1.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1), 1.0)[:, None])


def _texel_metric(
    mesh: Mesh, atlas_side: int, texel_triangle: Ints, barycentric: NDArray[np.uint16]
) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    """Return each texel's stretch (n, n, 2) along u and v [1/mm], and shear (n, n), as defined in `Atlas`.

    Both are interpolated from the derivatives dp/du and dp/dv at the vertices.

    texel_triangle : (n, n) index of the triangle to which each texel is assigned, -1 for empty texels
    barycentric : (n, n, 2) weights from `_texel_weights`
    """
    y, x = np.nonzero(texel_triangle >= 0)
    corners = mesh.triangles[texel_triangle[y, x]]
    b = barycentric[y, x] / np.float32(65535)
    weights = np.stack([1 - b[:, 0] - b[:, 1], b[:, 0], b[:, 1]])
    du, dv = (np.linalg.norm(d, axis=1) for d in (mesh.dpdu, mesh.dpdv))
    cosine = (mesh.dpdu * mesh.dpdv).sum(axis=1) / np.maximum(du * dv, 1e-12)
    corner = np.stack([du, dv, cosine], axis=-1)
    interpolated = sum(weights[k][:, None] * corner[corners[:, k]] for k in range(3))
    stretch = np.zeros((atlas_side, atlas_side, 2), dtype=np.float16)
    stretch[y, x] = np.clip(atlas_side / np.maximum(interpolated[:, :2], 1e-3), 0.0, 6e4)
    shear = np.zeros((atlas_side, atlas_side), dtype=np.float16)
    shear[y, x] = np.clip(interpolated[:, 2], -MAX_SHEAR, MAX_SHEAR)
    return stretch, shear


def _chart_edge_distances(texel_chart: Ints) -> NDArray[np.uint16]:
    """Return the distances (n, n, 4) to the left, right, top and bottom edge of the chart [texel].

    texel_chart : (n, n) index of the chart to which each texel belongs
    """
    left, right = connected_run_lengths(np.pad(texel_chart[:, 1:] == texel_chart[:, :-1], ((0, 0), (1, 0))))
    up, down = connected_run_lengths(np.pad(texel_chart.T[:, 1:] == texel_chart.T[:, :-1], ((0, 0), (1, 0))))
    return np.stack((left, right, up.T, down.T), axis=-1).astype(np.uint16)


def connected_run_lengths(connected_mask: Mask) -> tuple[Ints, Ints]:
    """Return how many connected texels lie before and after each texel in its row, (h, w) each.

    connected_mask : (h, w) mask of texels that are connected to the texel before them in the row
    """
    after = np.zeros_like(connected_mask)
    after[:, :-1] = connected_mask[:, 1:]
    return _connected_texels_before(connected_mask), _connected_texels_before(after[:, ::-1])[:, ::-1]


def _connected_texels_before(connected_mask: Mask) -> Ints:
    index = np.arange(connected_mask.shape[1], dtype=np.int32)
    return index - np.maximum.accumulate(np.where(connected_mask, 0, index), axis=1)
