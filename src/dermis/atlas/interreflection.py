"""Which patches of a surface see each other through the air: form factors, by lines all through its space."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from dermis.base.disk import stored
from dermis.base.progress import preparing
from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
Words = NDArray[np.uint32]

SIDE = 128
"""Cells along the side of the uv square that take light; 2 x 2 of them are a patch that gives it."""
SAMPLES = 8
"""Places at which a patch is lit."""
BUNDLES, LINES = 128, (96, 256)  # directions of parallel lines; least and most lines along a bundle's side
_FEW = 12, 64  # the same, to learn whether a surface sees anything of itself
_FORM = 3  # raise when `find_links` gives other results
_LEAST = 1e-3  # share of the hemisphere below which links are left out, and the others made up for them
_SEED = 20
_ROW = 4096  # of lines: more than a bundle has along its side


@dataclass(frozen=True, eq=False)
class Links:
    """What cells of the uv square see of the surface's own patches.

    first, patch, share : (SIDE^2 + 1,), (k,) and (k,) float32 where the links of each cell begin, the patch
        that each leads to, and its form factor [0..1]
    own : (SIDE^2,) the patch that each belongs to, or the nearest one
    held : (SIDE^2,) float32 how well a cell is known: lines that left it, over the usual number, at most 1
    bounce_first, bounce_patch, bounce_share : the same links of patches
    triangle, weights : (p * SAMPLES,) uint32 places of the patches: triangle, its packed weights
    """

    first: Words
    patch: Words
    share: NDArray[np.float32]
    own: Words
    held: NDArray[np.float32]
    bounce_first: Words
    bounce_patch: Words
    bounce_share: NDArray[np.float32]
    triangle: Words
    weights: Words

    @property
    def patches(self) -> int:
        """How many give light."""
        return len(self.bounce_first) - 1


def cached_links(mesh: Mesh, place: NDArray[np.float32], mapped: NDArray[np.bool_]) -> Links:
    """`find_links`, read back from disk when they were found before."""
    digest = hashlib.sha256(f"{_FORM} {SIDE} {SAMPLES} {BUNDLES} {LINES} {_LEAST}".encode())
    for array in (mesh.positions, mesh.triangles, place, np.packbits(mapped)):
        digest.update(np.ascontiguousarray(array).tobytes())
    names = [field.name for field in fields(Links)]

    @preparing("finding which parts of the skin see each other")
    def make() -> dict[str, NDArray[np.generic]]:
        found = find_links(mesh, place, mapped)
        return {name: getattr(found, name) for name in names}

    return Links(**stored("interreflection", digest.hexdigest()[:40], names, make))


def find_links(mesh: Mesh, place: NDArray[np.float32], mapped: NDArray[np.bool_]) -> Links:
    """Form factors between cells and patches, by bundles of parallel lines [Sbert1993].

    place : (f, 3, 2) uv of the triangles' corners in the atlas
    mapped : (f,) triangles that have texels; the others are in the way of light and give none

    Lines lie evenly in all directions and places: the share of those leaving one patch that meet another next
    is its form factor.
    """
    seen, left = _seen(mesh, place, mapped, *_FEW)
    if len(seen):
        lines = int(np.clip(np.sqrt(len(mesh.triangles)), *LINES))
        seen, left = _seen(mesh, place, mapped, BUNDLES, lines)
    return _links(seen, left, mesh, place, mapped)


def _seen(
    mesh: Mesh, place: NDArray[np.float32], mapped: NDArray[np.bool_], bundles: int, lines: int
) -> tuple[Index, Floats]:
    """(m, 2) cells at both ends of lines through the air, and (SIDE^2,) how many lines left each cell."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    corners -= 0.5 * (low + high)
    per_mm = 0.5 * lines / (float(np.linalg.norm(corners, axis=2).max()) or 1.0)
    rng, left, seen = np.random.default_rng(_SEED), np.zeros(SIDE * SIDE), [np.zeros((0, 2), np.int64)]
    for way in _half_sphere(bundles):
        axes = per_mm * _axes(way, rng.uniform(0.0, 2.0 * np.pi))
        points = corners @ axes.T + np.append(lines + rng.uniform(-0.5, 0.5, 2), 0.0)
        line, depth, outward, triangle, weights = crossings(points)
        cell = np.where(mapped[triangle], _cells(place[triangle], weights), -1)
        left += np.bincount(cell[cell >= 0], minlength=SIDE * SIDE)
        seen.append(_through_air(line, depth, outward, cell))
    return np.concatenate(seen), left


def crossings(points: Floats) -> tuple[Index, Floats, NDArray[np.bool_], Index, Floats]:
    """Where the lines x, y = whole numbers meet triangles.

    Returns line, z, whether the surface looks towards +z there, triangle, (n, 3) its weights; of (f, 3, 3).
    """
    low, high = np.ceil(points[..., :2].min(axis=1)), np.floor(points[..., :2].max(axis=1))
    wide, tall = (np.maximum(high - low + 1, 0).astype(np.int64)).T
    count = wide * tall
    some = np.flatnonzero(count)
    triangle = np.repeat(some, count[some])
    number = np.arange(len(triangle)) - np.repeat(np.cumsum(count[some]) - count[some], count[some])
    x, y = low[triangle].T + np.stack([number % wide[triangle], number // wide[triangle]])
    a, b, c = points[triangle].transpose(1, 0, 2)
    across = np.stack(
        [
            (b[:, 0] - x) * (c[:, 1] - y) - (b[:, 1] - y) * (c[:, 0] - x),
            (c[:, 0] - x) * (a[:, 1] - y) - (c[:, 1] - y) * (a[:, 0] - x),
            (a[:, 0] - x) * (b[:, 1] - y) - (a[:, 1] - y) * (b[:, 0] - x),
        ],
        axis=1,
    )
    area = across.sum(axis=1)
    inside = (across * np.sign(area)[:, None] >= 0.0).all(axis=1) & (area != 0.0)
    weights = across[inside] / area[inside, None]
    depth = (weights * points[triangle[inside], :, 2]).sum(axis=1)
    line = (y[inside] * _ROW + x[inside]).astype(np.int64)
    return line, depth, area[inside] > 0.0, triangle[inside], weights


def _through_air(line: Index, depth: Floats, outward: NDArray[np.bool_], cell: Index) -> Index:
    """(m, 2) cells that lines leave, and the cell that each meets next, -1 for one without texels.

    Both ways along each line, without those that meet nothing more.
    """
    order = np.lexsort((depth, line))
    line, outward, cell = line[order], outward[order], cell[order]
    # Light leaves a body where it looks outward, and meets one that looks back.
    air = (line[1:] == line[:-1]) & outward[:-1] & ~outward[1:]
    pair = np.stack([cell[:-1][air], cell[1:][air]], axis=1)
    return np.concatenate([pair, pair[:, ::-1]])


def _cells(place: NDArray[np.float32], weights: Floats) -> Index:
    uv = np.einsum("nk,nkc->nc", weights, place)
    x, y = np.clip((SIDE * uv).astype(np.int64), 0, SIDE - 1).T
    return np.asarray(y * SIDE + x)


def _half_sphere(count: int) -> Floats:
    """(count, 3) unit vectors evenly over half of the sphere."""
    index = np.arange(count) + 0.5
    z, phi = index / count, np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def _axes(way: Floats, turn: float) -> Floats:
    """(3, 3) rows right, up and along a direction, turned about it."""
    side = np.cross(way, np.eye(3)[np.abs(way).argmin()])
    side /= np.linalg.norm(side)
    up = np.cross(way, side)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * side + s * up, c * up - s * side, way])


def _links(
    met: Index, left: Floats, mesh: Mesh, place: NDArray[np.float32], mapped: NDArray[np.bool_]
) -> Links:
    """The form factors of lines that were counted."""
    patch_of, triangle, weights = _patches(mesh, place, mapped)
    count = len(triangle) // SAMPLES
    there = (met >= 0).all(axis=1)
    cell, patch = met[there, 0], patch_of[met[there, 1]]
    giver, known = patch_of[cell], patch >= 0
    gone = np.bincount(patch_of[patch_of >= 0], left[patch_of >= 0], count).astype(np.float64)
    usual = np.median(left[left > 0]) if (left > 0).any() else 1.0
    known_giver = known & (giver >= 0)
    return Links(
        *_rows(cell[known], patch[known], left, count),
        _nearest(patch_of),
        np.minimum(left / usual, 1.0).astype(np.float32),
        *_rows(giver[known_giver], patch[known_giver], gone, count),
        triangle,
        weights,
    )


def _nearest(patch_of: Index) -> Words:
    """(SIDE^2,) the patch of each cell, for those of none that of the nearest cell in uv."""
    from scipy.ndimage import distance_transform_edt

    known = patch_of.reshape(SIDE, SIDE)
    if not (known >= 0).any():
        return np.zeros(SIDE * SIDE, np.uint32)
    nearest = distance_transform_edt(known < 0, return_distances=False, return_indices=True)
    return np.asarray(known[tuple(nearest)].ravel(), np.uint32)


def _rows(giver: Index, patch: Index, left: Floats, patches: int) -> tuple[Words, Words, NDArray[np.float32]]:
    """Where each row begins, the patches that it leads to, and their shares."""
    pair, lines = np.unique(giver * max(patches, 1) + patch, return_counts=True)
    row, column = pair // max(patches, 1), pair % max(patches, 1)
    share = lines / left[row]
    kept = share >= _LEAST
    whole, rest = (np.bincount(row[some], share[some], len(left)) for some in (slice(None), kept))
    share = share[kept] * (whole / np.maximum(rest, 1e-12))[row[kept]]
    first = np.concatenate([[0], np.cumsum(np.bincount(row[kept], minlength=len(left)))])
    return first.astype(np.uint32), column[kept].astype(np.uint32), share.astype(np.float32)


def _patches(mesh: Mesh, place: NDArray[np.float32], mapped: NDArray[np.bool_]) -> tuple[Index, Words, Words]:
    """(SIDE^2,) the patch of each cell, -1 for none, and places by chance over all patches."""
    triangle, weights, rank = _places(mesh, mapped)
    half, cell = SIDE // 2, _cells(place[triangle], weights)
    patch = (cell // SIDE // 2) * half + cell % SIDE // 2
    order = np.lexsort((rank, patch))
    own, first, size = np.unique(patch[order], return_index=True, return_counts=True)
    number = np.full(half * half, -1, np.int64)
    number[own] = np.arange(len(own))
    chosen = order[(first[:, None] + np.arange(SAMPLES) % np.maximum(size, 1)[:, None]).ravel()]
    packed = np.rint(65535 * weights[chosen]).astype(np.uint32)
    y, x = np.divmod(np.arange(SIDE * SIDE), SIDE)
    patch_of = number[(y // 2) * half + x // 2]
    words = packed[:, 1] | (packed[:, 2] << np.uint32(16))
    return patch_of, triangle[chosen].astype(np.uint32), words.astype(np.uint32)


def _places(mesh: Mesh, mapped: NDArray[np.bool_]) -> tuple[Index, Floats, Floats]:
    """Places by chance: at least one of each triangle with texels; its weights, and a rank.

    The first by rank lie evenly over the surface.
    """
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    area = np.where(mapped, 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), 0.0)
    each = 1 + np.floor(SIDE * SIDE * SAMPLES * area / max(area.sum(), 1e-30)).astype(np.int64)
    triangle = np.repeat(np.flatnonzero(mapped), each[mapped])
    rng, count = np.random.default_rng(_SEED), each[triangle]
    u, v = np.sqrt(rng.random(len(triangle))), rng.random(len(triangle))
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    return triangle, weights, rng.exponential(size=len(triangle)) * count / np.maximum(area[triangle], 1e-30)
