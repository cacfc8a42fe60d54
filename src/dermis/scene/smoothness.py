"""How finely a head is subdivided for its silhouette to look smooth in a picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.geometry import edges, sum_at
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.subdivide import MAX_LEVELS
from dermis.scene.camera import Camera, portrait
from dermis.scene.head_table import AUTO

SubdivisionLevels = int | Callable[[Head], int]
Subdivide = SubdivisionLevels | Literal["auto"]
"""Levels of subdivision, "auto" for a portrait of 1024x1024, or a function of the head as it comes."""
Doubles = NDArray[np.float64]
MAX_SMOOTH_TRIANGLES = 300_000
"""Of a mesh that is subdivided for its silhouette's sake."""
MAX_DEVIATION_PX = 0.6
"""How far a silhouette's edges may lie off the smooth curve: corners of less are lost in a pixel's filter."""
_SMOOTH_FRACTION = (
    0.9  # of the silhouette's length that keeps to it; the rest are creases and what is hidden mostly
)
_NEAR_PLANE_MM = 1.0  # before the eye


@dataclass(frozen=True)
class SmoothIn:
    """As many levels of subdivision as a head's outline needs to look smooth in a picture.

    camera : from where the head, as it comes, is seen
    size : of the picture [pixel]

    For `subdivide` of `load_head`. It depends on nothing but these and the head at rest.
    """

    camera: Callable[[Head], Camera] = portrait
    size: tuple[int, int] = (1024, 1024)

    def __call__(self, head: Head) -> int:
        """The levels, 0 to 3, which do not lead to more than `MAX_SMOOTH_TRIANGLES` triangles."""
        triangles = len(head.mesh.triangles)
        if 4 * triangles > MAX_SMOOTH_TRIANGLES:
            return 0
        K, R, t = self.camera(head).to_opencv(self.size)
        seen = silhouette(head.mesh, K, R, t - R @ np.array(head.centre_mm), self.size)
        return smooth_levels(seen.typical_deviation_px, triangles)


def resolve_levels(subdivide: Subdivide) -> SubdivisionLevels:
    """Levels, or the function that finds them.

    Raises DermisError for other words.
    """
    if subdivide == AUTO:
        return SmoothIn()
    if isinstance(subdivide, str):
        refuse("subdivide", f"{AUTO} or 0 to {MAX_LEVELS} levels", f"got {subdivide!r}", "Choose one")
    return subdivide


class Silhouette(NamedTuple):
    """The edges between what faces the eye and what does not, in a picture.

    length_px : (e,) of each
    off_px : (e,) how far each lies off the smooth curve through its ends, at most
    """

    length_px: Doubles
    deviation_px: Doubles

    @property
    def typical_deviation_px(self) -> float:
        """How far most of it lies off the smooth curve at most; 0 for a picture without a silhouette."""
        if not len(self.deviation_px):
            return 0.0
        order = np.argsort(self.deviation_px)
        cumulative_length = np.cumsum(self.length_px[order])
        return float(
            self.deviation_px[order][
                np.searchsorted(cumulative_length, _SMOOTH_FRACTION * cumulative_length[-1])
            ]
        )


def silhouette(mesh: Mesh, K: Doubles, R: Doubles, t: Doubles, size: tuple[int, int]) -> Silhouette:
    """The silhouette of a mesh but for its eyeballs, whether or not something is before it.

    K, R, t : of the camera as OpenCV has them, t for places of the mesh itself [mm]
    size : width and height of the picture [pixel]

    The curve through two points bends as their normals n say: it leaves the chord d by |dn . dd| / 8.
    """
    camera_points = mesh.points_mm @ R.T + t
    normals = sum_at(mesh.point, mesh.normals.astype(np.float64), len(camera_points))
    normals = normals @ R.T / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    depth = np.maximum(camera_points[:, 2], _NEAR_PLANE_MM)
    pixels = (camera_points @ K.T)[:, :2] / depth[:, None]
    eye = np.array([one.eye for one in mesh.materials])[mesh.material]
    ends, of_side, sides = edges(mesh.point[mesh.triangles[~eye]])
    facing = np.tile(_faces_camera(pixels, mesh.point[mesh.triangles[~eye]]), 3)
    on_silhouette = (sides == 2) & (np.bincount(of_side, facing, len(ends)) == 1)
    a, b = ends[on_silhouette].T
    middle = (pixels[a] + pixels[b]) / 2
    seen = ((middle >= 0) & (middle < size)).all(axis=1) & (np.minimum(depth[a], depth[b]) > _NEAR_PLANE_MM)
    a, b = a[seen], b[seen]
    bend_mm = (
        np.einsum("ek,ek->e", (normals[a] - normals[b])[:, :2], (camera_points[a] - camera_points[b])[:, :2])
        / 8
    )
    scale = K[1, 1] / (0.5 * (depth[a] + depth[b]))
    return Silhouette(np.linalg.norm(pixels[a] - pixels[b], axis=1), np.abs(bend_mm) * scale)


def smooth_levels(typical_deviation_px: float, triangles: int) -> int:
    """The fewest levels of subdivision with which a silhouette looks smooth.

    coarseness_px : of the mesh as it is; a level leaves a quarter of it
    triangles : of the mesh as it is; a level has four times as many
    """
    needed = math.ceil(math.log(max(typical_deviation_px / MAX_DEVIATION_PX, 1.0), 4))
    affordable = math.floor(math.log(max(MAX_SMOOTH_TRIANGLES / triangles, 1.0), 4))
    return min(needed, affordable, MAX_LEVELS)


def _faces_camera(pixels: Doubles, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(f,) whether each triangle faces the eye; y is down in the picture."""
    a, b, c = (pixels[triangles[:, corner]] for corner in range(3))
    one, other = b - a, c - a
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] < 0)
