"""Hairs on a mesh: each is rooted in a quad and follows it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.geometry import crosses, dots
from dermis.mesh.mesh import Mesh

_LEAST = 1e-9


class Roots(NamedTuple):
    """Places on a mesh of quads.

    quad : (n,) rows of `Mesh.quads`
    place : (n, 2) on the way from the quad's first corner to its second, and to its last, 0 to 1
    """

    quad: Ints
    place: Floats


@dataclass(frozen=True, eq=False, repr=False)
class Strands(ShortRepr):
    """Hairs, thin round fibres through knots.

    roots : where each begins
    knots_mm : (n, k, 3) from the root, along the quad, beside that, and along its normal; from root to tip
    radius_mm : (n, k) of the fibre
    absorption : (n, 3) of its inside [1/mm]
    cover : (n,) of each root by the hair that stands around it, over each other; None for next to nothing [-]
    """

    roots: Roots
    knots_mm: Floats
    radius_mm: Floats
    absorption: Floats
    cover: Floats | None = None

    def __len__(self) -> int:
        return len(self.roots.quad)

    def places_mm(self, mesh: Mesh, points_mm: NDArray[np.floating]) -> Doubles:
        """(n, k, 3) the knots where the points of the mesh (p, 3) are [mm]."""
        root, frame = frames(mesh, self.roots, points_mm)
        return np.asarray(root[:, None] + np.einsum("nic,nki->nkc", frame, self.knots_mm))

    def middle_mm(self, mesh: Mesh) -> Doubles:
        """(3,) the mean of the roots on a mesh at rest [mm]."""
        return np.asarray(_places(mesh, self.roots, mesh.points_mm)[0].mean(axis=1))

    def refined(self, mesh: Mesh, finer: Mesh, levels: int) -> Strands:
        """The same hairs on the mesh refined by Catmull's and Clark's rules."""
        _, frame = frames(mesh, self.roots, mesh.points_mm)
        ways = np.einsum("nic,nki->nkc", frame, self.knots_mm)
        roots = finer_roots(mesh, self.roots, levels)
        return replace(self, roots=roots, knots_mm=seen_from(finer, roots, ways))


def seen_from(mesh: Mesh, roots: Roots, ways_mm: Doubles) -> Floats:
    """(n, k, 3) ways in space from roots to knots, as `Strands.knots_mm` has them on a mesh at rest [mm]."""
    return seen_in(frames(mesh, roots, mesh.points_mm)[1], ways_mm)


def seen_in(frame: Doubles, ways_mm: Doubles) -> Floats:
    """The same in frames (n, 3, 3) of the roots, from `frames`."""
    return np.asarray(np.einsum("nic,nkc->nki", frame, ways_mm), np.float32)


def corners(mesh: Mesh, quad: NDArray[np.integer]) -> Ints:
    """(n, 4) points of the mesh around quads."""
    first, second = mesh.quads.take(quad, axis=0).T
    around = np.empty((4, len(quad)), np.int32)
    around[:3], around[3] = mesh.triangles.take(first, axis=0).T, mesh.triangles[:, 1].take(second)
    return mesh.point.take(around).T


def weights(place: NDArray[np.floating]) -> Doubles:
    """(n, 4) shares of a quad's corners in places on it."""
    s, t = place.astype(np.float64).T
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)


def frames(mesh: Mesh, roots: Roots, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Where roots are (n, 3) [mm], and unit vectors along the quad, beside that, along its normal (n, 3, 3).

    points_mm : (p, 3) of the mesh
    """
    root, (a, b, c, d) = _places(mesh, roots, points_mm)
    along, normal = (b - a) + (c - d), crosses(c - a, d - b)
    along /= np.maximum(np.sqrt(dots(along, along)), _LEAST)
    normal -= dots(normal, along) * along
    normal /= np.maximum(np.sqrt(dots(normal, normal)), _LEAST)
    return root.T, np.stack([along, crosses(normal, along), normal]).transpose(2, 0, 1)


def _places(mesh: Mesh, roots: Roots, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Where roots are (3, n), and the corners of their quads (4, 3, n) [mm]."""
    columns = np.ascontiguousarray(points_mm.T, np.float64)
    around = columns.take(corners(mesh, roots.quad).T, axis=1)  # indexing takes ten times as long
    return between(roots.place, around), around.transpose(1, 0, 2)


def between(place: NDArray[np.floating], around: Doubles) -> Doubles:
    """(c, n) means in places (n, 2) on quads of what is at their corners (c, 4, n)."""
    share = weights(place).T
    found: Doubles = share[0] * around[:, 0]
    for k in range(1, 4):
        found += share[k] * around[:, k]
    return found


def finer_roots(mesh: Mesh, roots: Roots, levels: int) -> Roots:
    """The same places on the mesh refined by Catmull's and Clark's rules, whose quads begin at old corners.

    mesh : before it is refined
    """
    alone = len(mesh.triangles) - 2 * len(mesh.quads)
    quad, place = roots.quad.astype(np.int64), roots.place.astype(np.float64)
    for _ in range(levels):
        s, t = place.T
        corner = np.where(t < 0.5, np.where(s < 0.5, 0, 1), np.where(s < 0.5, 3, 2))
        ways = np.stack([place, np.stack([t, 1 - s], 1), 1 - place, np.stack([1 - t, s], 1)])
        place = np.clip(2 * ways[corner, np.arange(len(quad))], 0.0, 1.0)
        quad, alone = 3 * alone + 4 * quad + corner, 0
    return Roots(quad.astype(np.int32), place.astype(np.float32))
