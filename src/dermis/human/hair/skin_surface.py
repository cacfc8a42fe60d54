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

_NEIGHBOURS = 6  # vertices that a place's tangent plane is the mean of


class SkinSurface:
    """A surface, by its vertices with their normals.

    mesh : as it is drawn
    which : those of its vertices that are near enough to count; all when left out
    """

    def __init__(self, mesh: Mesh, vertex_index: NDArray[np.int64] | None = None) -> None:
        both = mesh.positions, mesh.normals
        positions_mm, normals = (
            one if vertex_index is None else one.take(vertex_index, axis=0) for one in both
        )
        self._places, normals = positions_mm.astype(np.float64), normals.astype(np.float64)
        self._planes = np.column_stack([normals, (self._places * normals).sum(axis=1)])

    def project(self, places_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Where places (n, 3) are on the skin when put there along its normal, and that normal [mm]."""
        distance, near = self._tree.query(places_mm, k=_NEIGHBOURS)
        weights = 1.0 / (distance**2 + 0.05)
        weights /= weights.sum(axis=1, keepdims=True)
        plane = np.einsum("nk,nkc->nc", weights, self._planes.take(near, axis=0))
        height = (places_mm * plane[:, :3]).sum(axis=1) - plane[:, 3]
        normal = plane[:, :3] / np.sqrt((plane[:, :3] ** 2).sum(axis=1, keepdims=True))
        return places_mm - height[:, None] * normal, normal

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._places, compact_nodes=False, balanced_tree=False)


def tangent_component(vectors: Doubles, normals: Doubles) -> Doubles:
    """What of ways (n, 3) lies along the skin."""
    return np.asarray(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


class RootFrames:
    """Roots on the head as it is drawn.

    places, frame : (n, 3) and (n, 3, 3), from `frames` [mm]
    """

    def __init__(self, roots: Roots, positions_mm: Doubles, frame: Doubles) -> None:
        self.roots, self.positions_mm, self.frame = roots, positions_mm, frame

    @property
    def normals(self) -> Doubles:
        """(n, 3) of the skin."""
        return np.asarray(self.frame[:, 2])

    @cached_property
    def frame_vectors(self) -> Floats:
        """(3, 3, n) the frames, roots last."""
        return np.ascontiguousarray(self.frame.transpose(1, 2, 0), np.float32)


class GrowthSurface:
    """What hair grows on: the head as it is drawn, and its mesh before it was subdivided.

    skin : of the head, where hairs lie
    share : of the usual number of hairs that grows, each as much wider
    """

    def __init__(self, head: Head, control_mesh: Mesh, skin: SkinSurface, hair_fraction: float = 1.0) -> None:
        self.control_mesh, self.skin, self.hair_fraction = control_mesh, skin, hair_fraction
        self._mesh, self._levels = head.mesh, head.levels
        self._columns = np.ascontiguousarray(head.mesh.points_mm.T)

    @property
    def points_mm(self) -> Doubles:
        """(p, 3) of the drawn mesh, the control points first; numbers lie as `frames` reads them."""
        return self._columns.T

    def root_frames(self, roots: Roots) -> RootFrames:
        """Roots on quads of the plain mesh."""
        finer = finer_roots(self.control_mesh, roots, self._levels)
        return RootFrames(finer, *frames(self._mesh, finer, self.points_mm))


class HairGroup(NamedTuple):
    """Hairs of one kind.

    knots, radius : (n, k, 3) in the frames of the roots, as `Strands` has them, and (n, k) [mm]
    darker : factor of their pigments
    bundle : how many hairs each stands for
    cover : of roots by the hair around them
    """

    roots: Roots
    knots: Floats
    radius: Floats
    pigment_factor: float
    hairs_per_strand: float = 1.0
    cover: float = 0.0
