"""The triangle mesh of a head, with uv and materials, in millimetres."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.arrays import Doubles, Floats, Ints, Mask
from dermis.base.summary import ShortRepr
from dermis.mesh.fabric import Fabric
from dermis.mesh.geometry import tangents, vertex_normals, weld
from dermis.mesh.outline import Outline, convex_hull
from dermis.mesh.skull import Point, body_skull_centre, is_head_sized, skull_centre_below

MouthPart = Literal["upper teeth", "lower teeth", "tongue"]
MOUTH_PARTS: tuple[MouthPart, ...] = ("upper teeth", "lower teeth", "tongue")


@dataclass(frozen=True)
class Material:
    """Material of a group of triangles.

    name : name of the group in the file
    kind : "skin" is rendered with subsurface scattering, "opaque" with a diffuse and a specular lobe
    colour : diffuse albedo where there is no colour map, linear Rec. 709 [-]
    part : name of a part of the mouth, which selects a colour in mouth.wgsl; None for other surfaces
    eye : whether the file declares the group to be an eyeball
    has_maps : whether `Maps.parts` contains colour and surface maps of an opaque group; the factors of the
        file's material are already included in these maps
    roughness : perceptual roughness of an opaque group, see glTF [-]; None for wet eyes and teeth
    metalness : 1 for metal [-]
    emission : radiance that the group emits, linear Rec. 709
    opacity_cutoff : opacity below which the group is cut out; 0 to cut out nothing
    fabric : weave and sheen of cloth; None for other surfaces
    label : label class of clothing and glasses of a parametric human; empty for other surfaces
    """

    name: str
    kind: str = "skin"
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    part: MouthPart | None = None
    eye: bool = False
    has_maps: bool = False
    roughness: float | None = None
    metalness: float = 0.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    opacity_cutoff: float = 0.0
    fabric: Fabric | None = None
    label: str = ""


@dataclass(frozen=True, repr=False)
class Mesh(ShortRepr):
    """Triangles with attributes at vertices.

    Y is up and the face looks towards +Z; seen from outside, the corners of a triangle are counter-clockwise.
    A point on a uv seam has several vertices, one for each uv; all of them have the same `point`.

    positions : (v, 3) positions of the vertices [mm]
    normals : (v, 3) normals of the vertices, unit vectors
    uv : (v, 2) u to the right, v DOWN: (0, 0) is the top-left corner of every map, in [0, 1]
    point : (v,) index of the point at which each vertex lies
    triangles : (f, 3) vertex indices
    material : (f,) index into `materials`
    materials : materials of the triangles
    quads : (q, 2) pairs of triangles (a, b, c) and (c, d, a) that form a quad abcd; no rows if the mesh has
        no quads
    """

    positions: Floats
    normals: Floats
    uv: Floats
    point: Ints
    triangles: Ints
    material: Ints
    materials: tuple[Material, ...]
    quads: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int32))

    @property
    def points_mm(self) -> Doubles:
        """Return the positions (p, 3) of the points, each of which can have several vertices [mm]."""
        points = np.zeros((int(self.point.max()) + 1, 3))
        points[self.point] = self.positions
        return points

    @property
    def cut_out_mask(self) -> Mask:
        """Return a mask (f,) of triangles, such as hair cards, from which an opacity map cuts out parts."""
        return np.array([one.has_maps and one.opacity_cutoff > 0 for one in self.materials])[self.material]

    @property
    def size_mm(self) -> Floats:
        """Return the size (3,) of the bounding box along x, y and z [mm]."""
        return np.asarray(self.positions.max(axis=0) - self.positions.min(axis=0))

    @cached_property
    def outline(self) -> Outline:
        """Return the corners of the convex hull, which bound the mesh in every direction."""
        return convex_hull(self.positions)

    @cached_property
    def is_head_sized(self) -> bool:
        """Return whether the mesh has the size and proportions of a head or bust."""
        return is_head_sized(self.positions)

    @cached_property
    def skull_centre_mm(self) -> Point | None:
        """Return the centre of the skull [mm]; None for a mesh without a head.

        Neck, shoulders and body do not shift this centre.
        """
        if self.is_head_sized:
            return skull_centre_below(self.positions, float(self.positions[:, 1].max()))
        is_eye = np.array([one.eye for one in self.materials])[self.material]
        return body_skull_centre(
            self.positions, self.triangles, self.positions[self.triangles[is_eye].ravel()]
        )

    @cached_property
    def body(self) -> Mesh:
        """Return the mesh without clothing and glasses, whose triangles come last."""
        worn = [index for index, one in enumerate(self.materials) if one.label]
        if not worn:
            return self
        triangles = self.triangles[self.material < worn[0]]
        vertices = int(triangles.max()) + 1
        return Mesh(
            self.positions[:vertices],
            self.normals[:vertices],
            self.uv[:vertices],
            self.point[:vertices],
            triangles,
            self.material[: len(triangles)],
            self.materials[: worn[0]],
            self.quads,
        )

    @cached_property
    def topology_key(self) -> bytes:
        """Return a digest that is the same for all meshes that differ only in the positions of points."""
        digest = hashlib.blake2b(digest_size=16)
        for part in (self.uv, self.point, self.triangles, self.material):
            digest.update(np.ascontiguousarray(part).tobytes())
        return digest.digest()

    @property
    def dpdu(self) -> Floats:
        """Return the derivatives (v, 3) of the position with respect to u at the vertices [mm]."""
        return self._tangents[0]

    @property
    def dpdv(self) -> Floats:
        """Return the derivatives (v, 3) of the position with respect to v at the vertices [mm]."""
        return self._tangents[1]

    @cached_property
    def _tangents(self) -> tuple[Floats, Floats]:
        # Computed on demand, as a person that uses the atlas of its template needs none.
        return tangents(self.positions, self.uv, self.normals, self.triangles)


def _valid_normals(file_normals: Floats, computed_normals: Floats) -> Floats:
    """Return the file's normals (v, 3), with computed normals in place of those that are not unit vectors.

    file_normals, computed_normals : (v, 3) normals of the file, and normals computed from the triangles
    """
    finite = np.isfinite(file_normals)
    length = np.linalg.norm(np.where(finite, file_normals, 0).astype(np.float64), axis=1, keepdims=True)
    valid = finite.all(axis=1, keepdims=True) & (np.abs(length - 1) < 0.05)
    return np.asarray(
        np.where(valid, file_normals / np.where(valid, length, 1), computed_normals).astype(np.float32)
    )


def build_mesh(
    positions: ArrayLike,
    uv: ArrayLike,
    triangles: ArrayLike,
    material: ArrayLike,
    materials: tuple[Material, ...],
    normals: ArrayLike | None = None,
    point: ArrayLike | None = None,
    quads: ArrayLike = (),
) -> Mesh:
    """Build a `Mesh` from arrays.

    positions : (v, 3) positions of the vertices, all finite [mm]
    uv : (v, 2) texture coordinates of the vertices, with v downwards, see `Mesh`
    triangles : (f, 3) vertex indices, at least one triangle
    material : (f,) index into `materials`
    materials : materials of the triangles
    normals : (v, 3) unit normals; computed instead where they are invalid, or everywhere if None
    point : (v,) index of the point at which each vertex lies; the vertices at a uv seam share a point. If
        None, vertices at equal positions share a point
    quads : (q, 2) pairs of triangles that are a quad, see `Mesh`
    """
    positions = np.ascontiguousarray(positions, dtype=np.float32)
    triangles = np.ascontiguousarray(triangles, dtype=np.int32)
    points = weld(positions) if point is None else np.asarray(point, dtype=np.int32)
    computed = vertex_normals(positions, points, triangles)
    return Mesh(
        positions,
        computed if normals is None else _valid_normals(np.asarray(normals, dtype=np.float32), computed),
        np.ascontiguousarray(uv, dtype=np.float32),
        points,
        triangles,
        np.ascontiguousarray(material, dtype=np.int32),
        tuple(materials),
        np.asarray(quads, dtype=np.int32).reshape(-1, 2),
    )
