"""Curvature on the device: closed forms, a float64 reference, and heads in motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from curvature_twin import curvature_twin
from cut_meshes import cut_sphere
from numpy.typing import NDArray
from setups import head_of

from dermis.atlas.build import build_atlas
from dermis.frame.features.shape import curvature
from dermis.frame.features.shape.curvature import make_curvature
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import evaluate_rest_shape, shape_tables
from dermis.gpu import CommandList, Device
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere

Floats = NDArray[np.float64]
SIDE = 64  # of the atlas, which curvature does not depend on


def found(device: Device, mesh: Mesh, positions_mm: NDArray[np.float32] | None = None) -> Floats:
    """Return the (v,) curvature of a mesh, or of the mesh with moved points [1/mm]."""
    head = head_of(mesh)
    points = head.positions_mm if positions_mm is None else positions_mm
    shape = evaluate_rest_shape(device, shape_tables(device, head), points)
    made, frame = make_curvature(device, mesh), CommandList(device)
    atlas = build_atlas(mesh, SIDE, "mesh")
    curvature.draw(frame, upload_geometry(device, mesh, atlas, shape), made)
    frame.submit()
    return np.frombuffer(device.handle.queue.read_buffer(made.smoothed), np.float32).astype(np.float64)


def half_pipe(radius_mm: float, segments: int = 48) -> Mesh:
    """Return a plane bent about the vertical by half a turn, with the normals of the cylinder."""
    flat = plane(np.pi * radius_mm, segments)
    angle = flat.positions[:, 0] / radius_mm
    normals = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    positions = radius_mm * normals + flat.positions * [0, 1, 0]
    return build_mesh(positions, flat.uv, flat.triangles, flat.material, SKIN_MATERIALS, normals)


@pytest.mark.parametrize("radius_mm", [5.0, 20.0, 100.0])
def test_curvature_of_a_sphere_is_its_inverse_radius(device: Device, radius_mm: float) -> None:
    """Expect 1/r at every corner, poles and seam included."""
    assert np.allclose(found(device, uv_sphere(radius_mm, 64, 32)), 1 / radius_mm, rtol=0.01)


def test_curvature_of_a_plane_is_zero(device: Device) -> None:
    assert found(device, plane(50.0, 8)).max() < 1e-6


def test_curvature_of_a_cylinder_matches_its_radius(device: Device) -> None:
    """The root mean square of curvatures 1/r and 0 is 1/r over the square root of 2."""
    assert np.allclose(found(device, half_pipe(20.0)), np.sqrt(0.5) / 20.0, rtol=0.01)


def test_degenerate_triangles_leave_curvature_finite(device: Device) -> None:
    ball = uv_sphere(20.0, 48, 24)
    spoilt = replace(
        ball,
        triangles=np.vstack([ball.triangles, [[5, 5, 9]]]).astype(np.int32),
        material=np.append(ball.material, 0).astype(np.int32),
    )
    assert np.allclose(found(device, spoilt), 0.05, rtol=0.02)


@pytest.mark.parametrize("radius_mm", [9.0, 30.0])  # an even and an odd number of steps
def test_curvature_agrees_with_float64(device: Device, radius_mm: float) -> None:
    """Compare on a dented ball, whose seams cross curved regions."""
    mesh = dented(radius_mm)
    steps = make_curvature(device, mesh).steps
    assert np.allclose(found(device, mesh), curvature_twin(mesh, steps), rtol=1e-4, atol=1e-6)


def test_curvature_follows_the_deformed_surface(device: Device) -> None:
    ball, dent = cut_sphere(30.0, 16), dented(30.0)
    points = np.zeros((int(ball.point.max()) + 1, 3), np.float32)
    points[dent.point] = dent.positions
    steps = make_curvature(device, ball).steps
    moved = found(device, ball, points)
    assert np.allclose(moved, curvature_twin(dent, steps), rtol=1e-4, atol=1e-6)
    assert np.abs(moved - found(device, ball)).max() > 0.01


def dented(radius_mm: float) -> Mesh:
    """Return a ball with bumps and hollows."""
    ball = cut_sphere(radius_mm, 16)
    x, y, z = ball.positions.T / radius_mm
    bumps = 1 + 0.1 * np.sin(5 * x + 1) * np.cos(4 * y) * np.cos(3 * z)
    places = (ball.positions * bumps[:, None]).astype(np.float32)
    return build_mesh(places, ball.uv, ball.triangles, ball.material, ball.materials, point=ball.point)
