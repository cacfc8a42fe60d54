"""The skin that hairs grow on: heights over it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.mesh.mesh import Mesh

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
