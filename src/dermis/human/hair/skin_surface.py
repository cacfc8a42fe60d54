"""Skin surface on which strands grow, and groups of strands."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, refine_roots, root_frames

_NEIGHBOURS = 6  # vertices whose tangent planes are averaged


class SkinSurface:
    """Smooth surface through vertices with normals.

    mesh : the subdivided mesh
    vertex_index : vertices to use; all by default
    """

    def __init__(self, mesh: Mesh, vertex_index: NDArray[np.int64] | None = None) -> None:
        index = slice(None) if vertex_index is None else vertex_index
        self._positions_mm = mesh.positions[index].astype(np.float64)
        normals = mesh.normals[index].astype(np.float64)
        self._planes = np.column_stack([normals, (self._positions_mm * normals).sum(axis=1)])

    def project(self, points_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Return the projections of points (n, 3) onto the skin along its normals, and these normals [mm]."""
        distance, near = self._tree.query(points_mm, k=_NEIGHBOURS)
        weights = 1.0 / (distance**2 + 0.05)
        weights /= weights.sum(axis=1, keepdims=True)
        plane = np.einsum("nk,nkc->nc", weights, self._planes.take(near, axis=0))
        height = (points_mm * plane[:, :3]).sum(axis=1) - plane[:, 3]
        normal = plane[:, :3] / np.sqrt((plane[:, :3] ** 2).sum(axis=1, keepdims=True))
        return points_mm - height[:, None] * normal, normal

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._positions_mm, compact_nodes=False, balanced_tree=False)


def tangent_component(vectors: Doubles, normals: Doubles) -> Doubles:
    """Return the components of vectors (n, 3) tangential to the skin."""
    return np.asarray(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


class RootFrames:
    """Roots on the subdivided mesh, with their positions (n, 3) [mm] and coordinate frames (n, 3, 3)."""

    def __init__(self, roots: Roots, positions_mm: Doubles, frame: Doubles) -> None:
        self.roots, self.positions_mm, self.frame = roots, positions_mm, frame

    @cached_property
    def frame_vectors(self) -> Floats:
        """Return the frames (3, 3, n) with the root index last."""
        return np.ascontiguousarray(self.frame.transpose(1, 2, 0), np.float32)


class GrowthSurface:
    """Surface that hair grows on: the subdivided head and its control mesh.

    skin : surface of the head, over which hairs lie
    hair_fraction : fraction of the hairs that grow, each wider by the inverse
    """

    def __init__(self, head: Head, control_mesh: Mesh, skin: SkinSurface, hair_fraction: float = 1.0) -> None:
        self.control_mesh, self.skin, self.hair_fraction = control_mesh, skin, hair_fraction
        self._mesh, self._levels = head.mesh, head.levels
        self._columns = np.ascontiguousarray(head.mesh.points_mm.T)

    @property
    def points_mm(self) -> Doubles:
        """Return the points (p, 3) of the subdivided mesh, control points first, in column-major order."""
        return self._columns.T

    def root_frames(self, roots: Roots) -> RootFrames:
        """Return the positions and frames of roots on quads of the control mesh."""
        finer = refine_roots(self.control_mesh, roots, self._levels)
        return RootFrames(finer, *root_frames(self._mesh, finer, self.points_mm))


class HairGroup(NamedTuple):
    """Hairs of one kind.

    knots, radius : (n, k, 3) in the frames of the roots, see `Strands`, and (n, k) [mm]
    pigment_factor : factor of the pigments
    hairs_per_strand : number of hairs that each strand represents
    cover : coverage of the roots by surrounding hair
    """

    roots: Roots
    knots: Floats
    radius: Floats
    pigment_factor: float
    hairs_per_strand: float = 1.0
    cover: float = 0.0
