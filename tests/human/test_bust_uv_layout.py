"""The embedded head cut into charts: few, little stretched, none mirrored, none over another."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.atlas.build import build_atlas
from dermis.atlas.raster import rasterise
from dermis.atlas.unwrap.stretch import singular_values
from dermis.atlas.unwrap.unwrap import PADDING
from dermis.human.bust.mesh import (
    CHARTS,
    build_bust,
    bust_layout,
    bust_mesh,
    many_charts_layout,
    many_charts_mesh,
)
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS, region_of
from dermis.mesh.check import check_mesh
from dermis.mesh.geometry import edges, triangle_areas, uv_cross
from dermis.mesh.mesh import Mesh
from dermis.mesh.uv import charts

AVERAGE = BustParameters()
LEAN = BustParameters(width=0.9, nose=0.8, ears=0.8, jaw=0.88, fullness=-1.0, asymmetry=2.0, seed=1)
ROUND = BustParameters(width=1.1, nose=1.25, ears=1.2, jaw=1.12, fullness=1.0, asymmetry=2.0, seed=2)
COARSE = 2.5
SIZE = 1024


@lru_cache(maxsize=8)
def mesh_of(parameters: BustParameters) -> Mesh:
    return bust_mesh(parameters, COARSE)


@lru_cache(maxsize=1)
def many() -> Mesh:
    return many_charts_mesh(AVERAGE, COARSE)


def owners_of_texels(mesh: Mesh) -> NDArray[np.int64]:
    """Chart (SIZE, SIZE) at each texel, -1 where none; no texel lies in two triangles."""
    corners = mesh.uv[mesh.triangles].astype(np.float64)
    # a little smaller, for a texel whose centre lies on an edge is in both its triangles
    corners += 1e-3 * (corners.mean(axis=1, keepdims=True) - corners)
    apart = np.arange(corners.size // 2, dtype=np.int32).reshape(-1, 3)
    shrunk = replace(mesh, uv=corners.reshape(-1, 2).astype(np.float32), triangles=apart)
    texel, triangle = rasterise(shrunk, SIZE, np.arange(len(apart)))
    assert len(texel) == len(np.unique(texel))
    owner = np.full(SIZE * SIZE, -1, dtype=np.int64)
    owner[texel] = charts(mesh)[triangle]
    return owner.reshape(SIZE, SIZE)


def percentiles(values: NDArray[np.float64], area: NDArray[np.float64], *shares: float) -> list[float]:
    """Values that these shares of the area stay below."""
    order = np.argsort(values)
    below = np.cumsum(area[order]) / area.sum()
    return [float(values[order[np.searchsorted(below, share)]]) for share in shares]


def check_layout(mesh: Mesh, fill: float) -> None:
    check_mesh(mesh, "bust")
    assert (uv_cross(mesh.uv[mesh.triangles]) < 0).all(), "v runs down, so no triangle is mirrored"
    owner = owners_of_texels(mesh)
    assert (owner >= 0).mean() > fill
    reach = int(PADDING * SIZE) - 1
    for step in range(1, reach):
        for one, other in ((owner[step:], owner[:-step]), (owner[:, step:], owner[:, :-step])):
            assert not ((one >= 0) & (other >= 0) & (one != other)).any(), "space between charts"
    _, _, counts = edges(mesh.point[mesh.triangles])
    assert (counts == 2).all(), "closed across seams"


@pytest.mark.parametrize("parameters", [AVERAGE, LEAN, ROUND], ids=["average", "lean", "round"])
def test_few_charts(parameters: BustParameters) -> None:
    mesh = mesh_of(parameters)
    assert charts(mesh).max() + 1 == len(CHARTS) == 9
    check_layout(mesh, fill=0.6)


@pytest.mark.parametrize("parameters", [AVERAGE, LEAN, ROUND], ids=["average", "lean", "round"])
def test_stretch(parameters: BustParameters) -> None:
    mesh = mesh_of(parameters)
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    values, area = singular_values(corners, mesh.uv[mesh.triangles]), triangle_areas(corners)
    anisotropy, scale = values[:, 0] / values[:, 1], np.sqrt(values.prod(axis=1))
    region = region_of(corners.mean(axis=1), parameters)
    ear, other = region == REGIONS.index("ear"), region == REGIONS.index("neck and scalp")
    face = ~ear & ~other
    half, most = percentiles(anisotropy[face], area[face], 0.5, 0.95)
    assert half < 1.15 and most < 1.5
    low, middle, high = percentiles(scale[face], area[face], 0.05, 0.5, 0.95)
    assert high / low < 1.4
    assert percentiles(anisotropy[ear], area[ear], 0.5, 0.95) < [1.2, 1.8]
    assert percentiles(anisotropy[other], area[other], 0.5, 0.95) < [1.1, 1.5]
    assert percentiles(scale[ear], area[ear], 0.5)[0] > middle
    assert percentiles(scale[other], area[other], 0.5)[0] < 0.75 * middle
    assert middle * 4096 > 8.0, "texels per mm"


def test_face_lies_upright_in_the_middle_of_its_chart() -> None:
    mesh = mesh_of(BustParameters(asymmetry=0.0))
    front = np.flatnonzero((np.abs(mesh.positions[:, 0]) < 1e-6) & (mesh.positions[:, 2] > 80))
    u, v = mesh.uv[front].T
    assert np.ptp(u) < 0.004
    assert np.corrcoef(mesh.positions[front, 1], v)[0, 1] < -0.99
    left = (mesh.positions[:, 0] > 20) & (mesh.positions[:, 2] > 60) & (mesh.positions[:, 1] > -90)
    assert (mesh.uv[left, 0] > u.mean()).all(), "seen from outside, its left is to the right"


def test_seams_are_hidden() -> None:
    """No seam on the front of the head, and few points on any."""
    mesh = mesh_of(AVERAGE)
    copies = np.bincount(mesh.point)[mesh.point]
    place = mesh.positions[copies > 1]
    under_the_jaw = -86.0
    assert not ((place[:, 2] > 10) & (place[:, 1] > under_the_jaw)).any()
    assert len(mesh.positions) < 1.15 * (mesh.point.max() + 1)


def test_normals_are_the_same_on_both_sides_of_a_seam() -> None:
    mesh = mesh_of(AVERAGE)
    first = np.unique(mesh.point, return_index=True)[1]
    assert np.abs(mesh.normals - mesh.normals[first][mesh.point]).max() < 1e-6


def test_every_triangle_has_texels() -> None:
    assert build_atlas(mesh_of(AVERAGE), 512).mapped.all()


def test_many_charts() -> None:
    mesh = many()
    assert 290 < charts(mesh).max() + 1 < 400
    check_layout(mesh, fill=0.35)
    assert len(mesh.positions) > 1.3 * (mesh.point.max() + 1)


def test_same_shape_same_bytes() -> None:
    positions, triangles, _ = build_bust(LEAN, COARSE)
    for lay in (partial(bust_layout, parameters=LEAN), many_charts_layout):
        one, other = (lay(positions, triangles) for _ in range(2))
        assert one.uv.tobytes() == other.uv.tobytes()
        assert one.triangles.tobytes() == other.triangles.tobytes()
