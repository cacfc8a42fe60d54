"""Surface of the average person, on which patterns of the skin such as zones and folds are defined."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import float_columns, read_rows
from dermis.mesh.geometry import triangle_areas, vertex_normals
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import Stencils

Floats = NDArray[np.float32]

BORDER_FIELDS = ("lips", "mouth", "lids")
"""Signed distances to borders [mm]: of the lips, positive inside; of the mouth, negative inside; of the
eyelids, negative on the side of the eye."""
_STORED_UNIT_MM = 0.01
_LID_WALL_DISTANCE_MM, _LID_EDGE_DISTANCE_MM = -2.0, -0.6  # lid distances of these columns of lid_rings.csv
_LID_CREST_DISTANCE_RANGE_MM = 0.15, 0.8  # limits of the lid distance in the crest column


@cache
def average_surface() -> tuple[Floats, Floats]:
    """Return the control points (p, 3) of the average person, and signed distances (p, 3) to borders [mm].

    For each point, these are the distances to the borders of the lips, the mouth and the eyelids; see
    `BORDER_FIELDS` for the signs.
    """
    points_mm, fields = _load_array("places"), _load_array("fields")
    rings = lid_rings()
    fields[rings[..., :2], 2] = _LID_WALL_DISTANCE_MM, _LID_EDGE_DISTANCE_MM
    fields[rings[..., 2], 2] = fields[rings[..., 2], 2].clip(*_LID_CREST_DISTANCE_RANGE_MM)
    return points_mm, fields


@cache
def lid_rings() -> NDArray[np.int64]:
    """Return the control points (2, r, 4) of the lids of the left and the right eye, as in lid_rings.csv.

    The columns are four concentric rings: socket wall, lid edge, crest of the lid margin, and skin.
    """
    left = float_columns(read_rows("dermis.human", "lid_rings"), "wall edge crest skin").astype(np.int64)
    points_mm = _load_array("places")
    mirrored = points_mm[left.ravel()] * np.array([-1.0, 1.0, 1.0], np.float32)
    opposite = np.array([np.abs(points_mm - point).sum(axis=1).argmin() for point in mirrored])
    return np.stack([left, opposite.reshape(left.shape)])


def _load_array(array_name: str) -> Floats:
    file = resources.files("dermis.human").joinpath("data", "average.npz")
    with resources.as_file(file) as path, np.load(path) as stored:
        return np.asarray(stored[array_name].astype(np.float32) * np.float32(_STORED_UNIT_MM))


_SURFACE_CACHE: dict[bytes, PaintedSurface] = {}
_MAX_CACHED_TOPOLOGIES = 3
_SURFACE_CACHE_LOCK = Lock()


@dataclass(frozen=True, eq=False)
class PaintedSurface:
    """Skin triangles of a human's mesh with the vertex attributes that painted_surface.wgsl reads.

    vertices : (v, 12) uv, position and normal on the average person, distances to `BORDER_FIELDS` [mm], and
        the base-2 logarithm of the length on the skin per unit of uv [mm]
    triangles : (t, 4) vertex indices, and 1 if an edge of the triangle is the border of a chart
    """

    vertices: Floats
    triangles: NDArray[np.uint32]

    @property
    def triangle_count(self) -> int:
        """Return the number of triangles to draw."""
        return len(self.triangles)


def painted_surface(mesh: Mesh, stencils: Stencils | None) -> PaintedSurface:
    """Return the skin triangles of a human's mesh; they are the same for all people and cached by topology.

    stencils : subdivision stencils that give the points of the mesh; None without subdivision
    """
    key = mesh.topology_key
    with _SURFACE_CACHE_LOCK:
        if key not in _SURFACE_CACHE:
            while len(_SURFACE_CACHE) >= _MAX_CACHED_TOPOLOGIES:
                _SURFACE_CACHE.pop(next(iter(_SURFACE_CACHE)))
            _SURFACE_CACHE[key] = _build_surface(mesh, stencils)
        return _SURFACE_CACHE[key]


def _build_surface(mesh: Mesh, stencils: Stencils | None) -> PaintedSurface:
    points_mm, fields = average_surface()
    skin = np.hstack([points_mm, fields]).astype(np.float64)
    count = int(mesh.point.max() if stencils is None else stencils.point.max()) + 1
    eyeballs = np.zeros((count, skin.shape[1]))[len(skin) :]  # zeros, as eyeballs are not painted
    control = np.concatenate([skin, eyeballs])
    points = control if stencils is None else stencils.points(control)
    vertices_mm = points[mesh.point].astype(np.float32)
    is_skin = np.array([material.kind == "skin" for material in mesh.materials])
    triangles = mesh.triangles[is_skin[mesh.material]]
    normals = vertex_normals(vertices_mm[:, :3], mesh.point, mesh.triangles)
    density = _log_mm_per_uv(mesh.uv, vertices_mm[:, :3], triangles)
    vertices = np.column_stack([mesh.uv, vertices_mm[:, :3], normals, vertices_mm[:, 3:], density]).astype(
        np.float32
    )
    flagged = np.column_stack([triangles, _touches_border(triangles)]).astype(np.uint32)
    return PaintedSurface(np.ascontiguousarray(vertices), np.ascontiguousarray(flagged))


def _log_mm_per_uv(uv: Floats, points_mm: Floats, triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the base-2 logarithm of the skin length per unit of uv around each vertex (v,) [mm]."""
    areas = triangle_areas(points_mm[triangles].astype(np.float64))
    a, b, c = (uv[triangles[:, k]].astype(np.float64) for k in range(3))
    ab, ac = b - a, c - a
    flat = np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]) / 2
    sums = [np.bincount(triangles.ravel(), np.repeat(each, 3), minlength=len(uv)) for each in (areas, flat)]
    return np.asarray(0.5 * np.log2(np.maximum(sums[0], 1e-9) / np.maximum(sums[1], 1e-12)))


def _touches_border(triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1).astype(np.int64)
    key = (sides[..., 0] * (int(triangles.max()) + 1) + sides[..., 1]).ravel()
    _, side_index, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.asarray((count[side_index] == 1).reshape(-1, 3).any(axis=1))
