"""The stitched atlas: texels of all triangles, and gutters that continue the surface across seams."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from atlas_reading import lit_at, random_points, read, shown
from cut_meshes import (
    CYLINDER_LAYS,
    SPHERE_LAYS,
    ChartPlacement,
    cut_cone,
    cut_cylinder,
    cut_sphere,
    folded_sheet,
)
from many_charts import many_charts_mesh
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.raster import find_charts
from dermis.mesh.geometry import triangle_areas, uv_cross
from dermis.mesh.mesh import Material, Mesh, build_mesh
from dermis.mesh.primitives import plane

Floats = NDArray[np.float64]

READ = 0.3
"""A point read between texels against the true one, of a texel's side: surfaces bend and edges repeat."""


MESHES = {
    "sphere": (lambda: cut_sphere(30.0, 20), 200),
    "cylinder": (lambda: cut_cylinder(30.0, 80.0, 9), 200),
    "cone": (lambda: cut_cone(40.0, 50.0), 200),
    "fold": (lambda: folded_sheet(60.0, 6), 160),
    "many charts": (lambda: many_charts_mesh(300), 1024),
}


@lru_cache(maxsize=8)
def case(name: str) -> tuple[Mesh, Atlas]:
    make, size = MESHES[name]
    mesh = make()
    return mesh, build_atlas(mesh, size, "stitched")


def texel_mm(atlas: Atlas) -> Floats:
    """Return the longer side (n, n) of each texel on the surface [mm]."""
    return np.asarray(1.0 / np.maximum(atlas.stretch.astype(np.float64).min(axis=-1), 1e-3))


def test_mesh_with_many_charts_has_many_charts() -> None:
    assert find_charts(case("many charts")[0]).max() >= 300


@pytest.mark.parametrize("name", MESHES)
def test_all_triangles_have_texels(name: str) -> None:
    mesh, atlas = case(name)
    assert atlas.mapped.all()
    assert atlas.unscattered_fraction(mesh) == 0


@pytest.mark.parametrize("name", MESHES)
def test_light_is_available_at_every_surface_point(name: str) -> None:
    """Check that positions stored in texels are read back at random points: no pieces overlap."""
    mesh, atlas = case(name)
    points = random_points(mesh, 4000)
    found = lit_at(shown(atlas, mesh, own=True), atlas, points)
    off = np.linalg.norm(found - points.on(mesh.positions[mesh.triangles]), axis=1)
    assert np.isfinite(off).all()
    at = np.clip(np.rint(points.on(atlas.corner_uv) * atlas.size - 0.5).astype(int), 0, atlas.size - 1)
    assert np.percentile(off / texel_mm(atlas)[at[:, 1], at[:, 0]], 99.5) < READ


@pytest.mark.parametrize("name", MESHES)
def test_texels_in_pieces_have_their_own_surface_point(name: str) -> None:
    atlas = case(name)[1]
    n = atlas.size
    corner = atlas.corner_uv[np.maximum(atlas.triangle, 0)].astype(np.float64) * n - 0.5
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    centre = np.stack((x, y), axis=-1)
    sides = [_cross(corner[..., k, :], corner[..., (k + 1) % 3, :], centre) for k in range(3)]
    inside = ((np.min(sides, axis=0) > 1e-5) | (np.max(sides, axis=0) < -1e-5)) & atlas.lit_mask
    shown_at = np.einsum("yxk,yxkc->yxc", atlas.barycentric_weights(), corner)
    assert inside.sum() > 0.1 * n * n
    assert np.abs(shown_at - centre)[inside].max() < 0.01


def _cross(a: Floats, b: Floats, c: NDArray[np.integer]) -> Floats:
    ab, ac = b - a, c - a
    return np.asarray(ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0])


@pytest.mark.parametrize("name", MESHES)
def test_gutter_sources_are_at_the_surface_point_of_the_gutter_texel(name: str) -> None:
    """Check that gutters copy texels whose light is computed, not other gutters."""
    mesh, atlas = case(name)
    x, y = atlas.gutter.T
    assert len(x) > 300
    held = read(shown(atlas, mesh, own=True), atlas.source.astype(np.float64))
    assert np.isfinite(held).all()
    at = np.rint(atlas.source).astype(int)
    off = np.linalg.norm(held - shown(atlas, mesh)[y, x], axis=1) / texel_mm(atlas)[at[:, 1], at[:, 0]]
    assert np.percentile(off, 99.5) < READ


@pytest.mark.parametrize("name", ["sphere", "cylinder", "cone"])
def test_steps_into_the_gutter_are_as_long_as_the_metric_says(name: str) -> None:
    mesh, atlas = case(name)
    points = shown(atlas, mesh)
    steps = []
    for axis, after, before in ((0, np.s_[:, 1:], np.s_[:, :-1]), (1, np.s_[1:], np.s_[:-1])):
        joined = atlas.edge_distance[after][..., 2 * axis] > 0
        edge = joined & (atlas.lit_mask[after] != atlas.lit_mask[before])
        per_mm = atlas.stretch[..., axis].astype(np.float64)[after]
        steps.append((np.linalg.norm(points[after] - points[before], axis=-1) * per_mm)[edge])
    ratio = np.concatenate(steps)
    assert len(ratio) > 400
    assert np.median(ratio) == pytest.approx(1.0, abs=0.005)
    # the rest are steps along open ends, whose edge is repeated, and at corners
    assert (np.abs(ratio - 1) < 0.05).mean() > 0.95


@pytest.mark.parametrize("name", ["sphere", "cylinder", "cone"])
def test_runs_end_at_gaps(name: str) -> None:
    """Check that the surface points of texels in a run are no farther apart than the run is long."""
    mesh, atlas = case(name)
    points, reach = shown(atlas, mesh), atlas.edge_distance.astype(int)
    y, x = np.nonzero(atlas.lit_mask)
    for n in (1, 3, 6, 10, 14):
        for k, (dy, dx) in enumerate(((0, -n), (0, n), (-n, 0), (n, 0))):
            held = reach[y, x, k] >= n
            here, there = points[y, x][held], points[y[held] + dy, x[held] + dx]
            assert np.isfinite(there).all()
            way = n / atlas.stretch[y, x, k // 2].astype(np.float64)[held]
            assert (np.linalg.norm(here - there, axis=1) < 1.35 * way + 0.5).mean() > 0.999


@pytest.mark.parametrize("name", MESHES)
def test_runs_are_equal_from_both_ends(name: str) -> None:
    reach = case(name)[1].edge_distance.astype(int)
    right, left = reach[:, :-1, 1], reach[:, 1:, 0]
    assert np.array_equal(right > 0, left > 0)
    assert (np.diff(reach[..., 0], axis=1)[left > 0] == 1).all()
    down, up = reach[:-1, :, 3], reach[1:, :, 2]
    assert np.array_equal(down > 0, up > 0)
    assert (np.diff(reach[..., 2], axis=0)[up > 0] == 1).all()
    assert not reach[~case(name)[1].coverage].any()


def test_gutters_have_the_requested_width() -> None:
    mesh = cut_cylinder(30.0, 80.0, 9)
    for gutter_mm in (3.0, 8.0):
        atlas = build_atlas(mesh, 256, "stitched", gutter_mm)
        area_mm2 = (
            1.0 / atlas.stretch[~atlas.lit_mask & atlas.coverage].astype(np.float64).prod(axis=-1)
        ).sum()
        seams = 2 * 3 * 80.0  # both sides of three; the first texel or two of each belong to the rim
        rim_mm = 1.0 / atlas.stretch[atlas.lit_mask].astype(np.float64).max(axis=-1).mean()
        assert area_mm2 == pytest.approx(seams * (gutter_mm - rim_mm), rel=0.08)


def test_no_gutter_where_the_surface_ends() -> None:
    atlas = build_atlas(plane(40.0, 4), 128, "stitched")
    assert len(atlas.gutter) == 0
    assert atlas.mapped.all()
    assert atlas.edge_distance.astype(int).sum(axis=-1)[64, 64] == 2 * (
        np.count_nonzero(atlas.lit_mask[64]) - 1
    )


def test_gutters_do_not_continue_to_other_materials_than_skin() -> None:
    mesh = cut_cylinder(30.0, 80.0, 9)
    cloth = find_charts(mesh) == 1
    kinds = (Material("skin"), Material("cloth", "opaque"))
    clothed = build_mesh(mesh.positions, mesh.uv, mesh.triangles, cloth, kinds, mesh.normals)
    atlas = build_atlas(clothed, 200, "stitched")
    assert np.array_equal(atlas.mapped, ~cloth)
    assert not cloth[atlas.triangle[atlas.coverage]].any()
    assert len(atlas.gutter) > 300  # the two that are skin still meet


def test_triangles_may_have_either_orientation() -> None:
    """Check that reversed triangles of a chart change nothing, as adjacency is by position."""
    mesh, atlas = case("cylinder")
    triangles = mesh.triangles.copy()
    part = find_charts(mesh) == 0
    triangles[part] = triangles[part][:, ::-1]
    flipped = build_mesh(mesh.positions, mesh.uv, triangles, mesh.material, mesh.materials, mesh.normals)
    other = build_atlas(flipped, atlas.size, "stitched")
    assert other.mapped.all()
    assert len(other.gutter) == pytest.approx(len(atlas.gutter), rel=0.02)
    held = read(shown(other, flipped, own=True), other.source.astype(np.float64))
    x, y = other.gutter.T
    off = np.linalg.norm(held - shown(other, flipped)[y, x], axis=1)
    assert np.percentile(off, 99.5) < READ * 0.8


def test_folded_halves_both_get_texels() -> None:
    """Check that both halves get texels, of which one has none on the mesh's own uv."""
    mesh, atlas = case("fold")
    assert not build_atlas(mesh, atlas.size).mapped.all()
    both = uv_cross(atlas.corner_uv)
    assert (both > 0).sum() == (both < 0).sum()


def test_only_large_differences_of_texel_density_are_reduced() -> None:
    lays = [*SPHERE_LAYS[:4], SPHERE_LAYS[4]._replace(scale=0.02), SPHERE_LAYS[5]._replace(scale=0.30)]
    mesh = cut_sphere(30.0, 8, lays)
    placed = np.abs(uv_cross(build_atlas(mesh, 256, "stitched").corner_uv))
    area = triangle_areas(mesh.positions[mesh.triangles])
    chart = find_charts(mesh)
    assert np.bincount(chart).tolist() == [128] * 6
    size = np.sqrt(np.bincount(chart, placed) / np.bincount(chart, area))
    given = np.array([lay.scale for lay in lays])
    factor = (size / given) / (size[0] / given[0])
    assert np.allclose(factor[:4], 1.0, atol=0.02)
    assert 1.4 < factor[4] < 3.0  # had a fifth of the others' density
    assert 0.4 < factor[5] < 0.9  # three times, and so not far from the mean itself


def test_a_collapsed_chart_is_left_out() -> None:
    lays = [*CYLINDER_LAYS[:2], ChartPlacement((0.9, 0.9), 1e-5)]
    mesh = cut_cylinder(30.0, 80.0, 6, lays)
    atlas = build_atlas(mesh, 128, "stitched")
    assert np.bincount(find_charts(mesh), atlas.mapped).tolist() == [72, 72, 0]
    # and no gutter shows it
    assert atlas.mapped[atlas.triangle[~atlas.lit_mask & atlas.coverage]].all()


def test_too_many_charts_for_the_atlas_keep_their_layout() -> None:
    middles = [((column + 0.5) / 20, (row + 0.5) / 20) for row in range(20) for column in range(20)]
    mesh = cut_cylinder(300.0, 10.0, 1, [ChartPlacement(middle, 0.002) for middle in middles])
    stitched, plain = build_atlas(mesh, 64, "stitched"), build_atlas(mesh, 64)
    assert len(stitched.gutter) == 0
    assert np.array_equal(stitched.triangle, plain.triangle)
    assert np.array_equal(stitched.corner_uv, plain.corner_uv)


def test_a_mesh_without_skin_has_an_empty_atlas() -> None:
    card = plane(40.0, 2)
    mesh = build_mesh(
        card.positions, card.uv, card.triangles, np.zeros(8), (Material("cloth", "opaque"),), card.normals
    )
    atlas = build_atlas(mesh, 64, "stitched")
    assert not atlas.mapped.any() and not atlas.coverage.any() and not len(atlas.gutter)
