"""Patches: the surface keeps its shape, points are located, and heat is that on the whole surface."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_areas import vertex_areas

from dermis.apps.truths.surface_diffusion import (
    diffuse_on_surface,
    longest_edge_mm,
    max_edge_mm,
    patch_margin_mm,
    welded_surface,
)
from dermis.apps.truths.surface_patch import SurfacePatch, refine_patch
from dermis.base.errors import DermisError
from dermis.mesh.geometry import edges, triangle_areas
from dermis.mesh.primitives import plane, uv_sphere
from dermis.scene.heads import load_head

Floats = NDArray[np.float64]

RADIUS_MM = 12.0
COARSE = welded_surface(uv_sphere(RADIUS_MM, 24, 12))
PLACE = RADIUS_MM * np.array([0.6, 0.0, 0.8])
VARIANCES = [1.0, 2.5]
SMALL = refine_patch(*COARSE, PLACE, 3.0, max_edge_mm(VARIANCES), patch_margin_mm(VARIANCES))
WHOLE = refine_patch(*COARSE, PLACE, np.inf, max_edge_mm(VARIANCES), patch_margin_mm(VARIANCES))


def uses(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    return edges(triangles)[2]


@pytest.mark.parametrize("patch", [SMALL, WHOLE])
def test_edges_are_short_and_the_surface_is_the_same(patch: SurfacePatch) -> None:
    assert longest_edge_mm(patch.positions, patch.triangles) <= max_edge_mm(VARIANCES)
    corners = COARSE[0][COARSE[1]][patch.parent]
    assert np.allclose(patch.weights @ corners, patch.positions[patch.triangles], atol=1e-12)
    fine, coarse = (
        np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (patch.weights @ corners, corners)
    )
    assert ((fine * coarse).sum(axis=1) > 0).all()
    assert np.array_equal(np.unique(patch.triangles), np.arange(len(patch.positions)))


def test_closed_surface_keeps_its_area() -> None:
    assert (uses(WHOLE.triangles) == 2).all() and WHOLE.contains(WHOLE.positions).all()
    area = triangle_areas(WHOLE.positions[WHOLE.triangles])
    per_parent = np.bincount(WHOLE.parent, area)
    assert np.allclose(per_parent, triangle_areas(COARSE[0][COARSE[1]]), rtol=1e-12)


def test_a_patch_has_one_border_outside_its_margin() -> None:
    ends, _, counts = edges(SMALL.triangles)
    border = np.unique(ends[counts == 1])
    assert counts.max() == 2
    distance = np.linalg.norm(SMALL.positions - PLACE, axis=1)
    assert distance[border].min() >= 3.0 + patch_margin_mm(VARIANCES) - max_edge_mm(VARIANCES)
    assert distance.max() < 3.0 + patch_margin_mm(VARIANCES) + 2 * max_edge_mm(VARIANCES)
    assert 0 < SMALL.contains(SMALL.positions).sum() < len(SMALL.positions)


def test_points_are_located() -> None:
    rng = np.random.default_rng(2)
    fine = rng.integers(len(SMALL.triangles), size=500)
    inside = rng.dirichlet(np.ones(3), 500)
    weights = np.einsum("mi,mij->mj", inside, SMALL.weights[fine])
    found, again = SMALL.locate(SMALL.parent[fine], weights)
    assert np.array_equal(found, fine) and np.allclose(again, inside, atol=1e-9)
    placed = SMALL.interpolate(SMALL.positions, found, again)
    assert np.allclose(placed, np.einsum("mi,mij->mj", weights, COARSE[0][COARSE[1]][SMALL.parent[fine]]))


def test_points_outside_the_patch_are_not_located() -> None:
    far = np.setdiff1d(np.arange(len(COARSE[1])), SMALL.parent)[:5]
    found, _ = SMALL.locate(far, np.full((5, 3), 1 / 3))
    assert (found == -1).all()


def test_vertices_have_barycentrics_on_the_coarse_surface() -> None:
    triangle, weights = SMALL.vertex_barycentrics()
    placed = np.einsum("mi,mij->mj", weights, COARSE[0][COARSE[1]][triangle])
    assert np.allclose(placed, SMALL.positions, atol=1e-12)


def heat(patch: SurfacePatch) -> tuple[Floats, Floats]:
    """Return positions and levels inside the valid region of the small patch, for uneven light."""
    values = 1 + np.cos(patch.positions @ np.array([[1.1, 0.2], [0.4, -0.9], [0.3, 0.7]]))
    levels = diffuse_on_surface(patch.positions, patch.triangles, values, VARIANCES)
    judged = SMALL.contains(patch.positions)
    order = np.lexsort(patch.positions[judged].round(9).T)
    return patch.positions[judged][order], levels[:, judged][:, order]


def test_heat_on_a_patch_matches_the_full_surface_inside_the_margin() -> None:
    points, exact = heat(WHOLE)
    same, levels = heat(SMALL)
    assert np.allclose(points, same)
    assert np.abs(levels - exact).max() < 5e-4 * exact.max()


def test_border_changes_the_result_without_margin() -> None:
    bare = refine_patch(*COARSE, PLACE, 3.0, max_edge_mm(VARIANCES), 0.0)
    values = 1 + np.cos(bare.positions[:, :1])
    levels = diffuse_on_surface(bare.positions, bare.triangles, values, VARIANCES)
    wide = diffuse_on_surface(SMALL.positions, SMALL.triangles, 1 + np.cos(SMALL.positions[:, :1]), VARIANCES)
    assert abs(levels[1, :, 0].max() - wide[1, SMALL.contains(SMALL.positions), 0].max()) > 0.01


def test_only_long_edges_are_split() -> None:
    """A long thin triangle is split across, and a fine one is left unchanged."""
    positions = np.array([[0.0, 0, 0], [8, 0, 0], [0, 0.5, 0], [-0.5, 0, 0]])
    patch = refine_patch(positions, [[0, 1, 2], [0, 2, 3]], [0, 0, 0], np.inf, 1.0, 0.0)
    assert (patch.parent == 1).sum() == 1
    assert longest_edge_mm(patch.positions, patch.triangles) <= 1.0
    assert triangle_areas(patch.positions[patch.triangles]).sum() == pytest.approx(2.125)
    assert (uses(patch.triangles) <= 2).all()


def test_huge_flat_triangles_are_split_near_the_centre_only() -> None:
    patch = refine_patch(*welded_surface(plane(1000.0)), [3.0, 4.0, 0.0], 2.0, 0.5, 1.0)
    assert 100 < len(patch.triangles) < 1500


@pytest.mark.samples
def test_the_ear_of_a_scan_keeps_its_light() -> None:
    """The ear is thin, folded and cut by uv seams; it is the rightmost point at the height of the eyes."""
    head = load_head("lee_perry_smith")
    surface = welded_surface(head.mesh)
    off = surface[0] - head.centre_mm
    ear = surface[0][np.where(np.abs(off[:, 1]) < 40, off[:, 0], -np.inf).argmax()]
    variances = [1.99, 7.41]
    patch = refine_patch(*surface, ear, 6.0, max_edge_mm(variances), patch_margin_mm(variances))
    values = (patch.positions[:, :1] > ear[0] - 5.0).astype(np.float64)
    levels = diffuse_on_surface(patch.positions, patch.triangles, values, variances)
    areas = vertex_areas(patch.positions, patch.triangles)
    assert np.allclose(areas @ levels[..., 0].T, areas @ values[:, 0], rtol=1e-10, atol=0)
    assert levels.min() > -0.005 and levels.max() < 1.005
    assert levels[1, :, 0].std() < levels[0, :, 0].std() < values.std()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"centre_mm": [99.0, 0, 0]}, "there is none at"),
        ({"max_edge_mm": 0.0}, "edge and radius above 0"),
        ({"radius_mm": -1.0}, "edge and radius above 0"),
        ({"max_edge_mm": 1e-4, "radius_mm": 5.0}, "make more than 8000000"),
    ],
)
def test_invalid_patches_are_refused(change: dict[str, float], complaint: str) -> None:
    settings = {"centre_mm": PLACE, "radius_mm": 1.0, "max_edge_mm": 0.5, "margin_mm": 0.0} | change
    with pytest.raises(DermisError, match=complaint):
        refine_patch(*COARSE, **settings)
