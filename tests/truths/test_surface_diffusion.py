"""Heat on triangles against closed forms for planes and spheres, and conservation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import eval_legendre
from surface_areas import vertex_areas

from dermis.apps.truths.surface_diffusion import (
    TIME_STEPS_PER_LEVEL,
    diffuse_on_surface,
    longest_edge_mm,
    max_edge_mm,
    patch_margin_mm,
    resolved_levels,
    welded_surface,
)
from dermis.base.errors import DermisError
from dermis.mesh.primitives import plane, uv_sphere

Floats = NDArray[np.float64]
Surface = tuple[Floats, NDArray[np.int64]]

AXIS = np.array([0.36, 0.48, 0.8])
"""Axis of the harmonics, away from the poles of the spheres to avoid symmetry with the mesh."""


def rough_plane(size_mm: float, segments: int, roughness: float = 0.0) -> Surface:
    """Return a square whose inner vertices, except the middle one, are displaced by a fraction of a cell."""
    positions, triangles = welded_surface(plane(size_mm, segments))
    inside = (np.abs(positions[:, :2]) < 0.49 * size_mm).all(axis=1)
    inside[middle_of(positions)] = False
    off = np.random.default_rng(3).uniform(-roughness, roughness, (len(positions), 2)) * size_mm / segments
    positions[:, :2] += np.where(inside[:, None], off, 0)
    return positions, triangles


def middle_of(positions: Floats) -> int:
    return int(np.linalg.norm(positions, axis=1).argmin())


def point_of_light(surface: Surface) -> tuple[Floats, Floats]:
    """Return values (n, 1) with one unit of light at the middle vertex, and the areas of the vertices."""
    areas = vertex_areas(*surface)
    values = np.zeros((len(areas), 1))
    middle = middle_of(surface[0])
    values[middle] = 1 / areas[middle]
    return values, areas


def harmonic_decay(
    radius_mm: float, degree: int, variance: float, segments: int, steps: int = TIME_STEPS_PER_LEVEL
) -> float:
    """Return the remaining fraction of a spherical harmonic."""
    surface = welded_surface(uv_sphere(radius_mm, segments, segments // 2))
    values = eval_legendre(degree, surface[0] @ AXIS / radius_mm)[:, None]
    areas = vertex_areas(*surface)[:, None]
    spread = diffuse_on_surface(*surface, values, [variance], steps)[0]
    return float((areas * values * spread).sum() / (areas * values**2).sum())


@pytest.mark.parametrize(("roughness", "tolerance"), [(0.0, 0.012), (0.25, 0.025)])
@pytest.mark.parametrize("variances", [[1.0], [0.4, 1.0]])
def test_point_on_a_plane_spreads_to_the_gaussian(
    roughness: float, tolerance: float, variances: list[float]
) -> None:
    """The edges are the longest that are allowed: a cell's diagonal, plus the roughness at both ends.

    The error is twice as large on a rough mesh, because the point itself, a hat function on irregular
    triangles, is not quite round.
    """
    diagonal = np.sqrt(2) * (1 + 2 * roughness)
    surface = rough_plane(13.0, 2 * int(np.ceil(6.5 * diagonal / max_edge_mm(variances))), roughness)
    values, areas = point_of_light(surface)
    square = (surface[0] ** 2).sum(axis=1)
    for v, level in zip(variances, diffuse_on_surface(*surface, values, variances), strict=True):
        expected = np.exp(-square / (2 * v)) / (2 * np.pi * v)
        difference = level[:, 0] - expected
        assert np.abs(difference).max() < tolerance * expected.max()
        assert np.sqrt((areas * difference**2).sum() / (areas * expected**2).sum()) < tolerance
        assert (areas * level[:, 0] * square).sum() / (2 * v) == pytest.approx(1.0, abs=0.005)


def test_heat_does_not_ring_on_a_point() -> None:
    surface = rough_plane(8.0, 40)
    values, _ = point_of_light(surface)
    spread = diffuse_on_surface(*surface, values, [0.4, 1.0])
    assert spread.min() > -1e-4 * spread.max()


@pytest.mark.parametrize(
    ("radius_mm", "variance", "segments"), [(5, 7.41, 48), (20, 7.41, 136), (100, 100.0, 184)]
)
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_harmonics_of_a_sphere_decay(radius_mm: float, variance: float, segments: int, degree: int) -> None:
    expected = np.exp(-degree * (degree + 1) * variance / (2 * radius_mm**2))
    if (radius_mm, degree) == (5, 1):
        assert expected == pytest.approx(0.744, abs=1e-3)
    tolerance = 0.002 if radius_mm == 5 else 0.0002  # relative to the initial harmonic
    assert harmonic_decay(radius_mm, degree, variance, segments) == pytest.approx(expected, abs=tolerance)


def test_convergence_is_of_second_order_in_the_edge() -> None:
    expected = np.exp(-6 * 7.41 / 50)
    errors = [abs(harmonic_decay(5.0, 2, 7.41, segments, 60) / expected - 1) for segments in (36, 72, 144)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 1.8).all(), errors


def test_convergence_is_of_second_order_in_time() -> None:
    exact, *coarser = (harmonic_decay(5.0, 3, 7.41, 36, steps) for steps in (200, 4, 8, 16))
    errors = np.abs(np.array(coarser) - exact)
    assert (np.log2(errors[:-1] / errors[1:]) > 1.8).all(), errors


def test_levels_of_a_cascade_equal_separate_levels() -> None:
    surface = rough_plane(6.0, 30)
    values = np.cos(surface[0][:, :2] * 1.3)
    together = diffuse_on_surface(*surface, values, [0.4, 1.0, 3.0], 24)
    for variance, level in zip([0.4, 1.0, 3.0], together, strict=True):
        alone = diffuse_on_surface(*surface, values, [variance], 24)[0]
        assert np.allclose(level, alone, atol=2e-4)


@pytest.mark.parametrize("surface", [rough_plane(8.0, 30, 0.25), welded_surface(uv_sphere(3.0, 48, 24))])
def test_light_is_conserved_and_a_constant_stays(surface: Surface) -> None:
    areas = vertex_areas(*surface)
    values = np.column_stack((np.random.default_rng(0).random(len(areas)), np.full(len(areas), 0.7)))
    levels = diffuse_on_surface(*surface, values, [1.5, 6.0])
    assert np.allclose((areas[:, None] * levels).sum(axis=1), areas @ values, rtol=1e-10, atol=0)
    assert np.allclose(levels[..., 1], 0.7, rtol=1e-10, atol=0)
    assert levels[1, :, 0].std() < levels[0, :, 0].std() < 0.2 * values[:, 0].std()


def test_borders_are_insulating() -> None:
    """A straight border mirrors heat."""
    whole = rough_plane(12.0, 48)
    kept = (whole[0][whole[1]][:, :, 0] <= 1e-6).all(axis=1)
    half = whole[0], whole[1][kept]
    position = np.flatnonzero(whole[0][:, 0] <= 1e-6)
    values = np.exp(-((np.abs(whole[0][:, :1]) - 1) ** 2 + whole[0][:, 1:2] ** 2))
    mirrored = diffuse_on_surface(*whole, values, [1.0])[0]
    assert np.allclose(diffuse_on_surface(*half, values, [1.0])[0][position], mirrored[position], atol=2e-3)


def test_a_vertex_without_triangles_keeps_its_value() -> None:
    positions, triangles = rough_plane(6.0, 16)
    positions = np.vstack((positions, [[99.0, 0.0, 0.0]]))
    values = np.append(positions[:-1, 0], 5.0)[:, None]
    assert diffuse_on_surface(positions, triangles, values, [2.0])[0, -1, 0] == pytest.approx(5.0)


def test_degenerate_triangles_leave_results_finite() -> None:
    """The mesh has a vertex in the middle of an edge, and two corners at one position."""
    positions, triangles = rough_plane(6.0, 20)
    a, b, c = triangles[100]
    positions = np.vstack((positions, (positions[a] + positions[b]) / 2, positions[a]))
    triangles = np.vstack((triangles, [[a, len(positions) - 2, b], [a, len(positions) - 1, c]]))
    values = np.append(positions[:, :1], np.ones((len(positions), 1)), axis=1)
    spread = diffuse_on_surface(positions, triangles, values, [1.0])[0]
    sound = diffuse_on_surface(positions[:-2], triangles[:-2], values[:-2], [1.0])[0]
    assert np.allclose(spread[:-2], sound, atol=0.02)
    assert np.allclose(spread[:, 1], 1.0)


def test_resolved_lists_levels_whose_addition_spans_two_edges() -> None:
    assert resolved_levels([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41], 0.11).tolist() == [False, *[True] * 5]
    assert resolved_levels([1.0, 1.5, 2.5], 0.5).tolist() == [True, False, True]
    assert max_edge_mm([1.0, 1.25, 2.5]) == pytest.approx(0.25)
    assert patch_margin_mm([1.0, 4.0]) == 8.0
    positions, triangles = rough_plane(6.0, 20)
    assert longest_edge_mm(positions, triangles) == pytest.approx(0.3 * np.sqrt(2))


def test_long_edges_are_refused_with_the_allowed_levels() -> None:
    positions, triangles = rough_plane(6.0, 10)
    values = np.ones((len(positions), 1))
    with pytest.raises(DermisError, match=r"0\.15 mm.*got 0\.849 mm.*variances 3, 7\.5\. Refine"):
        diffuse_on_surface(positions, triangles, values, [0.09, 3.0, 7.5])


@pytest.mark.parametrize(
    ("values", "variances", "steps", "complaint"),
    [
        (np.ones((121, 1)), [3.0, 3.0], 4, "increasing variances above 0"),
        (np.ones((121, 1)), [], 4, "increasing variances above 0"),
        (np.ones((121, 1)), [float("nan")], 4, "increasing variances above 0"),
        (np.ones(121), [3.0], 4, "finite values"),
        (np.full((121, 1), np.inf), [3.0], 4, "finite values"),
        (np.ones((121, 1)), [3.0], 0, "at least one time step"),
    ],
)
def test_invalid_arguments_are_refused(
    values: Floats, variances: list[float], steps: int, complaint: str
) -> None:
    with pytest.raises(DermisError, match=complaint):
        diffuse_on_surface(*rough_plane(6.0, 10), values, variances, steps)


def test_invalid_surface_is_refused() -> None:
    positions, triangles = rough_plane(6.0, 10)
    for bad in ((positions[:-1], triangles), (positions[:, :2], triangles), (positions * np.nan, triangles)):
        with pytest.raises(DermisError, match="finite positions"):
            longest_edge_mm(*bad)
