"""Where the bust is cut, and how much of the map each part gets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.unwrap.charts import grow, tidy
from dermis.atlas.unwrap.seams import shortest_seam
from dermis.atlas.unwrap.unwrap import Layout, unwrap
from dermis.human.bust import ears, neck
from dermis.human.bust.fields import rise
from dermis.human.bust.mesh import build_bust
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.shape import fold
from dermis.human.bust.warp import make_warp
from dermis.mesh.mesh import Material, Mesh

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

CHARTS = {
    "face": 1.0,
    "back of the head": 0.6,
    "neck": 0.75,
    "bottom": 0.2,
    "left ear front": 1.1,
    "left ear back": 0.7,
    "right ear front": 1.1,
    "right ear back": 0.7,
    "under the chin": 0.7,
}
"""Texels per mm on each chart relative to the face, where it has most [-]."""

# Artist's values on the average head [mm].
_JAW_EDGE = np.array([[-85.0, -108.0], [-8, -87], [30, -78.5], [60, -70], [100, -58]])
"""Depth behind the origin and height of the seam under chin and jaw, up to the nape."""
_CHIN_FLOOR = 13.0
"""From there down to the crease between chin and throat."""
_CROWN_Z, _CROWN_SLOPE = -12.0, 0.1
_MANY = 300


def bust_mesh(parameters: BustParameters, cell: float = 1.0) -> Mesh:
    """A bust laid out in few charts; `cell` as for `build_bust`."""
    positions, triangles, normals = build_bust(parameters, cell)
    return bust_layout(positions, triangles, parameters).mesh(positions, normals, Material("skin"))


def many_charts_mesh(parameters: BustParameters, cell: float = 1.0) -> Mesh:
    """A bust with as many seams as a layout can have; `cell` as for `build_bust`."""
    positions, triangles, normals = build_bust(parameters, cell)
    return many_charts_layout(positions, triangles).mesh(positions, normals, Material("skin"))


def bust_layout(positions: Doubles, triangles: Index, parameters: BustParameters) -> Layout:
    """Nine charts, with seams over the crown, behind the ears and under the chin."""
    places = make_warp(parameters).undo(positions)
    chart = bust_charts(places, triangles, parameters)
    density, weight = _emphasis(chart, places[triangles].mean(axis=1))
    return unwrap(positions, triangles, chart, _nape(places, triangles, chart), density, weight)


def many_charts_layout(positions: Doubles, triangles: Index) -> Layout:
    """Hundreds of charts, each turned its own way, with seams everywhere."""
    chart = grow(positions, triangles, _MANY)
    upright = np.random.default_rng(0).normal(size=(int(chart.max()) + 1, 3))
    return unwrap(positions, triangles, chart, upright=upright[chart])


def bust_charts(places: Doubles, triangles: Index, parameters: BustParameters) -> Index:
    """Index into `CHARTS` of each triangle (f,).

    places : (n, 3) positions before the warp [mm]
    """
    middle = places[triangles].mean(axis=1)
    half = fold(middle)
    depth, y = -middle[:, 2], middle[:, 1]
    ear, front = ears.sides(half, parameters)
    back = middle[:, 2] < _CROWN_Z + _CROWN_SLOPE * (y - 114)
    chart = np.where(back, 1, 0)
    jaw = np.interp(depth, *_JAW_EDGE.T)
    chart[y < jaw] = 8
    chart[y < jaw - _CHIN_FLOOR * rise(depth, 12, -18)] = 2
    chart[neck.belongs_to_cut(half)] = 3
    chart[ear] = np.where(middle[:, 0] > 0, 4, 6)[ear] + ~front[ear]
    return tidy(chart, triangles)


def _emphasis(chart: Index, middle: Doubles) -> tuple[Doubles, Doubles]:
    """Density and weight (f,) of each triangle, greatest on the face itself; middle (f, 3) [mm]."""
    _, y, z = middle.T
    face, throat = rise(z, -30, 15) * rise(y, 105, 75), rise(y, -230, -120)
    share = np.select([chart == 0, chart == 2], [0.9 + 0.1 * face, 0.5 + 0.5 * throat], 1.0)
    return np.array(list(CHARTS.values()))[chart] * share, np.where(chart == 0, 1 + 5 * face, 1.0)


def _nape(places: Doubles, triangles: Index, chart: Index) -> Index:
    """The seam (s, 2) down the middle of the neck's back."""
    top, cloth, bottom = (np.unique(triangles[chart == k]) for k in (1, 2, 3))
    start, end = (np.intersect1d(cloth, rim) for rim in (top, bottom))
    behind = start[places[start, 2] < 0], end[places[end, 2] < 0]
    return shortest_seam(places, triangles[chart == 2], 1 + np.abs(places[:, 0]), *behind)
