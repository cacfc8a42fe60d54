"""Catmull-Clark subdivision compared with published rules, B-splines and formulas of limits."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from loaded_mesh import load_mesh
from scipy.interpolate import BSpline

from dermis.atlas.raster import chart_uv_area, find_charts
from dermis.formats.mesh_checks import check_mesh
from dermis.mesh.geometry import edges, split_quads, triangle_areas
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import uv_sphere
from dermis.mesh.subdivide import polygons, subdivide
from dermis.mesh.subdivision_rules import Cage, refine_catmull_clark

SKIN = (Material("skin"),)
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
CUBE = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def _quad_mesh(positions: np.ndarray, quads: np.ndarray, uv: np.ndarray | None = None) -> Mesh:
    triangles, uv = split_quads(np.asarray(quads)), np.zeros((len(positions), 2)) if uv is None else uv
    pairs = np.arange(len(triangles)).reshape(-1, 2)
    return build_mesh(positions, uv, triangles, np.zeros(len(triangles)), SKIN, quads=pairs)


def _grid(rows: int, columns: int) -> np.ndarray:
    """Return the quads of a grid of points, row by row."""
    number = np.arange(rows * columns).reshape(rows, columns)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    return np.stack([corner.ravel() for corner in corners], axis=1)


def _torus(major: float, minor: float, around: int = 32, across: int = 16) -> Mesh:
    """Return a torus of quads with uv seams along both circles."""
    j, i = (axis.ravel() for axis in np.mgrid[: across + 1, : around + 1])
    phi, theta = 2 * np.pi * (i % around) / around, 2 * np.pi * (j % across) / across
    ring = major + minor * np.cos(theta)
    positions = np.column_stack((ring * np.cos(phi), ring * np.sin(phi), minor * np.sin(theta)))
    uv = np.column_stack((i / around, j / across))
    return _quad_mesh(positions, _grid(across + 1, around + 1)[:, ::-1], uv)


def _on_grid(mesh: Mesh, size: int, values: np.ndarray) -> np.ndarray:
    """Return the values of a mesh's vertices as (size, size, ...) by their uv."""
    column, row = np.rint(mesh.uv * (size - 1)).astype(int).T
    table = np.full((size, size, *values.shape[1:]), np.nan)
    table[row, column] = values
    return table


def test_new_points_of_a_cube_follow_the_published_rules() -> None:
    mesh = _quad_mesh(CORNERS, CUBE)
    cage = Cage(mesh.uv.astype(float), mesh.point.astype(np.int64), *polygons(mesh))
    weights, finer = refine_catmull_clark(cage)
    control = np.empty((8, 3))
    control[mesh.point] = CORNERS
    points = weights @ control
    # face points (Q) are means of corners, edge points of two ends and two face points; a corner of three
    # faces goes to (Q + 2 R) / 3 with R the mean of the middles of its edges
    np.testing.assert_allclose(points[:8], control * 5 / 9)
    edge_points = {p for p in product((-0.75, 0, 0.75), repeat=3) if np.abs(p).sum() == 1.5}
    assert {tuple(p) for p in np.round(points[8:20], 9)} == edge_points
    assert {tuple(p) for p in np.round(points[20:], 9)} == {
        tuple(p) for p in np.vstack([np.eye(3), -np.eye(3)])
    }
    assert len(finer.corner_count) == 24 and (finer.corner_count == 4).all()


def test_corners_of_a_cube_are_at_their_limit_from_the_first_level_on() -> None:
    mesh = _quad_mesh(CORNERS, CUBE)
    for levels in (1, 2, 3):
        finer = subdivide(mesh, levels).mesh
        # (9 v + 4 sum of edge points + sum of face points) / 24 with v = 5/9, 3/4 + 3/4 + 0 and 1 + 0 + 0
        np.testing.assert_allclose(finer.positions[:8], 0.5 * CORNERS, atol=1e-6)
        assert len(finer.triangles) == 12 * 4**levels
    cage = Cage(mesh.uv.astype(float), mesh.point.astype(np.int64), *polygons(mesh))
    points = np.empty((8, 3))
    points[mesh.point] = CORNERS
    for _ in range(6):
        weights, cage = refine_catmull_clark(cage)
        points = weights @ points
    np.testing.assert_allclose(np.abs(points[:8]), 0.5, atol=1e-3)


def test_a_regular_grid_becomes_a_bicubic_b_spline() -> None:
    size, levels = 8, 2
    heights = np.random.default_rng(1).normal(size=(size, size))
    row, column = np.mgrid[:size, :size]
    positions = np.column_stack((column.ravel(), -row.ravel(), heights.ravel())).astype(float)
    uv = np.column_stack((column.ravel(), row.ravel())) / (size - 1)
    finer = subdivide(_quad_mesh(positions, _grid(size, size), uv), levels).mesh
    fine = (size - 1) * 2**levels + 1
    z = _on_grid(finer, fine, finer.positions[:, 2])
    at = np.linspace(0, size - 1, fine)
    basis = BSpline(np.arange(-2.0, size + 2), np.eye(size), 3)(at)
    inside = (at >= 1) & (at <= size - 2)
    np.testing.assert_allclose(
        z[np.ix_(inside, inside)], (basis @ heights @ basis.T)[np.ix_(inside, inside)], atol=1e-6
    )
    np.testing.assert_allclose(z[0, inside], (basis @ heights[0])[inside], atol=1e-6)  # its border is a curve


def test_a_plane_stays_flat_and_maps_commute() -> None:
    row, column = np.mgrid[:5, :5]
    flat = np.column_stack((column.ravel(), -row.ravel(), 0 * row.ravel())).astype(float)
    mesh = _quad_mesh(flat, _grid(5, 5))
    finer = subdivide(mesh, 2).mesh
    assert np.abs(finer.positions[:, 2]).max() == 0
    assert triangle_areas(finer.positions[finer.triangles]).min() > 0
    matrix, shift = np.array([[1, 2, 0.5], [0, 1, -1], [0.3, 0, 2]]), np.array([4, -5, 6])
    moved = subdivide(_quad_mesh(flat @ matrix.T + shift, _grid(5, 5)), 2).mesh
    np.testing.assert_allclose(moved.positions, finer.positions @ matrix.T + shift, atol=1e-5)


def test_a_torus_of_quads_stays_smooth_and_welded() -> None:
    torus = _torus(100, 40)
    finer = subdivide(torus, 2).mesh
    welded = finer.point[finer.triangles]
    ends, _, counts = edges(welded)
    assert (counts == 2).all()
    assert int(finer.point.max()) + 1 - len(ends) + len(welded) == 0
    p = finer.positions.astype(float)
    ring = np.hypot(p[:, 0], p[:, 1])
    # a closed cubic B-spline of 32 points on a circle lies within it
    radius = 100 * (2 + np.cos(2 * np.pi / 32)) / 3
    centre = p * np.array([1, 1, 0]) * (radius / ring)[:, None]
    true = (p - centre) / np.linalg.norm(p - centre, axis=1, keepdims=True)
    assert (true * finer.normals).sum(axis=1).min() > np.cos(np.radians(1))
    check_mesh(finer, "torus")


def test_uv_is_bilinear_and_its_seams_stay() -> None:
    torus = _torus(100, 40)
    finer = subdivide(torus, 1).mesh
    corners_at = np.bincount(finer.point)
    assert (corners_at == 4).sum() == 1 and (corners_at == 2).sum() == 2 * (32 + 16) - 2
    np.testing.assert_allclose(
        chart_uv_area(torus, find_charts(torus)), chart_uv_area(finer, find_charts(finer)), rtol=1e-5
    )
    uneven = _quad_mesh(CORNERS[:4], [[0, 2, 3, 1]], np.array([[0, 0], [0.1, 0.5], [0.6, 0.2], [1, 1]]))
    np.testing.assert_allclose(
        subdivide(uneven, 1).mesh.uv[4:], [[0.05, 0.25], [0.3, 0.1], [0.55, 0.75], [0.8, 0.6], [0.425, 0.425]]
    )


def test_triangles_among_quads_become_three_quads() -> None:
    # a cube whose lid is a pyramid
    positions = np.vstack((CORNERS, [[0, 0, 2]]))
    triangles = [[1, 5, 8], [5, 7, 8], [7, 3, 8], [3, 1, 8]]
    corner = np.vstack((split_quads(CUBE[:5]), triangles))
    two = (*SKIN, Material("hat", "opaque"))
    mesh = build_mesh(
        positions, np.zeros((9, 2)), corner, [0] * 10 + [1] * 4, two, quads=np.arange(10).reshape(-1, 2)
    )
    finer = subdivide(mesh, 1).mesh
    assert len(finer.quads) == 5 * 4 + 4 * 3 and len(finer.triangles) == 2 * len(finer.quads)
    np.testing.assert_array_equal(np.bincount(finer.material), [40, 24])
    assert finer.positions[finer.triangles[finer.material == 1]].mean(axis=(0, 1))[2] > 0.7
    check_mesh(finer, "mixed")


def test_mostly_triangles_are_refined_as_triangles() -> None:
    sphere = uv_sphere(50, 16, 8)
    paired = build_mesh(
        sphere.positions,
        sphere.uv,
        sphere.triangles,
        sphere.material,
        SKIN,
        quads=np.array([[0, 1]]),
    )
    np.testing.assert_array_equal(subdivide(paired, 1).mesh.positions, subdivide(sphere, 1).mesh.positions)


OBJ = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
v 3 0 0
vt 0 0
vt 0.3 0
vt 0.3 0.3
vt 0 0.3
vt 0.6 0
vt 0.6 0.3
vt 0.9 0
usemtl skin
f 1/1 2/2 3/3 4/4
{between}f 2/2 5/5 6/6 3/3
"""
TRIANGLE = "usemtl shirt\nf 5/5 7/7 6/6\nusemtl skin\n"
PLY = """ply
format ascii 1.0
element vertex 7
property float x
property float y
property float z
property float s
property float t
element face {faces}
property list uchar int vertex_indices
end_header
0 0 0 0 0
1 0 0 0.3 0
1 1 0 0.3 0.3
0 1 0 0 0.3
2 0 0 0.6 0
2 1 0 0.6 0.3
3 0 0 0.9 0
4 0 1 2 3
{between}4 1 4 5 2
"""


def _quads_of(mesh: Mesh) -> set[tuple[tuple[float, float], ...]]:
    corner, sides, _ = polygons(mesh)
    rows = np.split(corner, np.cumsum(sides)[:-1])
    return {tuple((float(x), float(y)) for x, y, _ in mesh.positions[row]) for row in rows if len(row) == 4}


@pytest.mark.parametrize(
    "between", ["", "f 5/5 7/7 6/6\n", TRIANGLE], ids=["quads", "mixed", "in two groups"]
)
def test_quads_of_an_obj_stay_quads(tmp_path: Path, between: str) -> None:
    path = tmp_path / "head.obj"
    path.write_text(OBJ.format(between=between))
    mesh = load_mesh(path)
    assert _quads_of(mesh) == {((0, 0), (1, 0), (1, 1), (0, 1)), ((1, 0), (2, 0), (2, 1), (1, 1))}
    assert len(subdivide(mesh, 1).mesh.quads) == 8 + (3 if between else 0)


@pytest.mark.parametrize("between", ["", "3 4 6 5\n"], ids=["quads", "mixed"])
def test_quads_of_a_ply_stay_quads(tmp_path: Path, between: str) -> None:
    path = tmp_path / "head.ply"
    path.write_text(PLY.format(faces=2 + bool(between), between=between))
    assert _quads_of(load_mesh(path)) == {
        ((0, 0), (1, 0), (1, 1), (0, 1)),
        ((1, 0), (2, 0), (2, 1), (1, 1)),
    }


def test_files_of_triangles_have_no_quads(tmp_path: Path) -> None:
    path = tmp_path / "head.obj"
    text = OBJ.format(between="")
    path.write_text(
        text.replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3\nf 3/3 4/4 1/1").replace(" 6/6 3/3", " 6/6")
    )
    assert len(load_mesh(path).quads) == 0
