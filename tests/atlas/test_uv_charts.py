"""Charts of the uv layout, and which triangles are usable."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from loaded_mesh import load_mesh

from dermis.atlas.raster import chart_uv_area, find_charts, usable_triangles
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane, uv_sphere

SKIN = (Material("skin"),)


def _two_planes(scale: float) -> Mesh:
    """Return the two halves of a plane with a uv seam between them, the right one's uv scaled by `scale`."""
    flat = plane(10, 2)
    right = flat.positions[flat.triangles].mean(axis=1)[:, 0] > 0
    triangles = np.where(right[:, None], flat.triangles + len(flat.uv), flat.triangles)
    uv = np.vstack((flat.uv, 0.5 + (flat.uv - 0.5) * scale))
    return build_mesh(np.tile(flat.positions, (2, 1)), uv, triangles, np.zeros(8), SKIN)


def test_connected_surface_is_one_chart() -> None:
    assert set(find_charts(plane(10, 3)).tolist()) == {0}
    # the sphere's seam opens it but does not part it
    assert set(find_charts(uv_sphere(10, 12, 6)).tolist()) == {0}


def test_charts_are_separated_by_different_uv_and_not_by_different_normals() -> None:
    assert find_charts(_two_planes(1)).max() == 0
    parted = _two_planes(0.5)
    chart = find_charts(parted)
    assert chart.max() == 1
    right = parted.positions[parted.triangles].mean(axis=1)[:, 0] > 0
    assert len(set(chart[right])) == len(set(chart[~right])) == 1
    np.testing.assert_allclose(np.sort(chart_uv_area(parted, chart)), [0.125, 0.5], rtol=1e-6)


def test_charts_that_touch_at_one_corner_only_are_two() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    mesh = build_mesh(positions, positions[:, :2] / 4 + 0.5, [[0, 1, 2], [0, 3, 4]], [0, 0], SKIN)
    assert find_charts(mesh).max() == 1


def test_small_charts_are_usable_only_in_a_large_atlas() -> None:
    mesh = _two_planes(0.004)  # 8e-6 of the map: 2 texels at 512, 8.4 at 1024
    right = mesh.positions[mesh.triangles].mean(axis=1)[:, 0] > 0
    np.testing.assert_array_equal(usable_triangles(mesh, 512), ~right)
    assert usable_triangles(mesh, 1024).all()
    np.testing.assert_array_equal(usable_triangles(mesh, 1024, min_texels=9), ~right)


def test_triangles_without_uv_area_are_not_usable() -> None:
    flat = plane(10, 1)
    uv = flat.uv.copy()
    lone = np.setdiff1d(flat.triangles[0], flat.triangles[1])
    uv[lone] = uv[np.intersect1d(flat.triangles[0], flat.triangles[1])].mean(axis=0)
    mesh = build_mesh(flat.positions, uv, flat.triangles, [0, 0], SKIN)
    np.testing.assert_array_equal(usable_triangles(mesh, 1024), [False, True])


def test_charts_of_the_scan(sample_folder: Path) -> None:
    path = sample_folder / "heads" / "lee_perry_smith" / "LeePerrySmith.glb"
    mesh = load_mesh(path, unit_mm=50.35, v_origin="bottom")
    chart = find_charts(mesh)
    sizes = np.bincount(chart)
    assert sorted(sizes.tolist()) == sorted([15028, *(384, 58, 370, 264, 252) * 2])
    # only the two collapsed eye shells fall out, at every usual size
    for atlas in (1024, 2048, 4096):
        assert (~usable_triangles(mesh, atlas)).sum() == 2 * 264
