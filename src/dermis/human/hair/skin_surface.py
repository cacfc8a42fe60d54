"""Skin surface over which hair grows, coordinate frames at hair roots, and groups of hairs."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, refine_roots, root_frames

_NEIGHBOUR_COUNT = 6  # vertices whose tangent planes are averaged


class SkinSurface:
    """Smooth skin surface onto which points can be projected, interpolated from vertices and their normals.

    positions_mm : (n, 3) vertices [mm]
    normals : (n, 3) unit normals at the vertices
    """

    def __init__(self, positions_mm: NDArray[np.floating], normals: NDArray[np.floating]) -> None:
        self._positions_mm, normals = positions_mm.astype(np.float64), normals.astype(np.float64)
        self._planes = np.column_stack([normals, (self._positions_mm * normals).sum(axis=1)])

    def project(self, points_mm: Doubles) -> tuple[Doubles, Doubles]:
        """Project points (n, 3) onto the skin along its normals; return projections [mm] and unit normals."""
        distance, near = self._vertex_kd_tree.query(points_mm, k=_NEIGHBOUR_COUNT)
        weights = 1.0 / (distance**2 + 0.05)
        weights /= weights.sum(axis=1, keepdims=True)
        plane = np.einsum("nk,nkc->nc", weights, self._planes.take(near, axis=0))
        height = (points_mm * plane[:, :3]).sum(axis=1) - plane[:, 3]
        normal = plane[:, :3] / np.sqrt((plane[:, :3] ** 2).sum(axis=1, keepdims=True))
        return points_mm - height[:, None] * normal, normal

    def distances_mm(self, points_mm: Doubles) -> Doubles:
        """Return the distances (n,) of points (n, 3) from the nearest vertex [mm]."""
        return np.asarray(self._vertex_kd_tree.query(points_mm)[0])

    @cached_property
    def _vertex_kd_tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._positions_mm, compact_nodes=False, balanced_tree=False)


def tangent_component(vectors: Doubles, normals: Doubles) -> Doubles:
    """Return vectors (n, 3) minus their components along the unit normals (n, 3)."""
    return np.asarray(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


class RootFrames:
    """Hair roots on the subdivided mesh, each with a coordinate frame for the knots of its hair.

    roots : roots on quads of the subdivided mesh
    positions_mm : (n, 3) positions of the roots [mm]
    frame : (n, 3, 3) coordinate frames, whose rows are the axes; the last axis is the normal
    """

    def __init__(self, roots: Roots, positions_mm: Doubles, frame: Doubles) -> None:
        self.roots, self.positions_mm, self.frame = roots, positions_mm, frame

    @cached_property
    def frame_vectors(self) -> Floats:
        """Return the coordinate frames as an array (3, 3, n).

        The first dimension is the axis of the frame, the second the x, y and z of this axis, and the third
        the root.
        """
        return np.ascontiguousarray(self.frame.transpose(1, 2, 0), np.float32)


class GrowthSurface:
    """Surface on which hair grows: the subdivided head with its control mesh.

    head : subdivided head
    control_mesh : mesh of the head before subdivision, on whose quads the roots are defined
    skin : smooth surface over which hairs lie
    hair_fraction : fraction of hairs to generate; the hairs are widened by the inverse of this fraction, so
        that coverage stays the same
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
        """Convert roots on quads of the control mesh to roots on the subdivided mesh.

        The result also contains the position of each root and the axes of its coordinate frame.
        """
        finer = refine_roots(self.control_mesh, roots, self._levels)
        return RootFrames(finer, *root_frames(self._mesh, finer, self.points_mm))


class HairGroup(NamedTuple):
    """Hairs that share pigment and coverage, such as one brow or one row of lashes.

    roots : roots of the n hairs on the subdivided mesh
    knots : (n, k, 3) positions of the knots in the root frames, see `Strands` [mm]
    radius : (n, k) radii of the hairs at the knots [mm]
    pigment_factor : pigment concentrations, divided by the concentrations in the person's look [-]
    hairs_per_strand : number of real hairs that each strand represents
    cover : projected area of the hairs around their roots, per area of skin, see `Strands` [-]
    """

    roots: Roots
    knots: Floats
    radius: Floats
    pigment_factor: float
    hairs_per_strand: float = 1.0
    cover: float = 0.0
