"""Error messages of mesh checks: subject, fault and advice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.formats.mesh_checks import check_mesh
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere


def _refused(mesh: Mesh) -> str:
    with pytest.raises(DermisError) as caught:
        check_mesh(mesh, "head.obj")
    message = str(caught.value)
    assert message.startswith("head.obj: expected ")
    return message


def _edited(mesh: Mesh, **changes: object) -> Mesh:
    return replace(mesh, **changes)


def test_valid_meshes_pass() -> None:
    check_mesh(uv_sphere(100, 24, 12), "sphere")
    check_mesh(plane(200, 3), "plane")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_infinite_positions_are_refused(bad: float) -> None:
    sphere = uv_sphere(100, 12, 6)
    positions = sphere.positions.copy()
    positions[[3, 7], 1] = bad
    message = _refused(_edited(sphere, positions=positions))
    assert "finite positions" in message and "2 vertices" in message and "first 3" in message


def test_infinite_uv_is_refused() -> None:
    sphere = uv_sphere(100, 12, 6)
    uv = sphere.uv.copy()
    uv[5, 0] = np.nan
    assert "finite uv" in _refused(_edited(sphere, uv=uv))


def test_positions_beyond_a_kilometre_are_refused() -> None:
    assert "--unit-mm" in _refused(plane(1e7))


def test_meshes_without_triangles_are_refused() -> None:
    sphere = uv_sphere(100, 12, 6)
    nothing = _edited(sphere, triangles=sphere.triangles[:0], material=sphere.material[:0])
    assert "it has none" in _refused(nothing)


@pytest.mark.parametrize("index", [-1, 10_000])
def test_indices_out_of_range_are_refused(index: int) -> None:
    sphere = uv_sphere(100, 12, 6)
    triangles = sphere.triangles.copy()
    triangles[4, 1] = index
    message = _refused(_edited(sphere, triangles=triangles))
    assert "triangle indices" in message and str(index) in message


def test_uv_outside_one_tile_names_the_range_and_udim() -> None:
    sphere = uv_sphere(100, 12, 6)
    message = _refused(_edited(sphere, uv=sphere.uv * np.float32([1, 3]) - np.float32([0, 0.5])))
    assert "UDIM" in message and "v from -0.5 to 2.5" in message and "Pack Islands" in message
    check_mesh(_edited(sphere, uv=sphere.uv + np.float32(5e-5)), "rounding")


@pytest.mark.parametrize("shift", [2e-4, -2e-4])
@pytest.mark.parametrize("axis", [0, 1])
def test_uv_outside_the_tile_on_one_side_is_reported(shift: float, axis: int) -> None:
    flat = plane(100, 2)
    uv = flat.uv.copy()
    uv[:, axis] += np.float32(shift)
    assert "one tile" in _refused(_edited(flat, uv=uv))


def test_zero_area_triangles_are_counted_and_named() -> None:
    flat = plane(100, 2)
    triangles = np.vstack((flat.triangles, [[0, 0, 1], [0, 1, 2]]))  # a repeated corner, three in a row
    mesh = build_mesh(flat.positions, flat.uv, triangles, np.zeros(len(triangles)), flat.materials)
    message = _refused(mesh)
    assert "2 have none (zero area)" in message and "8, 9" in message and "Degenerate Dissolve" in message


def test_non_manifold_edge_is_found_across_a_uv_seam() -> None:
    sphere = uv_sphere(100, 12, 6)
    # a fin on an edge, on corner vertices of its own: only welding shows that the edge has three faces
    fin = np.vstack((sphere.positions[sphere.triangles[20, :2]], [[0, 300, 0]]))
    count = len(sphere.positions)
    positions = np.vstack((sphere.positions, fin))
    uv = np.vstack((sphere.uv, [[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]]))
    triangles = np.vstack((sphere.triangles, [[count, count + 1, count + 2]]))
    mesh = build_mesh(positions, uv, triangles, np.zeros(len(triangles)), sphere.materials)
    message = _refused(mesh)
    assert "1 edges are non-manifold" in message and "3 triangles" in message and "mm" in message


def test_skin_must_exist_and_have_triangles() -> None:
    sphere = uv_sphere(100, 12, 6)
    empty = _edited(sphere, materials=(Material("eyes", "opaque"), Material("My skin")))
    assert "'My skin' has no triangles" in _refused(empty)
    none = _edited(sphere, materials=(Material("eyes", "opaque"),))
    assert "none of its groups is skin (eyes)" in _refused(none)
    assert "material indices" in _refused(_edited(sphere, materials=()))
