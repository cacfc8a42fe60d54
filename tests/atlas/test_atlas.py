"""The atlas of a mesh's own layout: surface points of texels, separate charts, and what is left out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER_TEXELS, Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.raster import find_charts
from dermis.base.errors import DermisError
from dermis.formats.samples import SAMPLES
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS, plane, uv_sphere

Square = tuple[float, float, float]  # left, top, side in uv


def patches(*squares: Square) -> Mesh:
    """Return squares of 10 mm that are apart in space, each with its own square of uv."""
    parts = [plane(10.0, 2) for _ in squares]
    shift = [np.array([20.0 * k, 0, 0], np.float32) for k in range(len(parts))]
    first = np.cumsum([0, *(len(p.positions) for p in parts[:-1])])
    return build_mesh(
        np.vstack([p.positions + s for p, s in zip(parts, shift, strict=True)]),
        np.vstack([[left, top] + side * p.uv for p, (left, top, side) in zip(parts, squares, strict=True)]),
        np.vstack([p.triangles + k for p, k in zip(parts, first, strict=True)]),
        np.zeros(sum(len(p.triangles) for p in parts)),
        SKIN_MATERIALS,
    )


def chart_map(atlas: Atlas, mesh: Mesh) -> NDArray[np.int32]:
    return np.where(atlas.coverage, find_charts(mesh)[np.maximum(atlas.triangle, 0)], -1)


def centres(size: int) -> NDArray[np.float64]:
    """Return the uv (n, n, 2) of the texels' centres."""
    x = (np.arange(size) + 0.5) / size
    return np.stack(np.meshgrid(x, x), axis=-1)


def own_texels(atlas: Atlas, mesh: Mesh) -> NDArray[np.bool_]:
    """Return the texels whose centre is in their triangle, by brute force; gutter texels are not."""
    corners = mesh.uv[mesh.triangles[np.maximum(atlas.triangle, 0)]].astype(float)
    p, c = np.moveaxis(corners, 2, 0), centres(atlas.size)
    sides = [edge(p[k], p[(k + 1) % 3], c) for k in range(3)]
    inside = (np.min(sides, axis=0) > -1e-7) | (np.max(sides, axis=0) < 1e-7)
    return np.asarray(inside & atlas.coverage)


def edge(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]


MESHES = {
    "plane": lambda: plane(100.0, 3),
    "part of the square": lambda: plane(50.0, 2, uv_scale=0.61),
    "sphere": lambda: uv_sphere(40.0, 24, 12),
    "two patches": lambda: patches((0.05, 0.1, 0.3), (0.5, 0.4, 0.45)),
}


@pytest.mark.parametrize("size", [64, 100])
@pytest.mark.parametrize("name", MESHES)
def test_texel_points_have_the_uv_of_their_texel(name: str, size: int) -> None:
    mesh = MESHES[name]()
    atlas = build_atlas(mesh, size)
    own = own_texels(atlas, mesh)
    assert own.any()
    off = np.abs(atlas.interpolate(mesh, mesh.uv) - centres(size))[own]
    assert off.max() < 2 / 65535  # weights are whole 65535ths of a triangle that may span the map
    assert np.abs(atlas.barycentric_weights()[atlas.coverage].sum(axis=-1) - 1).max() < 1e-12
    assert atlas.barycentric_weights()[atlas.coverage].min() >= -1e-12


def test_every_centre_on_the_surface_is_covered() -> None:
    """Count covered texels without triangles: the plane's uv is the square 0..0.61."""
    atlas = build_atlas(plane(50.0, 2, uv_scale=0.61), 100)
    inside = np.arange(100) + 0.5 < 61
    grown = np.arange(100) + 0.5 < 61 + GUTTER_TEXELS
    assert np.array_equal(own_texels(atlas, plane(50.0, 2, uv_scale=0.61)), inside[:, None] & inside[None])
    assert np.array_equal(atlas.coverage, grown[:, None] & grown[None])


def test_a_full_square_covers_all_texels() -> None:
    atlas = build_atlas(plane(100.0), 64)
    assert atlas.coverage.all() and atlas.mapped.all()


@pytest.mark.parametrize("size", [64, 200])
def test_positions_on_a_plane(size: int) -> None:
    mesh = plane(100.0, 5)
    place = build_atlas(mesh, size).interpolate(mesh, mesh.positions)
    u, v = np.moveaxis(centres(size), -1, 0)
    exact = 100.0 * np.stack([u - 0.5, 0.5 - v, 0 * u], axis=-1)
    assert np.abs(place - exact).max() < 0.01


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_stretch_of_a_plane(scale: float) -> None:
    atlas = build_atlas(plane(100.0, 2, uv_scale=scale), 128)
    assert np.allclose(atlas.stretch[atlas.coverage].astype(float), 1.28 * scale, rtol=1e-3)
    assert not atlas.stretch[~atlas.coverage].any()


def test_stretch_of_a_sphere() -> None:
    """Check stretch along v on a half circle, and along u on circles that narrow towards the poles."""
    atlas = build_atlas(uv_sphere(40.0, 96, 48), 128)
    rows = slice(20, 108)  # the poles' own fans are no part of the formula
    v = (np.arange(128)[rows] + 0.5) / 128
    along_v = 128 / (np.pi * 40.0)
    along_u = 128 / (2 * np.pi * 40.0 * np.sin(np.pi * v))
    assert np.allclose(atlas.stretch[rows, :, 1].astype(float), along_v, rtol=0.01)
    inner = slice(4, 124)  # at the seam derivatives are averaged over one side only: 3 % off
    assert np.allclose(atlas.stretch[rows, inner, 0].astype(float), along_u[:, None], rtol=0.01)


def test_gutter_repeats_the_edge() -> None:
    mesh = MESHES["two patches"]()
    atlas = build_atlas(mesh, 128)
    gutter = atlas.coverage & ~own_texels(atlas, mesh)
    assert gutter.sum() > 4 * GUTTER_TEXELS * 40
    seen = atlas.interpolate(mesh, mesh.uv)
    away = np.abs(seen - centres(128)).max(axis=-1)[gutter] * 128
    assert away.max() <= GUTTER_TEXELS + 0.5 and away.min() > 0
    for chart, (left, top, side) in enumerate([(0.05, 0.1, 0.3), (0.5, 0.4, 0.45)]):
        texels = seen[gutter & (chart_map(atlas, mesh) == chart)]
        off_edge = np.minimum(texels - [left, top], [left + side, top + side] - texels).min(axis=-1)
        assert np.abs(off_edge * 128).max() < 0.71


def test_gutters_of_neighbours_meet_and_do_not_overlap() -> None:
    mesh = patches((0.1, 0.2, 0.35), (0.4734375, 0.2, 0.35))  # three texels between them at 128
    atlas = build_atlas(mesh, 128)
    owner, own = chart_map(atlas, mesh), own_texels(atlas, mesh)
    for chart, square in enumerate([(0.1, 0.2, 0.35), (0.4734375, 0.2, 0.35)]):
        alone = patches(square)
        expected = own_texels(build_atlas(alone, 128), alone)
        assert np.array_equal(own & (owner == chart), expected)
    between = owner[40, 50:64]
    assert (between >= 0).all() and (np.diff(between) >= 0).all()


def test_reach_by_brute_force() -> None:
    mesh = patches((0.1, 0.2, 0.35), (0.4734375, 0.2, 0.35), (0.3, 0.7, 0.2))
    atlas = build_atlas(mesh, 96)
    owner = chart_map(atlas, mesh)
    steps = ((0, -1), (0, 1), (-1, 0), (1, 0))
    rng = np.random.default_rng(0)
    for y, x in rng.choice(np.argwhere(atlas.coverage), 300):
        for k, (dy, dx) in enumerate(steps):
            n = 1
            while (
                0 <= y + n * dy < 96 and 0 <= x + n * dx < 96 and owner[y + n * dy, x + n * dx] == owner[y, x]
            ):
                n += 1
            assert atlas.edge_distance[y, x, k] == n - 1


def test_reach_extends_to_the_edge_of_the_chart() -> None:
    reach = build_atlas(plane(100.0), 300).edge_distance
    assert reach[10, 299].tolist() == [299, 0, 10, 289]


def test_only_one_of_two_mirrored_halves_is_mapped() -> None:
    """Check two mirrored halves on the same uv, joined at their centre line, as one chart.

    The mirrored half is lit directly.
    """
    positions = np.array([[x, y, 0] for x in (-50, 0, 50) for y in (-50, 50)], np.float32)
    uv = np.array([[u, v] for u in (0.9, 0.1, 0.9) for v in (0.9, 0.1)], np.float32)
    triangles = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]], np.int32)
    mesh = build_mesh(positions, uv, triangles, np.zeros(4, np.int32), SKIN_MATERIALS)
    atlas = build_atlas(mesh, 64)
    assert atlas.mapped.tolist() in ([True] * 2 + [False] * 2, [False] * 2 + [True] * 2)
    assert set(np.unique(atlas.triangle)) - {-1} == set(np.flatnonzero(atlas.mapped))


def test_a_collapsed_chart_is_left_out() -> None:
    with_it = patches((0.1, 0.1, 0.6), (0.9, 0.9, 0.5 / 64))
    alone = build_atlas(patches((0.1, 0.1, 0.6)), 64)
    atlas = build_atlas(with_it, 64)
    assert atlas.mapped.tolist() == [True] * 8 + [False] * 8
    for name in ("triangle", "barycentric", "stretch", "edge_distance"):
        assert np.array_equal(getattr(atlas, name), getattr(alone, name)), name


@pytest.mark.parametrize("larger", [0, 1])
def test_the_larger_of_two_overlapping_charts_is_mapped(larger: int) -> None:
    squares = [(0.2, 0.2, 0.3), (0.2, 0.2, 0.3)]
    squares[larger] = (0.1, 0.1, 0.5)
    atlas = build_atlas(patches(*squares), 64)
    assert atlas.mapped.reshape(2, 8).all(axis=1).tolist() == [larger == 0, larger == 1]
    assert atlas.mapped.reshape(2, 8).any(axis=1).tolist() == [larger == 0, larger == 1]
    assert np.isin(atlas.triangle[atlas.coverage] // 8, [larger]).all()


@pytest.mark.parametrize("size", [63, 1, 0, -64])
def test_small_atlases_are_refused(size: int) -> None:
    with pytest.raises(DermisError, match=f"atlas.*{size}"):
        build_atlas(plane(100.0), size)


@pytest.mark.samples
def test_atlas_of_the_scan() -> None:
    """Check that the eye shells are collapsed and the eight other islands fill most of the map."""
    from loaded_mesh import load_mesh

    from dermis.formats.samples import fetch_sample

    sample = SAMPLES["lee_perry_smith"]
    mesh = load_mesh(
        fetch_sample("lee_perry_smith")["mesh"], unit_mm=sample.unit_mm, v_origin=sample.v_origin or "auto"
    )
    atlas = build_atlas(mesh, 256)
    assert 0.5 < atlas.coverage.mean() < 1.0
    # two shells of 264 triangles, and the few triangles of other islands that have no uv area
    collapsed = np.bincount(find_charts(mesh)[~atlas.mapped], minlength=11)
    assert sorted(collapsed)[-2:] == [264, 264]
    assert (~atlas.mapped).sum() < 2 * 264 + 20
    assert np.isfinite(atlas.stretch).all() and (atlas.stretch[atlas.coverage] > 0).all()
    assert np.isfinite(atlas.interpolate(mesh, mesh.positions)).all()
