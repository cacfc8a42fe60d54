"""Curvature of meshes whose curvature is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dermis.mesh.curvature import vertex_curvature
from dermis.mesh.geometry import build_mesh
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import SKIN, plane, uv_sphere


def half_pipe(radius_mm: float, segments: int = 48) -> Mesh:
    """A plane bent about the vertical by half a turn, with the normals of the cylinder."""
    flat = plane(np.pi * radius_mm, segments)
    angle = flat.positions[:, 0] / radius_mm
    normals = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    positions = radius_mm * normals + flat.positions * [0, 1, 0]
    return build_mesh(positions, flat.uv, flat.triangles, flat.material, SKIN, normals)


@pytest.mark.parametrize("radius_mm", [5.0, 20.0, 100.0])
def test_sphere(radius_mm: float) -> None:
    """1/r at every corner, poles and seam included."""
    assert np.allclose(vertex_curvature(uv_sphere(radius_mm, 64, 32)), 1 / radius_mm, rtol=0.01)


def test_plane() -> None:
    assert vertex_curvature(plane(50.0, 8)).max() == 0


def test_cylinder() -> None:
    """Curved along one of two directions: the root mean square is 1/r over the root of 2."""
    pipe = half_pipe(20.0)
    assert np.allclose(vertex_curvature(pipe), np.sqrt(0.5) / 20.0, rtol=0.01)


def test_it_scales_with_the_head() -> None:
    """Away from what smoothing in mm does, which a sphere does not show."""
    ball = uv_sphere(20.0, 48, 24)
    double = replace(ball, positions=2 * ball.positions)
    assert np.allclose(vertex_curvature(double), 0.5 * vertex_curvature(ball), rtol=1e-3)


def test_triangles_without_area_do_no_harm() -> None:
    ball = uv_sphere(20.0, 48, 24)
    spoilt = replace(
        ball,
        triangles=np.vstack([ball.triangles, [[5, 5, 9]]]).astype(np.int32),
        material=np.append(ball.material, 0).astype(np.int32),
    )
    assert np.allclose(vertex_curvature(spoilt), 0.05, rtol=0.02)
