"""Twin of translucency in NumPy float64: points, pairs by brute force, and transmitted light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.translucency.cells import Cells
from dermis.frame.features.atlas.passes import draw_stretch
from dermis.frame.features.atlas.textures import upload_atlas
from dermis.frame.features.shape.mesh import upload_geometry
from dermis.frame.features.shape.shape import evaluate_rest_shape, shape_tables
from dermis.frame.features.translucency.build import find_pairs
from dermis.frame.features.translucency.resources import PairBuffers
from dermis.gpu import CommandList, Device
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
GRAIN, LEAST_DISC = 0.72, 0.3
TURN, LEAST = 0.05, 4e-5
INSIDE = 0.1


@dataclass(frozen=True)
class Points:
    """Points of the cells of an atlas.

    cell, texel : (n, 2) x, y
    position, normal : (n, 3) [mm]
    area_mm2 : (n,) area of the surface that each stands for; 0 for receivers
    """

    cell: Index
    texel: Index
    position: Floats
    normal: Floats
    area_mm2: Floats

    def chosen(self, which: Any) -> Points:
        parts = self.cell, self.texel, self.position, self.normal, self.area_mm2
        return Points(*(part[which] for part in parts))


def surface_of(device: Device, mesh: Mesh, atlas: Atlas, positions_mm: Any = None) -> dict[str, Any]:
    """Return the resources of a mesh and its atlas, optionally for other positions of its points."""
    head, textures = Head("test", mesh, Maps()), upload_atlas(device, atlas)
    tables = shape_tables(device, head)
    shape = evaluate_rest_shape(device, tables, head.positions_mm if positions_mm is None else positions_mm)
    held, frame = upload_geometry(device, mesh, atlas, shape), CommandList(device)
    draw_stretch(frame, held, textures)
    frame.submit()
    return held.resources | textures.resources


def pairs_on(device: Device, surface: dict[str, Any], atlas: Atlas, cells: Cells) -> PairBuffers:
    """Return the translucent pairs of a surface."""
    return find_pairs(device, surface, atlas, cells)


def interpolated(mesh: Mesh, atlas: Atlas, x: Index, y: Index, values: NDArray[Any]) -> Floats:
    """Return (n, k) a (v, k) vertex attribute interpolated at texels."""
    b = atlas.barycentric[y, x] / 65535.0
    weights = np.column_stack([1.0 - b.sum(axis=1), b])
    corners = values[mesh.triangles[atlas.triangle[y, x]]].astype(np.float64)
    return np.asarray(np.einsum("nk,nkc->nc", weights, corners))


def unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def taking(mesh: Mesh, atlas: Atlas, side: int) -> Points:
    """Return the receivers: middles of cells with texels of their own or beside such cells, in order."""
    own = np.zeros((side + 2, side + 2), bool)
    y, x = np.stack(np.nonzero(atlas.lit_mask)) * side // atlas.size
    for row, column in np.ndindex(3, 3):
        own[y + row, x + column] = True
    middle = ((np.arange(side) + 0.5) * atlas.size / side).astype(np.int64)
    row, column = np.nonzero(own[1:-1, 1:-1] & (atlas.triangle[np.ix_(middle, middle)] >= 0))
    cell = np.stack([column, row], axis=-1)
    x, y = middle[cell].T
    position, normal = (interpolated(mesh, atlas, x, y, a) for a in (mesh.positions, mesh.normals))
    return Points(cell, middle[cell], position, unit(normal), np.zeros(len(cell)))


def giving(mesh: Mesh, atlas: Atlas, side: int) -> Points:
    """Return the sources: cells with surface of their own, with its centre, area and normal."""
    y, x = np.nonzero(atlas.lit_mask)
    corners = atlas.corner_uv[atlas.triangle[y, x]].astype(float) * atlas.size
    b = atlas.barycentric[y, x] / 65535.0
    place = np.einsum("nk,nkc->nc", np.column_stack([1 - b.sum(axis=1), b]), corners) - 0.5
    inside = np.abs(place - np.stack([x, y], axis=-1)).max(axis=1) < INSIDE
    x, y = x[inside], y[inside]
    p, q = mesh.positions[mesh.triangles].astype(float), atlas.corner_uv.astype(float) * atlas.size
    surface = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    flat = np.abs(np.linalg.det(np.stack([q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]], axis=1)))
    mm2 = (surface / np.maximum(flat, 1e-9))[atlas.triangle[y, x]]
    column, row, ratio = x * side // atlas.size, y * side // atlas.size, atlas.size / side
    off = np.hypot(x + 0.5 - (column + 0.5) * ratio, y + 0.5 - (row + 0.5) * ratio)
    cell = row * side + column
    order = np.lexsort((off, cell))
    kept = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    at = interpolated(mesh, atlas, x, y, mesh.positions)
    area, *moment = (np.bincount(cell, w)[cell[kept]] for w in (mm2, *(mm2 * c for c in at.T)))
    texel = np.stack([x, y], axis=-1)[kept]
    normal = unit(interpolated(mesh, atlas, *texel.T, mesh.normals))
    centre = np.stack(moment, axis=-1) / area[:, None]
    return Points(np.stack([column, row], axis=-1)[kept], texel, centre, normal, area)


def rise(start: float, end: float, x: Floats) -> Floats:
    """Return a smooth step from 0 at `start` to 1 at `end`."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def share_of(cosine: Floats, inward: Floats) -> Floats:
    return rise(0.5, -0.2, cosine) * rise(-0.5, 0.0, inward)


@dataclass(frozen=True)
class Lie:
    """Geometry of pairs, (m, n) each: cosine of the normals, mean inward cosine, lengths [mm]."""

    cosine: Floats
    inward: Floats
    square: Floats
    depth: Floats

    def share(self, radius_mm: float) -> Floats:
        return np.where(self.square < radius_mm**2, share_of(self.cosine, self.inward), 0.0)


def lie(taken: Points, given: Points) -> Lie:
    """Return the geometry of all pairs of receivers and sources."""
    to = given.position[None] - taken.position[:, None]
    square, depth = (to**2).sum(-1), np.einsum("mnk,nk->mn", to, given.normal)
    inward = 0.5 * (depth - np.einsum("mnk,mk->mn", to, taken.normal)) / np.sqrt(np.maximum(square, 1e-12))
    return Lie(taken.normal @ given.normal.T, inward, square, np.abs(depth))


def passes(found: Lie, area: Floats, cells: Cells) -> Floats:
    """Return (m, n) the largest transmitted light over the least relevant one; 0 out of reach."""
    share, v = share_of(found.cosine - TURN, found.inward + TURN), cells.max_sigma_mm**2
    light = share * area * np.exp(-0.5 * found.square / v) / (LEAST * 2 * np.pi * v)
    return np.where(found.square < cells.radius_mm**2, light, 0.0)


def along(atlas: Atlas, taken: Points, given: Points, same: float) -> Floats:
    """Return (m, n) distances along the surface, infinite where no blur leads.

    same : distance of positions in the atlas that count as one [texel]
    """
    corners = atlas.corner_uv[np.maximum(atlas.triangle, 0)].astype(float)
    place = np.einsum("yxk,yxkc->yxc", atlas.barycentric_weights(), corners) * atlas.size - 0.5
    away = np.full((len(taken.texel), len(given.texel)), np.inf)
    rows, columns = np.indices(atlas.triangle.shape)
    for j, texel in enumerate(given.texel):
        y, x = np.nonzero(atlas.coverage & (np.abs(place - texel).max(axis=-1) <= same))
        for ty, tx in zip(rows[y, x], columns[y, x], strict=True):
            du, dv = tx - taken.texel[:, 0], ty - taken.texel[:, 1]
            rx, ry = taken.texel.T
            up = atlas.edge_distance[ry, rx].astype(int)
            across = atlas.edge_distance[ty, rx].astype(int)
            fits = (dv >= -up[:, 2]) & (dv <= up[:, 3]) & (du >= -across[:, 0]) & (du <= across[:, 1])
            far = far_of(atlas, taken, du, dv)
            away[:, j] = np.where(fits, np.minimum(away[:, j], far), away[:, j])
    return away


def far_of(atlas: Atlas, taken: Points, du: NDArray[Any], dv: NDArray[Any]) -> Floats:
    """Return (m,) distances along the surface from receivers to positions in the atlas [mm]."""
    rx, ry = taken.texel.T
    su, sv = np.moveaxis(atlas.stretch[ry, rx].astype(float), -1, 0)
    a, b = du / su, dv / sv
    return np.asarray(np.sqrt(a * a + b * b + 2 * atlas.shear[ry, rx].astype(float) * a * b))


def passed(found: Lie, far: Floats, area: Floats, cells: Cells, variance: Floats, weight: Floats) -> Floats:
    """Return (..., 3) weights of pairs: straight transmission without the blur along the surface.

    far, area : (...,) distance along the surface [mm], and area of the source [mm2]
    variance : of the blurred levels, whose first smooth one sources sample
    """
    radius, cell = cells.radius_mm, cells.cell_mm
    smooth = np.flatnonzero(variance >= (0.45 * cell) ** 2)
    before = variance[smooth[0]] if len(smooth) else variance[-1]
    far = np.where(far < radius, np.sqrt(far**2 + area / 6.0), np.inf)
    aside2 = np.maximum(found.square - found.depth**2, 0.0)
    total = np.zeros((*found.depth.shape, 3))
    for v, colour in zip(variance, weight, strict=True):
        w = np.maximum(v - before, GRAIN * np.maximum(area, cell**2))
        disc = np.maximum(1 - np.exp(-np.maximum(radius**2 - found.depth**2, 0) / (2 * w)), LEAST_DISC)
        straight = np.exp(-(found.depth**2) / (2 * v) - aside2 / (2 * w)) / disc
        total += (np.maximum(0, straight - np.exp(-(far**2) / (2 * w))) / w)[..., None] * colour
    return np.asarray((found.share(radius) * area / (2 * np.pi))[..., None] * total)


def decoded(words: NDArray[np.uint32]) -> Floats:
    """Return (n, 3) weights from words with a common exponent."""
    parts = np.stack([words & 511, (words >> 9) & 511, (words >> 18) & 511], axis=-1)
    return np.asarray(parts * np.exp2((words >> 27).astype(float) - 24)[:, None])
