"""Strands grown on a skin: positions and heights over its surface."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, finer_roots, frames

_NEAR = 6  # vertices that a place's tangent plane is the mean of


class Skin:
    """A surface, by its vertices with their normals.

    mesh : as it is drawn
    which : those of its vertices that are near enough to count; all when left out
    """

    def __init__(self, mesh: Mesh, which: NDArray[np.int64] | None = None) -> None:
        both = mesh.positions, mesh.normals
        places, normals = (one if which is None else one.take(which, axis=0) for one in both)
        self._places, normals = places.astype(np.float64), normals.astype(np.float64)
        self._planes = np.column_stack([normals, (self._places * normals).sum(axis=1)])

    def foot(self, places_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Where places (n, 3) are on the skin when put there along its normal, and that normal [mm]."""
        distance, near = self._tree.query(places_mm, k=_NEAR)
        share = 1.0 / (distance**2 + 0.05)
        share /= share.sum(axis=1, keepdims=True)
        plane = np.einsum("nk,nkc->nc", share, self._planes.take(near, axis=0))
        over = (places_mm * plane[:, :3]).sum(axis=1) - plane[:, 3]
        normal = plane[:, :3] / np.sqrt((plane[:, :3] ** 2).sum(axis=1, keepdims=True))
        return places_mm - over[:, None] * normal, normal

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._places, compact_nodes=False, balanced_tree=False)


def flattened(ways: Doubles, normals: Doubles) -> Doubles:
    """What of ways (n, 3) lies along the skin."""
    return np.asarray(ways - (ways * normals).sum(axis=1, keepdims=True) * normals)


class Rooted:
    """Roots on the head as it is drawn.

    places, frame : (n, 3) and (n, 3, 3), from `frames` [mm]
    """

    def __init__(self, roots: Roots, places: Doubles, frame: Doubles) -> None:
        self.roots, self.places, self.frame = roots, places, frame

    @property
    def normals(self) -> Doubles:
        """(n, 3) of the skin."""
        return np.asarray(self.frame[:, 2])

    @cached_property
    def along(self) -> Floats:
        """(3, 3, n) the frames, roots last."""
        return np.ascontiguousarray(self.frame.transpose(1, 2, 0), np.float32)


class Ground:
    """What hair grows on: the head as it is drawn, and its mesh before it was subdivided.

    skin : of the head, where hairs lie
    share : of the usual number of hairs that grows, each as much wider
    """

    def __init__(self, head: Head, plain: Mesh, skin: Skin, share: float = 1.0) -> None:
        self.plain, self.skin, self.share = plain, skin, share
        self._mesh, self._levels = head.mesh, head.levels
        self._columns = np.ascontiguousarray(head.mesh.points_mm.T)

    @property
    def points_mm(self) -> Doubles:
        """(p, 3) of the drawn mesh, the control points first; numbers lie as `frames` reads them."""
        return self._columns.T

    def rooted(self, roots: Roots) -> Rooted:
        """Roots on quads of the plain mesh."""
        finer = finer_roots(self.plain, roots, self._levels)
        return Rooted(finer, *frames(self._mesh, finer, self.points_mm))


class Grown(NamedTuple):
    """Hairs of one kind.

    knots, radius : (n, k, 3) in the frames of the roots, as `Strands` has them, and (n, k) [mm]
    darker : factor of their pigments
    bundle : how many hairs each stands for
    cover : of roots by the hair around them
    """

    roots: Roots
    knots: Floats
    radius: Floats
    darker: float
    bundle: float = 1.0
    cover: float = 0.0
