"""The atlas in coarse cells: what they hold, and which triangles and gutters show them."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.translucency.cells import TILE, Cells, divide
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import uv_sphere, wedge

MESHES = {"slab": lambda: wedge(30.0, 2.0, 4.0, cells=6), "ball": lambda: uv_sphere(20.0, 48, 24)}
WIDEST_MM = 4.0
Divided = tuple[Mesh, Atlas, Cells]


@pytest.fixture(params=[(name, layout) for name in MESHES for layout in ("mesh", "stitched")])
def divided(request: pytest.FixtureRequest) -> Divided:
    name, layout = request.param
    mesh = MESHES[name]()
    atlas = build_atlas(mesh, 128, layout)
    return mesh, atlas, divide(atlas, WIDEST_MM)


def test_cells_are_as_large_as_the_widest_gaussian_allows(divided: Divided) -> None:
    _, atlas, cells = divided
    assert 0.9 * 0.36 * WIDEST_MM < cells.spacing_mm <= 0.36 * WIDEST_MM
    assert cells.radius_mm == pytest.approx(3.2 * WIDEST_MM)
    assert divide(atlas, WIDEST_MM, coarser=2.0).side == pytest.approx(cells.side / 2, abs=1)
    assert divide(atlas, 0.01).side == atlas.size
    assert divide(atlas, 100.0).radius_mm == divide(atlas, 10.0).radius_mm == 32.0


def test_all_texels_of_their_own_lie_in_cells_that_give_and_take(divided: Divided) -> None:
    _, atlas, cells = divided
    y, x = (axis * cells.side // atlas.size for axis in np.nonzero(atlas.own))
    expected = np.zeros_like(cells.surface)
    expected[y, x] = True
    own = np.zeros_like(expected)
    own.ravel()[cells.giving] = True
    assert (own == expected).all() and own.sum() == len(cells.giving) > 100
    assert (own & cells.surface).sum() > 0.98 * own.sum()  # at edges the middle may show nothing
    row, column = np.nonzero(cells.surface)
    assert (np.sort(cells.taking) == np.sort(column | (row << 16))).all()
    tile = np.repeat(np.arange(cells.tiles**2), np.diff(cells.giving_first))
    assert (
        tile == cells.giving // cells.side // TILE * cells.tiles + cells.giving % cells.side // TILE
    ).all()


def test_tiles_list_all_triangles_that_they_show(divided: Divided) -> None:
    _, atlas, cells = divided
    y, x = np.nonzero(atlas.own)
    corners = atlas.place[atlas.triangle[y, x]].astype(float) * atlas.size - 0.5
    place = np.einsum("nk,nkc->nc", atlas.weights()[y, x], corners)
    inside = np.abs(place - np.stack([x, y], axis=-1)).max(axis=1) < 0.1
    column, row = (axis[inside] * cells.side // atlas.size // TILE for axis in (x, y))
    shown = zip((row * cells.tiles + column).tolist(), atlas.triangle[y, x][inside].tolist(), strict=True)
    tile = np.repeat(np.arange(cells.tiles**2), np.diff(cells.triangle_first.astype(int)))
    assert set(shown) <= set(zip(tile.tolist(), cells.triangle.tolist(), strict=True))


def test_receivers_belong_to_the_tile_of_their_place(divided: Divided) -> None:
    """Also in gutters, which show places elsewhere."""
    _, atlas, cells = divided
    b = np.stack([cells.middle[:, 1] & 0xFFFF, cells.middle[:, 1] >> 16], axis=-1) / 65535.0
    weights = np.column_stack([1.0 - b.sum(axis=1), b])
    place = np.einsum("nk,nkc->nc", weights, atlas.place[cells.middle[:, 0]].astype(float)) * cells.side
    tile = np.repeat(np.arange(cells.tiles**2), np.diff(cells.taking_first))
    at = np.stack([tile % cells.tiles, tile // cells.tiles], axis=-1)
    assert (np.abs(place - TILE * (at + 0.5)) < TILE / 2 + 1e-2).all()


def test_gutters_are_listed_by_the_cells_that_they_show(divided: Divided) -> None:
    _, atlas, cells = divided
    texel, shown = (np.stack([words & 0xFFFF, words >> 16], axis=-1).astype(int) for words in cells.copy.T)
    assert len(texel) >= len(atlas.gutter) and cells.copy_first[-1] == len(texel)
    cell = np.repeat(np.arange(cells.side**2), np.diff(cells.copy_first))
    column, row = (shown * cells.side // atlas.size).T
    assert (cell == row * cells.side + column).all()
    listed = {tuple(t): tuple(s) for t, s in zip(texel.tolist(), shown.tolist(), strict=True)}
    for t, s in zip(atlas.gutter.tolist(), np.rint(atlas.source).astype(int).tolist(), strict=True):
        assert listed[tuple(t)] == tuple(np.clip(s, 0, atlas.size - 1))
    beside = [t for t in texel.tolist() if atlas.own[t[1], t[0]]]
    assert beside  # texels beside charts are lit themselves and show the chart's edge
