"""Coarse cells of the atlas: sources, receivers, triangles and gutters."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.cells import CELLS_PER_TILE_SIDE, Cells, divide_into_cells
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge

MESHES = {"slab": lambda: wedge(30.0, 2.0, 4.0, cells_per_side=6), "ball": lambda: uv_sphere(20.0, 48, 24)}
WIDEST_MM = 4.0
Divided = tuple[Mesh, Atlas, Cells]


@pytest.fixture(params=[(name, layout) for name in MESHES for layout in ("mesh", "stitched")])
def divided(request: pytest.FixtureRequest) -> Divided:
    name, layout = request.param
    mesh = MESHES[name]()
    atlas = build_atlas(mesh, 128, layout)
    return mesh, atlas, divide_into_cells(atlas, WIDEST_MM)


def test_cells_are_as_large_as_the_widest_gaussian_allows(divided: Divided) -> None:
    _, atlas, cells = divided
    assert 0.9 * 0.36 * WIDEST_MM < cells.cell_mm <= 0.36 * WIDEST_MM
    assert cells.radius_mm == pytest.approx(3.2 * WIDEST_MM)
    assert divide_into_cells(atlas, WIDEST_MM, relative_cell_size=2.0).side == pytest.approx(
        cells.side / 2, abs=1
    )
    assert divide_into_cells(atlas, 0.01).side == atlas.size
    assert divide_into_cells(atlas, 100.0).radius_mm == divide_into_cells(atlas, 10.0).radius_mm == 32.0


def test_all_lit_texels_are_in_source_and_receiver_cells(divided: Divided) -> None:
    _, atlas, cells = divided
    y, x = (axis * cells.side // atlas.size for axis in np.nonzero(atlas.lit_mask))
    expected = np.zeros_like(cells.receiver_mask)
    expected[y, x] = True
    own = np.zeros_like(expected)
    own.ravel()[cells.sources] = True
    assert (own == expected).all() and own.sum() == len(cells.sources) > 100
    assert (own & cells.receiver_mask).sum() > 0.98 * own.sum()  # at edges the middle may show nothing
    row, column = np.nonzero(cells.receiver_mask)
    assert (np.sort(cells.receivers) == np.sort(column | (row << 16))).all()
    tile = np.repeat(np.arange(cells.tiles_per_side**2), np.diff(cells.source_first))
    assert (
        tile
        == cells.sources // cells.side // CELLS_PER_TILE_SIDE * cells.tiles_per_side
        + cells.sources % cells.side // CELLS_PER_TILE_SIDE
    ).all()


def test_tiles_list_all_triangles_that_they_show(divided: Divided) -> None:
    _, atlas, cells = divided
    y, x = np.nonzero(atlas.lit_mask)
    corners = atlas.corner_uv[atlas.triangle[y, x]].astype(float) * atlas.size - 0.5
    place = np.einsum("nk,nkc->nc", atlas.barycentric_weights()[y, x], corners)
    inside = np.abs(place - np.stack([x, y], axis=-1)).max(axis=1) < 0.1
    column, row = (axis[inside] * cells.side // atlas.size // CELLS_PER_TILE_SIDE for axis in (x, y))
    shown = zip(
        (row * cells.tiles_per_side + column).tolist(), atlas.triangle[y, x][inside].tolist(), strict=True
    )
    tile = np.repeat(np.arange(cells.tiles_per_side**2), np.diff(cells.triangle_first.astype(int)))
    assert set(shown) <= set(zip(tile.tolist(), cells.triangles.tolist(), strict=True))


def test_receivers_are_in_the_tile_of_their_surface_point(divided: Divided) -> None:
    """Check the tiles of receivers, also in gutters, which show other points."""
    _, atlas, cells = divided
    b = np.stack([cells.receiver_points[:, 1] & 0xFFFF, cells.receiver_points[:, 1] >> 16], axis=-1) / 65535.0
    weights = np.column_stack([1.0 - b.sum(axis=1), b])
    place = (
        np.einsum("nk,nkc->nc", weights, atlas.corner_uv[cells.receiver_points[:, 0]].astype(float))
        * cells.side
    )
    tile = np.repeat(np.arange(cells.tiles_per_side**2), np.diff(cells.receiver_first))
    at = np.stack([tile % cells.tiles_per_side, tile // cells.tiles_per_side], axis=-1)
    assert (np.abs(place - CELLS_PER_TILE_SIDE * (at + 0.5)) < CELLS_PER_TILE_SIDE / 2 + 1e-2).all()


def test_gutter_copies_are_listed_by_cell(divided: Divided) -> None:
    _, atlas, cells = divided
    texel, shown = (
        np.stack([words & 0xFFFF, words >> 16], axis=-1).astype(int) for words in cells.gutter_copies.T
    )
    assert len(texel) >= len(atlas.gutter) and cells.gutter_copy_first[-1] == len(texel)
    cell = np.repeat(np.arange(cells.side**2), np.diff(cells.gutter_copy_first))
    column, row = (shown * cells.side // atlas.size).T
    assert (cell == row * cells.side + column).all()
    listed = {tuple(t): tuple(s) for t, s in zip(texel.tolist(), shown.tolist(), strict=True)}
    for t, s in zip(atlas.gutter.tolist(), np.rint(atlas.source).astype(int).tolist(), strict=True):
        assert listed[tuple(t)] == tuple(np.clip(s, 0, atlas.size - 1))
    beside = [t for t in texel.tolist() if atlas.lit_mask[t[1], t[0]]]
    assert beside  # texels beside charts are lit themselves and show the chart's edge
