"""Intrinsic Delaunay flips, and the matrices of the heat equation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_areas import vertex_areas

from dermis.apps.truths.surface_diffusion import (
    intrinsic_delaunay,
    intrinsic_triangulation,
    mass_and_stiffness,
    welded_surface,
)
from dermis.mesh.primitives import plane

Floats = NDArray[np.float64]


def skewed_plane(cells: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return a square grid of triangles that lean over three cells, with angles of 153 degrees."""
    row, column = (index.ravel() for index in np.mgrid[: cells + 1, : cells + 1])
    positions = np.column_stack((column, row, 0 * row)).astype(np.float64)
    r, c = (index.ravel() for index in np.mgrid[:cells, : cells - 3])
    a, stride = r * (cells + 1) + c, cells + 1
    triangles = np.vstack(
        (
            np.column_stack((a, a + 1, a + stride + 3)),
            np.column_stack((a + 1, a + stride + 4, a + stride + 3)),
        )
    )
    return positions, triangles


def test_edge_flips_reduce_obtuse_triangles() -> None:
    """The sheared triangles become halves of the grid's squares, except at the sheared borders."""
    positions, triangles = skewed_plane(30)
    skewed = intrinsic_triangulation(positions, triangles)
    flipped = intrinsic_delaunay(skewed)
    assert flipped.areas().sum() == pytest.approx(skewed.areas().sum(), rel=1e-9)
    assert (skewed.cotangents().min(axis=1) < -1.99).all()
    assert np.mean(flipped.length[flipped.side].max(axis=1) < 1.5) > 0.9
    weight = np.bincount(flipped.side.ravel(), flipped.cotangents().ravel())
    inner = np.bincount(flipped.side.ravel()) == 2
    assert weight[inner].min() > -1e-5


def test_flips_on_a_curved_surface_keep_its_area_and_its_borders() -> None:
    (x, y, _), triangles = skewed_plane(30)[0].T, skewed_plane(30)[1]
    given = intrinsic_triangulation(np.column_stack((6 * np.sin(x / 6), y, 6 * np.cos(x / 6))), triangles)
    flipped = intrinsic_delaunay(given)
    assert np.mean(flipped.corners == given.corners) < 0.5
    assert flipped.areas().sum() == pytest.approx(given.areas().sum(), rel=1e-9)
    uses = np.bincount(flipped.side.ravel())
    assert np.array_equal(uses, np.bincount(given.side.ravel()))
    assert np.array_equal(flipped.length[uses == 1], given.length[uses == 1])


def test_operators_have_the_areas_and_linear_functions_have_no_curvature() -> None:
    positions, triangles = welded_surface(plane(5.0, 12))
    inside = (np.abs(positions[:, :2]) < 2.49).all(axis=1)
    off = np.random.default_rng(5).uniform(-0.12, 0.12, (len(positions), 2))
    positions[:, :2] += np.where(inside[:, None], off, 0)
    mass, stiffness = mass_and_stiffness(
        intrinsic_delaunay(intrinsic_triangulation(positions, triangles)), len(positions)
    )
    assert mass.sum() == pytest.approx(25.0)
    assert np.allclose(mass.sum(axis=1), vertex_areas(positions, triangles))
    assert np.allclose((stiffness @ positions)[inside], 0, atol=1e-12)
    assert positions[:, 0] @ (stiffness @ positions[:, 0]) == pytest.approx(25.0)  # integral of the gradient²
