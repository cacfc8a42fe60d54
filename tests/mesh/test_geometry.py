"""Welding, normals and tangents of shapes with known answers."""

from __future__ import annotations

import numpy as np

from dermis.mesh.geometry import edges, triangle_areas, vertex_normals, weld
from dermis.mesh.mesh import Material, build_mesh
from dermis.mesh.primitives import plane, uv_sphere

SKIN = (Material("skin"),)


def test_weld_is_exact_and_ignores_the_sign_of_zero() -> None:
    rows = np.array([[0, 0, 1], [-0.0, 0, 1], [0, 0, np.nextafter(np.float32(1), np.float32(2))], [0, 0, 1]])
    point = weld(rows)
    assert point[0] == point[1] == point[3] != point[2]
    assert sorted(set(point.tolist())) == [0, 1]


def test_sphere_is_closed_and_without_flat_triangles() -> None:
    sphere = uv_sphere(50, 24, 12)
    ends, _, counts = edges(sphere.point[sphere.triangles])
    assert (counts == 2).all()
    assert sphere.point.max() + 1 - len(ends) + len(sphere.triangles) == 2
    areas = triangle_areas(sphere.positions[sphere.triangles])
    assert areas.min() > 0.01 * areas.max()
    np.testing.assert_allclose(areas.sum(), 4 * np.pi * 50**2, rtol=0.03)
    np.testing.assert_allclose(np.linalg.norm(sphere.positions, axis=1), 50, rtol=1e-6)


def test_sphere_faces_outwards_and_u_runs_to_the_right_in_front() -> None:
    sphere = uv_sphere(50, 24, 12)
    corners = sphere.positions[sphere.triangles]
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outwards * corners.mean(axis=1)).sum(axis=1) > 0).all()
    front = np.flatnonzero(sphere.positions[:, 2] == sphere.positions[:, 2].max())[0]
    np.testing.assert_allclose(sphere.uv[front], [0.5, 0.5], atol=1e-6)
    assert sphere.dpdu[front, 0] > 0
    assert sphere.dpdv[front, 1] < 0


def test_computed_normals_of_a_sphere_have_no_crease_at_the_seam() -> None:
    sphere = uv_sphere(50, 48, 24)
    computed = vertex_normals(sphere.positions, sphere.point, sphere.triangles)
    np.testing.assert_allclose(np.linalg.norm(computed, axis=1), 1, atol=1e-6)
    cosine = (computed * sphere.positions / 50).sum(axis=1)
    assert cosine.min() > np.cos(np.radians(1.5))
    order = np.argsort(sphere.point, kind="stable")
    same = sphere.point[order][1:] == sphere.point[order][:-1]
    assert same.sum() > 24
    np.testing.assert_array_equal(computed[order][1:][same], computed[order][:-1][same])


def test_normals_weigh_angles_not_the_number_of_triangles() -> None:
    # a cube corner; one of its three faces is cut in two, which must not pull the normal
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]], dtype=np.float32)
    triangles = np.array([[0, 1, 4], [0, 4, 2], [0, 2, 3], [0, 3, 1]], dtype=np.int32)
    normal = vertex_normals(positions, weld(positions), triangles)[0]
    np.testing.assert_allclose(normal, np.ones(3) / np.sqrt(3), atol=1e-6)


def test_tangents_of_a_plane_equal_its_size_over_its_uv() -> None:
    flat = plane(120, 5, uv_scale=0.4)
    np.testing.assert_allclose(flat.dpdu, np.broadcast_to([300, 0, 0], flat.dpdu.shape), atol=1e-2)
    np.testing.assert_allclose(flat.dpdv, np.broadcast_to([0, -300, 0], flat.dpdv.shape), atol=1e-2)
    np.testing.assert_allclose(flat.normals, np.broadcast_to([0, 0, 1], flat.normals.shape), atol=1e-6)


def test_tangents_follow_a_sheared_map() -> None:
    flat = plane(10, 3)
    u, v = flat.uv.T.astype(float)
    # u' = u/2 + v/4, v' = v/2, so that d/du' = 2 d/du and d/dv' = 2 d/dv - d/du
    uv = np.column_stack((u / 2 + v / 4, v / 2))
    sheared = build_mesh(flat.positions, uv, flat.triangles, flat.material, SKIN)
    np.testing.assert_allclose(sheared.dpdu, np.broadcast_to([20, 0, 0], sheared.dpdu.shape), atol=1e-4)
    np.testing.assert_allclose(sheared.dpdv, np.broadcast_to([-10, -20, 0], sheared.dpdv.shape), atol=1e-4)


def test_tangents_without_uv_area_are_short_but_not_zero() -> None:
    flat = plane(10, 2)
    collapsed = build_mesh(flat.positions, np.full_like(flat.uv, 0.5), flat.triangles, flat.material, SKIN)
    for tangent in (collapsed.dpdu, collapsed.dpdv):
        np.testing.assert_allclose(np.linalg.norm(tangent, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose((tangent * collapsed.normals).sum(axis=1), 0, atol=1e-6)
    np.testing.assert_allclose((collapsed.dpdu * collapsed.dpdv).sum(axis=1), 0, atol=1e-6)


def test_a_triangle_without_uv_area_does_not_disturb_its_neighbours() -> None:
    flat = plane(10, 1)
    # a triangle on the same corner vertices of one side has a uv area of 0: its third corner lies on the side
    positions = np.vstack((flat.positions, [[0, 0, 4]]))
    a, b = flat.triangles[0, :2]
    uv = np.vstack((flat.uv, flat.uv[[a, b]].mean(axis=0, keepdims=True)))
    triangles = np.vstack((flat.triangles, [[b, a, len(flat.positions)]]))
    mesh = build_mesh(positions, uv, triangles, np.zeros(len(triangles)), SKIN)
    np.testing.assert_allclose(mesh.dpdu[:-1], flat.dpdu, atol=1e-5)
    np.testing.assert_allclose(mesh.dpdv[:-1], flat.dpdv, atol=1e-5)


def test_cancelling_faces_give_a_finite_unit_normal() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
    mesh = build_mesh(positions, positions[:, :2], [[0, 1, 2], [0, 2, 1]], [0, 0], SKIN)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-6)
    assert np.isfinite(mesh.dpdu).all()


def test_given_normals_are_kept_only_where_they_are_unit() -> None:
    flat = plane(10, 1)
    given = np.tile([0.0, 0.6, 0.8], (4, 1))
    given[1], given[2], given[3] = np.nan, 0, 7
    mesh = build_mesh(flat.positions, flat.uv, flat.triangles, flat.material, SKIN, normals=given)
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8], [0, 0, 1], [0, 0, 1], [0, 0, 1]], atol=1e-6)


def test_mesh_arrays_have_their_dtypes() -> None:
    mesh = plane(10, 2)
    for values in (mesh.positions, mesh.normals, mesh.uv, mesh.dpdu, mesh.dpdv):
        assert values.dtype == np.float32
    for values in (mesh.point, mesh.triangles, mesh.material):
        assert values.dtype == np.int32
