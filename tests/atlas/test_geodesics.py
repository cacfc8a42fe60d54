"""Geodesics compared with straight lines on the unrolled surface, and cuts of overlapping gutters."""

from __future__ import annotations

import numpy as np
import pytest
from cut_meshes import cut_cone, cut_cylinder, cut_sphere
from numpy.typing import NDArray

from dermis.atlas.stitched.build import find_chart_pieces
from dermis.atlas.stitched.geodesics import trace_geodesics
from dermis.atlas.stitched.overlap_cuts import cut_overlaps, find_gutter_conflicts
from dermis.atlas.stitched.surface import FlatSurface, flat_surface
from dermis.mesh.mesh import Mesh, build_mesh

Floats = NDArray[np.float64]
RADIUS, HEIGHT, CELLS = 30.0, 80.0, 12
FACETS = 3 * CELLS
WIDTH = 2 * RADIUS * np.sin(np.pi / FACETS)  # of a facet: the mesh is a prism


def go(
    surface: FlatSurface, triangle: NDArray[np.int32], start: Floats, target: Floats
) -> tuple[Floats, Floats]:
    """Return the ends of geodesics in space, and whether they are complete."""
    ends = trace_geodesics(surface.adjacency, triangle, start, target)
    weights = np.column_stack((1 - ends.weights.sum(axis=1), ends.weights))
    return np.einsum("nk,nkc->nc", weights, surface.corners[ends.triangle]), ends.complete


def around(points: Floats) -> Floats:
    """Return the points (n, 2) on the unrolled prism: along its facets, and height."""
    angle = np.arctan2(points[:, 0], points[:, 2]) % (2 * np.pi)
    facet = np.floor(angle / (2 * np.pi / FACETS))
    middle = (facet + 0.5) * 2 * np.pi / FACETS
    within = points[:, 0] * np.cos(middle) - points[:, 2] * np.sin(middle)
    return np.column_stack(((facet + 0.5) * WIDTH + within, points[:, 1]))


def random_walks(surface: FlatSurface, length: float) -> tuple[NDArray[np.int32], Floats, Floats]:
    rng = np.random.default_rng(5)
    triangle = rng.integers(0, len(surface.uv), 2000).astype(np.int32)
    corners = surface.adjacency.planar_corners[triangle]
    start = np.einsum("nk,nkc->nc", rng.dirichlet(np.ones(3), 2000), corners)
    angle = rng.uniform(0, 2 * np.pi, 2000)
    return triangle, start, start + length * np.column_stack((np.cos(angle), np.sin(angle)))


def prism(flipped: bool) -> Mesh:
    mesh = cut_cylinder(RADIUS, HEIGHT, CELLS)
    triangles = mesh.triangles.copy()
    if flipped:  # every other triangle is listed the other way round
        triangles[::2] = triangles[::2, ::-1]
    return build_mesh(mesh.positions, mesh.uv, triangles, mesh.material, mesh.materials)


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("length", [1.0, 20.0, 150.0])
def test_geodesics_on_a_prism_are_straight_lines_when_unrolled(length: float, flipped: bool) -> None:
    surface = flat_surface(prism(flipped))
    triangle, start, target = random_walks(surface, length)
    ends, complete = go(surface, triangle, start, target)
    begins = np.einsum("nk,nkc->nc", _weights(surface, triangle, start), surface.corners[triangle])
    along = _step(surface, triangle, target - start)
    expected = around(begins) + along
    inside = np.abs(expected[:, 1]) < HEIGHT / 2 - 0.05
    beyond = np.abs(expected[:, 1]) > HEIGHT / 2 + 0.05
    assert complete[inside].all() and not complete[beyond].any()
    off = around(ends) - expected
    off[:, 0] = (off[:, 0] + FACETS * WIDTH / 2) % (FACETS * WIDTH) - FACETS * WIDTH / 2
    # a walk starts a thousandth of the way to the triangle's middle, and so leaves at another angle
    assert np.abs(off[inside]).max() < 0.02
    # where the surface ends first, the walk ends on its edge
    assert np.abs(np.abs(ends[beyond, 1]) - HEIGHT / 2).max(initial=0) < 1e-3


def _weights(surface: FlatSurface, triangle: NDArray[np.int32], place: Floats) -> Floats:
    p = surface.adjacency.planar_corners[triangle]
    matrix = np.concatenate((p.transpose(0, 2, 1), np.ones((len(p), 1, 3))), axis=1)
    right = np.column_stack((place, np.ones(len(p))))[..., None]
    return np.asarray(np.linalg.solve(matrix, right)[..., 0])


def _step(surface: FlatSurface, triangle: NDArray[np.int32], step: Floats) -> Floats:
    """Return a step in a triangle's plane as a step along the prism's facets and up."""
    corners = surface.corners[triangle]
    x = corners[:, 1] - corners[:, 0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    normal = np.cross(x, corners[:, 2] - corners[:, 0])
    y = np.cross(normal, x) / np.linalg.norm(normal, axis=1, keepdims=True)
    space = step[:, :1] * x + step[:, 1:] * y
    facet = around(corners.mean(axis=1))[:, 0] // WIDTH
    angle = (facet + 0.5) * 2 * np.pi / FACETS
    tangent = np.column_stack((np.cos(angle), 0 * angle, -np.sin(angle)))
    return np.column_stack(((space * tangent).sum(axis=1), space[:, 1]))


def test_a_closed_geodesic_on_a_sphere_returns_to_its_start() -> None:
    """Check that great circles close, up to an error by facets."""
    surface = flat_surface(cut_sphere(20.0, 32))
    triangle, start, target = random_walks(surface, 2 * np.pi * 20.0)
    ends, complete = go(surface, triangle, start, target)
    begins = np.einsum("nk,nkc->nc", _weights(surface, triangle, start), surface.corners[triangle])
    assert complete.all()
    assert np.percentile(np.linalg.norm(ends - begins, axis=1), 90) < 0.05 * 2 * np.pi * 20.0


def test_overlapping_charts_are_cut_until_gutters_fit() -> None:
    """Check the unrolled cone, whose sides meet at the apex and would need the same texels."""
    surface = flat_surface(cut_cone(40.0, 50.0))
    piece, _ = find_chart_pieces(surface)
    assert piece.max() == 0
    complete = find_gutter_conflicts(surface, piece >= 0, np.flatnonzero(piece == 0), 8.0).length_mm
    cut = cut_overlaps(surface, piece, 8.0)
    assert 1 <= cut.max() <= 3
    assert np.array_equal(cut >= 0, piece >= 0)
    left = sum(
        find_gutter_conflicts(surface, cut >= 0, np.flatnonzero(cut == k), 8.0).length_mm
        for k in range(int(cut.max()) + 1)
    )
    assert complete > 8.0
    assert left < 0.5 * complete


@pytest.mark.parametrize("mesh", [cut_cylinder(RADIUS, HEIGHT, 6), cut_sphere(30.0, 12)])
def test_charts_without_overlap_are_not_cut(mesh: Mesh) -> None:
    surface = flat_surface(mesh)
    piece, _ = find_chart_pieces(surface)
    cut = cut_overlaps(surface, piece, 8.0)
    assert cut.max() == piece.max()
