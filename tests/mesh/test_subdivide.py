"""Loop subdivision: topology, seams, borders and the limit surface."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.atlas.raster import chart_uv_area, find_charts
from dermis.base.errors import DermisError
from dermis.formats.mesh_checks import check_mesh
from dermis.mesh.geometry import edges, weld
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere
from dermis.mesh.subdivide import subdivide


def _euler(mesh: Mesh) -> int:
    ends, _, counts = edges(mesh.point[mesh.triangles])
    assert (counts == 2).all()
    return int(mesh.point.max()) + 1 - len(ends) + len(mesh.triangles)


@pytest.mark.parametrize("levels", [1, 2])
def test_closed_sphere_stays_a_sphere(levels: int) -> None:
    sphere = uv_sphere(50, 16, 8)
    finer = subdivide(sphere, levels).mesh
    assert len(finer.triangles) == 4**levels * len(sphere.triangles)
    assert _euler(finer) == _euler(sphere) == 2
    radius = np.linalg.norm(finer.positions, axis=1)
    assert radius.max() < 50
    assert radius.min() > 45
    check_mesh(finer, "finer")


def test_error_falls_by_four_per_level() -> None:
    sphere = uv_sphere(50, 16, 8)
    radii = [np.linalg.norm(subdivide(sphere, n).mesh.positions, axis=1).mean() for n in range(4)]
    steps = -np.diff(radii)
    assert (steps > 0).all()
    assert steps[1] < 0.6 * steps[0] and steps[2] < 0.6 * steps[1]


def test_icosahedron_moves_by_the_weights() -> None:
    golden = (1 + 5**0.5) / 2
    corners = [(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)]
    positions = np.array([np.roll(c, k) for k in range(3) for c in corners])
    from scipy.spatial import ConvexHull

    hull = ConvexHull(positions)
    turned = (np.linalg.det(positions[hull.simplices]) < 0)[:, None]
    triangles = np.where(turned, hull.simplices[:, ::-1], hull.simplices)
    mesh = build_mesh(positions, np.zeros((12, 2)), triangles, np.zeros(20), (Material("skin"),))
    finer = subdivide(mesh, 1).mesh
    # the five neighbours of a corner average to 1/sqrt(5) of it: 5/8 + 3/8/sqrt(5)
    np.testing.assert_allclose(finer.positions[:12], positions * (5 / 8 + 3 / 8 / 5**0.5), atol=1e-6)
    # a new point takes 3/8 of the two ends of its edge and 1/8 of the two corners that are next to both
    near = np.linalg.norm(positions[:, None] - positions, axis=2) < 2.1
    expected = {}
    for a, b in np.argwhere(np.triu(near, 1)):
        across = np.flatnonzero(near[a] & near[b] & ~np.isin(np.arange(12), [a, b]))
        assert len(across) == 2
        point = 3 / 8 * (positions[a] + positions[b]) + positions[across].sum(axis=0) / 8
        expected[tuple(np.round(point, 4) + 0.0)] = True
    assert {tuple(p) for p in np.round(finer.positions[12:].astype(float), 4) + 0.0} == set(expected)


def test_valence_three_vertices_use_their_weight() -> None:
    positions = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    mesh = build_mesh(positions, np.zeros((4, 2)), triangles, np.zeros(4), (Material("skin"),))
    # 7/16 of itself and 3/16 of each neighbour, which sum to its opposite
    np.testing.assert_allclose(subdivide(mesh, 1).mesh.positions[:4], positions / 4, atol=1e-6)


def test_curved_border_is_smoothed_along_itself() -> None:
    angle = np.arange(6) * np.pi / 3
    rim = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(6)))
    positions = np.vstack((rim, [[0, 0, 5]]))  # the tip must not lift the rim
    triangles = [[k, (k + 1) % 6, 6] for k in range(6)]
    mesh = build_mesh(positions, np.zeros((7, 2)), triangles, np.zeros(6), (Material("skin"),))
    finer = subdivide(mesh, 1).mesh
    np.testing.assert_allclose(finer.positions[:6], rim * 7 / 8, atol=1e-6)
    np.testing.assert_allclose(finer.positions[6], [0, 0, 5 * 5 / 8], atol=1e-6)
    middles = np.sort(np.linalg.norm(finer.positions[7:][finer.positions[7:, 2] == 0], axis=1))
    np.testing.assert_allclose(middles, np.full(6, np.cos(np.pi / 6)), atol=1e-6)


def test_seam_stays_welded_and_uncreased_and_uv_stays_cut() -> None:
    sphere = uv_sphere(50, 16, 8)
    finer = subdivide(sphere, 2).mesh
    assert finer.point.max() + 1 == weld(finer.positions).max() + 1
    first = np.zeros(finer.point.max() + 1, dtype=int)
    first[finer.point] = np.arange(len(finer.point))
    np.testing.assert_array_equal(finer.positions, finer.positions[first[finer.point]])
    np.testing.assert_array_equal(finer.normals, finer.normals[first[finer.point]])
    at_seam = np.bincount(finer.point) == 2
    spread = np.abs(finer.uv[:, 0] - finer.uv[first[finer.point], 0])[at_seam[finer.point]]
    assert spread.max() == 1
    assert finer.uv.min() >= 0 and finer.uv.max() <= 1


def test_uv_is_linear_and_no_chart_changes() -> None:
    sphere = uv_sphere(50, 16, 8)
    finer = subdivide(sphere, 2).mesh
    before, after = find_charts(sphere), find_charts(finer)
    np.testing.assert_array_equal(np.repeat(before, 16), after)
    np.testing.assert_allclose(chart_uv_area(sphere, before), chart_uv_area(finer, after), rtol=1e-6)
    a, b, c = sphere.uv[sphere.triangles[7]]
    once = subdivide(sphere, 1).mesh
    np.testing.assert_allclose(once.uv[once.triangles[28]], [a, (a + b) / 2, (a + c) / 2])


def test_open_border_stays_open_and_flat() -> None:
    flat = plane(100, 4)
    finer = subdivide(flat, 2).mesh
    assert np.abs(finer.positions[:, 2]).max() == 0
    assert np.abs(finer.positions[:, :2]).max() <= 50
    ends, _, counts = edges(finer.point[finer.triangles])
    assert int(finer.point.max()) + 1 - len(ends) + len(finer.triangles) == 1
    border = np.unique(ends[counts == 1])
    assert len(border) == 4 * 4 * 4
    # the middle of a side keeps to its straight line
    x = finer.positions[np.isin(finer.point, border), 0]
    assert (x == -50).sum() > 10


def test_materials_are_kept() -> None:
    flat = plane(100, 2)
    two = (Material("skin"), Material("eyes", "opaque"))
    mesh = build_mesh(flat.positions, flat.uv, flat.triangles, np.arange(8) % 2, two)
    finer = subdivide(mesh, 1).mesh
    np.testing.assert_array_equal(finer.material, np.repeat(mesh.material, 4))
    assert finer.materials == two
    # each of the four lies within the uv of the triangle it came from
    centre = mesh.uv[mesh.triangles].mean(axis=1)
    np.testing.assert_allclose(finer.uv[finer.triangles].mean(axis=1)[3::4], centre, atol=1e-6)


def test_invalid_levels_are_refused() -> None:
    flat = plane(100, 1)
    assert subdivide(flat, 0).mesh is flat and subdivide(flat, 0).stencils is None
    for levels in (-1, 4):
        with pytest.raises(DermisError, match="0 to 3 levels"):
            subdivide(flat, levels)
