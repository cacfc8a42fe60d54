"""Unwrapping: isometric layouts of developable surfaces, and no mirrored or overlapping triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.atlas.raster import rasterise
from dermis.atlas.unwrap.charts import (
    connected_pieces,
    grow_charts,
    merge_stray_pieces,
    neighbour_triangles,
    smooth_charts,
)
from dermis.atlas.unwrap.flatten import flatten, singular_values, untangle
from dermis.atlas.unwrap.seams import border_edges, crossing_edges, faulty_triangles, split_at_seams
from dermis.atlas.unwrap.unwrap import CHART_PADDING, UvLayout, pack_charts, unwrap
from dermis.base.errors import DermisError
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]
Shape = tuple[Doubles, Index]

ISOMETRIC = 1e-6
"""Stretch of what can be developed: rounding only."""
SIZE = 1024


def square(cells: int = 12, jitter: float = 0.2) -> Shape:
    """Return a flat square with uneven triangles, tilted in space."""
    mesh = plane(10.0, cells)
    places = mesh.positions.astype(np.float64)
    inner = (np.abs(places[:, :2]) < 4.99).all(axis=1)
    move = jitter * 10 / cells * np.random.default_rng(1).uniform(-1, 1, (len(places), 2))
    places[inner, :2] += move[inner]
    tilt = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
    return places @ tilt.T, mesh.triangles.astype(np.int64)


def tube(around: int = 40, along: int = 20) -> Shape:
    """Return a round tube along y, open at both ends, of radius 5 and height 12."""
    angle, height = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.linspace(0, 12, along + 1))
    places = np.column_stack((5 * np.sin(angle).ravel(), height.ravel(), 5 * np.cos(angle).ravel()))
    row, column = (axis.ravel() for axis in np.mgrid[:along, :around])
    a, b = row * around + column, row * around + (column + 1) % around
    triangles = np.vstack((np.column_stack((a, b, b + around)), np.column_stack((a, b + around, a + around))))
    return places, triangles.astype(np.int64)


def sphere() -> Shape:
    mesh = uv_sphere(5.0, 32, 16)
    places = np.zeros((mesh.point.max() + 1, 3))
    places[mesh.point] = mesh.positions
    return places, mesh.point[mesh.triangles].astype(np.int64)


def one_chart(triangles: Index) -> Index:
    return np.zeros(len(triangles), dtype=np.int64)


def stretch(layout: UvLayout, positions: Doubles) -> Doubles:
    return singular_values(positions[layout.point[layout.triangles]], layout.uv[layout.triangles])


def as_mesh(layout: UvLayout, positions: Doubles) -> Mesh:
    normals = np.tile([0.0, 0.0, 1.0], (len(layout.point), 1))
    kind = np.zeros(len(layout.triangles))
    places = positions[layout.point]
    return build_mesh(places, layout.uv, layout.triangles, kind, (Material("skin"),), normals, layout.point)


def owners_of_texels(mesh: Mesh, layout: UvLayout, size: int = SIZE) -> Index:
    """Return the chart (size, size) of each texel, -1 for none; no texel is in two triangles."""
    corners = mesh.uv[mesh.triangles]
    # a little smaller, for a texel whose centre lies on an edge is in both its triangles
    corners += 1e-3 * (corners.mean(axis=1, keepdims=True) - corners)
    apart = np.arange(corners.size // 2, dtype=np.int32).reshape(-1, 3)
    shrunk = replace(mesh, uv=corners.reshape(-1, 2), triangles=apart)
    texel, triangle = rasterise(shrunk, size, np.arange(len(apart)))
    assert len(texel) == len(np.unique(texel))
    owner = np.full(size * size, -1, dtype=np.int64)
    owner[texel] = layout.chart[triangle]
    return owner.reshape(size, size)


def check_valid(layout: UvLayout, positions: Doubles) -> None:
    assert (layout.uv >= 0).all() and (layout.uv <= 1).all()
    assert (stretch(layout, positions)[:, 1] > 0).all()
    owners_of_texels(as_mesh(layout, positions), layout)


def test_flattening_a_plane_preserves_it() -> None:
    positions, triangles = square()
    layout = unwrap(positions, triangles, one_chart(triangles), up_direction=(0, 1, 0))
    check_valid(layout, positions)
    values = stretch(layout, positions)
    assert np.ptp(values) / values.mean() < ISOMETRIC
    assert len(layout.uv) == len(positions) and layout.chart.max() == 0
    assert values.mean() * 10 > 0.97, "it fills the map"


def test_half_a_tube_is_unrolled() -> None:
    positions, triangles = tube()
    half = triangles[positions[triangles].mean(axis=1)[:, 2] > 0]
    layout = unwrap(positions, half, one_chart(half))
    check_valid(layout, positions)
    values = stretch(layout, positions)
    assert np.ptp(values) / values.mean() < 1e-3
    assert layout.chart.max() == 0
    height = positions[layout.point, 1]
    assert np.corrcoef(height, layout.uv[:, 1])[0, 1] < -0.999, "y runs up the map"


@pytest.mark.parametrize("shape", [tube(), sphere()], ids=["tube", "sphere"])
def test_charts_that_cannot_be_flattened_are_halved(shape: Shape) -> None:
    positions, triangles = shape
    layout = unwrap(positions, triangles, one_chart(triangles))
    check_valid(layout, positions)
    assert 1 <= layout.chart.max() < 12
    values = stretch(layout, positions)
    assert np.median(values[:, 0] / values[:, 1]) < 1.4


def test_cap_of_a_sphere() -> None:
    """Check a cap of 60 degrees, between the stretch of a conformal and that of an equidistant map."""
    positions, triangles = sphere()
    cap = triangles[positions[triangles].mean(axis=1)[:, 2] > 2.5]
    layout = unwrap(positions, cap, one_chart(cap))
    check_valid(layout, positions)
    values = stretch(layout, positions)
    weight = triangle_areas(positions[cap])
    scale = np.sqrt(values.prod(axis=1))
    assert layout.chart.max() == 0
    assert np.average(values[:, 0] / values[:, 1], weights=weight) < 1.12
    assert scale.max() / scale.min() < 1.25


def test_density_sets_the_size_of_charts() -> None:
    positions, triangles = square()
    apart = (positions[triangles].mean(axis=1)[:, 1] > 0).astype(np.int64)
    corner, point = split_at_seams(triangles, apart)
    density = np.where(apart == 0, 1.0, 0.25)
    places = flatten(positions[point], corner, density, np.ones(len(corner)))
    values = singular_values(positions[triangles], places[corner]).mean(axis=1)
    assert values[apart == 0] / 4 == pytest.approx(values[apart == 1].mean(), rel=ISOMETRIC)


def test_triangles_with_a_large_weight_are_stretched_less() -> None:
    positions, triangles = sphere()
    cap = triangles[positions[triangles].mean(axis=1)[:, 2] > 0]
    corner, point = split_at_seams(cap, one_chart(cap))
    heavy, even = np.abs(positions[cap].mean(axis=1)[:, 1]) > 4, np.ones(len(cap))
    anisotropy = []
    for weight in (even, np.where(heavy, 20.0, 1.0)):
        places = flatten(positions[point], corner, even, weight)
        anisotropy.append(np.divide(*singular_values(positions[cap], places[corner])[heavy].T).mean())
    assert anisotropy[1] - 1 < 0.75 * (anisotropy[0] - 1)


def test_charts_are_upright() -> None:
    positions, triangles = square()
    layout = unwrap(positions, triangles, one_chart(triangles), up_direction=(0.8, 0, 0.6))
    height = positions[layout.point] @ (0.8, 0, 0.6)
    assert np.corrcoef(height, layout.uv[:, 1])[0, 1] < -0.999


def test_space_between_charts() -> None:
    positions, triangles = square(24)
    layout = unwrap(positions, triangles, grow_charts(positions, triangles, 30))
    owner = owners_of_texels(as_mesh(layout, positions), layout)
    reach = int(CHART_PADDING * SIZE)
    y, x = np.nonzero(owner >= 0)
    for dy, dx in ((0, reach), (reach, 0), (reach // 2, reach // 2), (reach // 2, -(reach // 2))):
        ny, nx = y + dy, x + dx
        inside = (ny < SIZE) & (nx >= 0) & (nx < SIZE)
        other = owner[ny[inside], nx[inside]]
        assert ((other < 0) | (other == owner[y[inside], x[inside]])).all()
    assert (owner[: reach // 2 - 1] < 0).all() and (owner[:, : reach // 2 - 1] < 0).all()
    assert (owner >= 0).mean() > 0.5


def test_same_input_same_bytes() -> None:
    positions, triangles = sphere()
    one, other = (unwrap(positions, triangles, grow_charts(positions, triangles, 9)) for _ in range(2))
    assert one.uv.tobytes() == other.uv.tobytes() and one.triangles.tobytes() == other.triangles.tobytes()


def test_layout_keeps_the_points_of_the_mesh() -> None:
    positions, triangles = sphere()
    layout = unwrap(positions, triangles, grow_charts(positions, triangles, 9))
    assert np.array_equal(layout.point[layout.triangles], triangles)


def test_triangle_without_area_is_refused() -> None:
    positions, triangles = square()
    with pytest.raises(DermisError, match="triangles with an area"):
        unwrap(positions, np.vstack((triangles, [[0, 1, 1]])), np.zeros(len(triangles) + 1, dtype=np.int64))


def test_points_between_charts_are_split() -> None:
    positions, triangles = square(8, 0.0)
    chart = (positions[triangles].mean(axis=1)[:, 1] > 0).astype(np.int64)
    corner, point = split_at_seams(triangles, chart)
    assert np.array_equal(point[corner], triangles)
    middle = np.flatnonzero(np.abs(positions[:, 1]) < 1e-6)
    assert sorted(np.flatnonzero(np.bincount(point) == 2)) == sorted(middle)


def test_each_chart_is_connected() -> None:
    positions, triangles = sphere()
    chart = grow_charts(positions, triangles, 20)
    assert chart.max() == 19
    assert connected_pieces(chart, neighbour_triangles(triangles)).max() == 19
    two = np.vstack((triangles, triangles + len(positions)))
    assert grow_charts(np.vstack((positions, positions)), two, 1).max() == 1, (
        "each piece of a mesh has its own"
    )


def test_smoothed_charts_have_short_borders() -> None:
    positions, triangles = square(20)
    side = (positions[triangles].mean(axis=1)[:, 1] > 0).astype(np.int64)
    noisy = np.where(np.random.default_rng(2).random(len(side)) < 0.15, 1 - side, side)
    mended = smooth_charts(noisy, triangles)
    assert (mended == side).mean() > 0.97
    assert connected_pieces(mended, neighbour_triangles(triangles)).max() == 1


def test_stray_triangles_join_the_surrounding_chart() -> None:
    positions, triangles = square(20)
    height = positions[triangles].mean(axis=1)[:, 1]
    half = (height > 2).astype(np.int64)
    low = int(height.argmin())
    stray = half.copy()
    stray[low] = 1
    assert np.array_equal(merge_stray_pieces(stray, triangles), half)


def test_faults_are_found() -> None:
    positions, triangles = square(8)
    places = flatten(positions, triangles, np.ones(len(triangles)), np.ones(len(triangles)))
    whole = one_chart(triangles)
    assert not faulty_triangles(places, triangles, whole).any()
    assert faulty_triangles(places * (-1, 1), triangles, whole).all(), "mirrored"
    inner = np.flatnonzero((np.abs(positions[:, 1]) < 1) & (np.abs(positions[:, 0]) < 1))[0]
    moved = places.copy()
    moved[inner] += 4.0
    assert faulty_triangles(moved, triangles, whole).any()
    assert not faulty_triangles(untangle(moved, triangles), triangles, whole).any()
    sides, _ = border_edges(triangles)
    assert len(sides) == 32 and not crossing_edges(places[sides]).any()


def test_crossing_edges_are_detected() -> None:
    sides = np.array(
        [[[0, 0], [2, 2]], [[0, 2], [2, 0]], [[2, 2], [3, 0]], [[5, 0], [5, 1]]], dtype=np.float64
    )
    assert crossing_edges(sides).tolist() == [True, True, False, False]


def test_rectangles_are_packed_well() -> None:
    random = np.random.default_rng(3)
    size = random.uniform(1, 4, (25, 2))
    box = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    outlines = [np.stack((box * s, np.roll(box, -1, axis=0) * s), axis=1) + 7.0 for s in size]
    scale, offset = pack_charts(outlines, CHART_PADDING)
    low, high = scale * 7.0 + offset, scale * (7.0 + size) + offset
    assert (low > CHART_PADDING / 3).all() and (high < 1 - CHART_PADDING / 3).all()
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    gap[np.diag_indices(25)] = 1
    assert gap.min() > 0.99 * CHART_PADDING
    assert (scale**2 * size.prod(axis=1)).sum() > 0.65


def test_too_many_charts_are_refused() -> None:
    box = np.array([[[0, 0], [1, 0]], [[1, 0], [0, 1]], [[0, 1], [0, 0]]], dtype=np.float64)
    with pytest.raises(DermisError, match="fewer charts"):
        pack_charts([box] * 40, 0.2)


def test_a_small_closed_piece_is_cut_into_charts_with_borders() -> None:
    ball, corners = uv_sphere(100, 24, 12), np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    points = np.unique(ball.positions.astype(np.float64).round(6), axis=0, return_inverse=True)
    triangles = points[1].reshape(-1)[ball.triangles]
    piece = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]) + len(points[0])
    positions = np.vstack((points[0], 20.0 * corners + np.array([300, 0, 0])))
    joined = np.vstack((triangles, piece))
    layout = unwrap(positions, joined, grow_charts(positions, joined, 4))
    assert len(np.unique(layout.chart[-4:])) > 1 and np.isfinite(layout.uv).all()
