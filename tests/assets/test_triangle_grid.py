"""Cells that hold every triangle which passes through them, and normals that turn slowly."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.assets.primitives import plane, uv_sphere, wedge
from dermis.assets.smooth_normals import smooth_normals
from dermis.assets.triangle_grid import build_grid
from dermis.errors import DermisError


@pytest.mark.parametrize("mesh", [uv_sphere(30.0, 24, 12), wedge(20.0, 1.0, 5.0), plane(40.0, 3)])
def test_each_place_of_a_triangle_finds_it_in_its_cell(mesh: object) -> None:
    grid = build_grid(mesh)  # type: ignore[arg-type]
    rng = np.random.default_rng(1)
    triangle = rng.integers(0, len(mesh.triangles), 500)  # type: ignore[attr-defined]
    w = rng.dirichlet(np.ones(3), 500)
    points = np.einsum("nk,nkc->nc", w, mesh.positions[mesh.triangles[triangle]])  # type: ignore[attr-defined]
    cell = np.floor((points - grid.low) / grid.cell_mm).astype(int)
    assert (cell >= 0).all() and (cell < grid.size).all()
    index = cell[:, 0] + grid.size[0] * (cell[:, 1] + grid.size[1] * cell[:, 2])
    for one, found in zip(triangle, index, strict=True):
        assert one in grid.triangle[grid.first[found] : grid.first[found + 1]]
    assert grid.first[-1] == len(grid.triangle)


def test_smoothing_keeps_a_sphere_and_rounds_a_crease() -> None:
    ball = uv_sphere(30.0, 64, 32)
    assert (smooth_normals(ball, 1.0) * ball.normals).sum(axis=1).min() > 0.999
    box = wedge(20.0, 20.0, 20.0, cells=20)
    turned = np.degrees(np.arccos(np.clip((smooth_normals(box, 1.0) * box.normals).sum(axis=1), -1, 1)))
    away = np.sort(np.abs(box.positions), axis=1)[:, 1] < 5.0  # from the edges
    assert turned[away].max() < 1e-3
    assert turned.max() > 10.0


def test_a_wedge_is_closed_and_as_thick_as_asked() -> None:
    mesh = wedge(30.0, 2.0, 6.0, cells=3)
    corners = mesh.positions[mesh.triangles].astype(float)
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(30.0 * 30.0 * 4.0, rel=1e-5)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    assert np.abs(area).max() < 1e-3  # closed
    with pytest.raises(DermisError, match="sides above 0"):
        wedge(30.0, 0.0, 6.0)
