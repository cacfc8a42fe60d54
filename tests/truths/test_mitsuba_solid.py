"""Closed surfaces around skin: openings, depths and folds."""

from __future__ import annotations

import numpy as np
import pytest
from half_spaces import pan

from dermis.apps.truths.mitsuba_solid import ClosedSurface, closed_skin, offset_inwards
from dermis.base.errors import DermisError
from dermis.mesh.geometry import edges
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, uv_sphere


def is_closed(solid: ClosedSurface) -> bool:
    """Return whether each edge occurs once in each direction."""
    t = solid.triangles
    sides = np.vstack((t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]))
    forth = np.sort(sides[:, 0].astype(np.int64) * len(solid.positions) + sides[:, 1])
    back = np.sort(sides[:, 1].astype(np.int64) * len(solid.positions) + sides[:, 0])
    return bool(np.array_equal(forth, back) and len(np.unique(forth)) == len(forth))


def box(side_mm: float) -> Mesh:
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * side_mm / 2
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [half for a, b, c, d in faces for half in ([a, b, c], [a, c, d])]
    uv = np.random.default_rng(1).random((8, 2))
    return build_mesh(corner, uv, triangles, np.zeros(12), SKIN_MATERIALS)


def without(mesh: Mesh, kept: np.ndarray) -> Mesh:
    return build_mesh(
        mesh.positions, mesh.uv, mesh.triangles[kept], mesh.material[kept], mesh.materials, mesh.normals
    )


def test_closed_surface_is_unchanged() -> None:
    sphere = uv_sphere(10.0, 32, 16)
    solid = closed_skin(sphere, "sphere")
    assert is_closed(solid) and solid.caps == 0
    assert len(solid.triangles) == len(sphere.triangles)


def test_each_opening_is_closed() -> None:
    sphere = uv_sphere(10.0, 32, 16)
    height = sphere.positions[sphere.triangles][..., 1].mean(axis=1)
    solid = closed_skin(without(sphere, np.abs(height) < 8.0), "ring")
    assert is_closed(solid) and solid.caps == 2
    radius = np.sqrt(100.0 - solid.positions[:, 1].max() ** 2)
    assert solid.cap_area == pytest.approx(2.0 * np.pi * radius**2, rel=0.01)


def test_caps_do_not_change_the_front() -> None:
    solid = closed_skin(pan(40.0, 10.0, 8).mesh, "pan")
    assert is_closed(solid) and solid.caps == 1
    assert solid.cap_area == pytest.approx(1600.0)


def test_seams_of_uv_are_no_openings() -> None:
    sphere = uv_sphere(10.0, 32, 16)
    assert len(edges(sphere.point[sphere.triangles])[0]) < len(edges(sphere.triangles)[0])
    assert closed_skin(sphere, "sphere").caps == 0


def test_only_skin_counts() -> None:
    sphere = uv_sphere(10.0, 32, 16)
    kinds = (Material("skin"), Material("eye", "opaque"))
    material = (sphere.positions[sphere.triangles][..., 2].mean(axis=1) > 8.0).astype(np.int32)
    mixed = build_mesh(sphere.positions, sphere.uv, sphere.triangles, material, kinds, sphere.normals)
    assert closed_skin(mixed, "head").caps == 1
    blind = build_mesh(sphere.positions, sphere.uv, sphere.triangles, 0 * material, kinds[1:], sphere.normals)
    with pytest.raises(DermisError, match="expected skin to trace"):
        closed_skin(blind, "head")


def test_inverted_mesh_is_refused() -> None:
    sphere = uv_sphere(10.0, 32, 16)
    turned = build_mesh(
        sphere.positions,
        sphere.uv,
        sphere.triangles[:, ::-1],
        sphere.material,
        SKIN_MATERIALS,
        -sphere.normals,
    )
    with pytest.raises(DermisError, match="it is a sheet or inside out"):
        closed_skin(turned, "sphere")


@pytest.mark.parametrize("depth", [-0.5, 0.5, 2.0])
def test_faces_move_by_the_depth_even_at_corners(depth: float) -> None:
    solid = closed_skin(box(20.0), "box")
    moved, folded = offset_inwards(solid, np.full(8, depth), "box")
    assert folded == 0.0
    assert np.abs(moved.positions) == pytest.approx(np.full((8, 3), 10.0 - depth), abs=1e-5)


def test_depth_may_differ_from_point_to_point() -> None:
    solid = closed_skin(uv_sphere(10.0, 64, 32), "sphere")
    depth = 1.0 + 0.02 * solid.positions[:, 1].astype(np.float64)
    moved, _ = offset_inwards(solid, depth, "sphere")
    assert np.linalg.norm(moved.positions, axis=1) == pytest.approx(10.0 - depth, abs=0.01)


def test_folds_are_refused() -> None:
    solid = closed_skin(uv_sphere(10.0, 32, 16), "ball")
    with pytest.raises(DermisError, match="ball: expected a body deeper than its layers"):
        offset_inwards(solid, np.full(len(solid.positions), 12.0), "ball")


def test_creases_tighter_than_the_depth_are_refused() -> None:
    ball = uv_sphere(10.0, 64, 64)
    wave = 1.0 + 0.1 * np.sin(10.0 * np.arctan2(ball.positions[:, 0], ball.positions[:, 2]))
    creased = build_mesh(
        ball.positions * wave[:, None], ball.uv, ball.triangles, ball.material, SKIN_MATERIALS
    )
    solid = closed_skin(creased, "gear")
    with pytest.raises(DermisError, match=r"gear: .* [0-9.]+% of the surface folds over"):
        offset_inwards(solid, np.full(len(solid.positions), 2.0), "gear")
