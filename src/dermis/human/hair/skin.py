"""The skin that hairs grow on: heights over it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Doubles, Roots, frames, points_of

_NEAR = 6  # vertices that a place's tangent plane is the mean of


class Skin:
    """A surface, by its vertices with their normals.

    mesh : as it is drawn
    points_mm : its points (p, 3)
    """

    def __init__(self, mesh: Mesh) -> None:
        self._mesh, self.points_mm = mesh, points_of(mesh)
        self._places, self._normals = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)

    def frames(self, roots: Roots) -> tuple[Doubles, Doubles]:
        """Where roots are and how their quads lie, see `mesh.strands.frames`."""
        return frames(self._mesh, roots, self.points_mm)

    def foot(self, places_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Where places (n, 3) are on the skin when put there along its normal, and that normal [mm]."""
        distance, near = self._tree.query(places_mm, k=_NEAR)
        share = 1.0 / (distance**2 + 0.05)
        share /= share.sum(axis=1, keepdims=True)
        normal = np.einsum("nk,nkc->nc", share, self._normals[near])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        over = ((places_mm[:, None] - self._places[near]) * self._normals[near]).sum(axis=2)
        return places_mm - (share * over).sum(axis=1)[:, None] * normal, normal

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._places, balanced_tree=False, compact_nodes=False)  # made in half the time
