"""Choice of the subdivision levels at which the silhouette of a head looks smooth in a picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.renamed import successor
from dermis.mesh.geometry import edges, sum_by_index
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.subdivide import MAX_SUBDIVISION_LEVELS
from dermis.scene.camera import Camera, portrait
from dermis.scene.head_table import AUTO

SubdivisionLevels = int | Callable[[Head], int]
Subdivide = SubdivisionLevels | Literal["auto"]
"""Levels of subdivision, "auto" for a portrait of 1024x1024, or a function of the head before subdivision."""
Doubles = NDArray[np.float64]
MAX_SMOOTH_TRIANGLES = 300_000
"""Largest number of triangles that `SmoothOutlineLevels` subdivides to."""
MAX_SILHOUETTE_DEVIATION_PX = 0.6
"""Largest deviation of a silhouette from its smooth curve that the pixel filter hides [pixel]."""
_TYPICAL_DEVIATION_QUANTILE = (
    0.9  # fraction of the silhouette that must be smooth; the rest is mostly hidden or creases
)
_NEAR_PLANE_MM = 1.0


@dataclass(frozen=True)
class SmoothOutlineLevels:
    """Choice of the subdivision levels at which the outline of a head looks smooth in a picture.

    An instance is a function from a head to the number of levels; `load_head` accepts it as `subdivide`. The
    number depends only on the camera, the size and the head in rest pose.

    camera : function that returns a camera for the head before subdivision
    size : width and height of the picture [pixel]
    """

    camera: Callable[[Head], Camera] = portrait
    size: tuple[int, int] = (1024, 1024)

    def __call__(self, head: Head) -> int:
        """Return the subdivision levels for a head, 0 to 3, limited by `MAX_SMOOTH_TRIANGLES`."""
        triangles = len(head.mesh.triangles)
        if 4 * triangles > MAX_SMOOTH_TRIANGLES:
            return 0
        K, R, t = self.camera(head).to_opencv(self.size)
        seen = silhouette(head.mesh, K, R, t - R @ np.array(head.centre_mm), self.size)
        return smooth_subdivision_levels(seen.typical_deviation_px, triangles)


def resolve_levels(subdivide: Subdivide) -> SubdivisionLevels:
    """Return subdivision levels, or a function of the head that returns the levels.

    subdivide : number of levels or a function, which are returned unchanged, or "auto", which gives
        `SmoothOutlineLevels()`

    Raises DermisError for other text.
    """
    if subdivide == AUTO:
        return SmoothOutlineLevels()
    if isinstance(subdivide, str):
        refuse(
            "subdivide", f"{AUTO} or 0 to {MAX_SUBDIVISION_LEVELS} levels", f"got {subdivide!r}", "Choose one"
        )
    return subdivide


class Silhouette(NamedTuple):
    """Silhouette edges of a mesh in a picture: edges between a front-facing and a back-facing triangle.

    length_px : (e,) length of each edge [pixel]
    deviation_px : (e,) largest distance between each edge and the smooth curve through the edge's ends
        [pixel]
    """

    length_px: Doubles
    deviation_px: Doubles

    @property
    def typical_deviation_px(self) -> float:
        """Return the 90th percentile of the deviation, weighted by edge length [pixel]; 0 without edges."""
        if not len(self.deviation_px):
            return 0.0
        order = np.argsort(self.deviation_px)
        cumulative_length = np.cumsum(self.length_px[order])
        index = np.searchsorted(cumulative_length, _TYPICAL_DEVIATION_QUANTILE * cumulative_length[-1])
        return float(self.deviation_px[order][index])


def silhouette(mesh: Mesh, K: Doubles, R: Doubles, t: Doubles, picture_size: tuple[int, int]) -> Silhouette:
    """Return the silhouette edges of a mesh that lie within the picture, including occluded edges.

    Edges of eyeballs are omitted. How far a smooth curve would deviate from each edge is estimated from the
    normals at the ends of the edge.

    K, R, t : camera matrices in OpenCV's convention, which apply to the mesh's positions in mm
    picture_size : width and height of the picture [pixel]
    """
    camera_points = mesh.points_mm @ R.T + t
    normals = sum_by_index(mesh.point, mesh.normals.astype(np.float64), len(camera_points))
    normals = normals @ R.T / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    depth = np.maximum(camera_points[:, 2], _NEAR_PLANE_MM)
    pixels = (camera_points @ K.T)[:, :2] / depth[:, None]
    eye = np.array([one.eye for one in mesh.materials])[mesh.material]
    ends, of_side, sides = edges(mesh.point[mesh.triangles[~eye]])
    facing = np.tile(_faces_camera(pixels, mesh.point[mesh.triangles[~eye]]), 3)
    on_silhouette = (sides == 2) & (np.bincount(of_side, facing, len(ends)) == 1)
    a, b = ends[on_silhouette].T
    middle = (pixels[a] + pixels[b]) / 2
    visible = ((middle >= 0) & (middle < picture_size)).all(axis=1)
    visible &= np.minimum(depth[a], depth[b]) > _NEAR_PLANE_MM
    a, b = a[visible], b[visible]
    chords = (camera_points[a] - camera_points[b])[:, :2]
    bend_mm = np.einsum("ek,ek->e", (normals[a] - normals[b])[:, :2], chords) / 8
    scale = K[1, 1] / (0.5 * (depth[a] + depth[b]))
    return Silhouette(np.linalg.norm(pixels[a] - pixels[b], axis=1), np.abs(bend_mm) * scale)


def smooth_subdivision_levels(typical_deviation_px: float, triangle_count: int) -> int:
    """Return the smallest number of subdivision levels at which a silhouette looks smooth.

    typical_deviation_px : deviation of the silhouette before subdivision; each level divides it by 4 [pixel]
    triangle_count : number of triangles before subdivision; each level multiplies it by 4
    """
    needed = math.ceil(math.log(max(typical_deviation_px / MAX_SILHOUETTE_DEVIATION_PX, 1.0), 4))
    affordable = math.floor(math.log(max(MAX_SMOOTH_TRIANGLES / triangle_count, 1.0), 4))
    return min(needed, affordable, MAX_SUBDIVISION_LEVELS)


def _faces_camera(pixels: Doubles, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the mask (f,) of front-facing triangles, from vertices in pixel coordinates with y down."""
    a, b, c = (pixels[triangles[:, corner]] for corner in range(3))
    one, other = b - a, c - a
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] < 0)


def __getattr__(name: str) -> Any:
    """Return an object of this module by the name that it had in the last release, for compatibility."""
    if new := successor(__name__, name):
        return globals()[new]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
