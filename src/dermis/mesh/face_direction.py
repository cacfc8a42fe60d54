"""Direction in which a face looks, from its eyes, or from the symmetry and the relief of the head."""

from __future__ import annotations

from typing import Literal

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.geometry import cross_columns, dot_columns

Direction = Literal["x", "z", "-x", "-z"]
# Numbers of examined triangles, of points sampled on them, and of points that are mirrored:
_MAX_ANALYSED_TRIANGLES, _SURFACE_SAMPLE_COUNT, _MIRRORED_SAMPLE_COUNT = 40_000, 6_000, 800
# Limits for the eyes, relative to the width of both together:
_MAX_EYE_DEPTH, _MAX_EYE_HEIGHT = 0.67, 0.6  # largest extent from back to front, and upwards
_MIN_EYE_GAP = 0.1  # smallest gap between the eyes
_HEAD_RADIUS_IN_EYE_WIDTHS = 3.0  # horizontal radius around the eyes within which vertices count as the head
# offset of the eyes from the middle of the head: forwards, and to a side
_MIN_EYE_OFFSET_AHEAD, _MAX_EYE_OFFSET_ASIDE = 0.25, 0.25
# Limits for the head, relative to its height:
_MAX_HEAD_WIDTH = 0.68  # largest width of the head without shoulders
_HEAD_DEPTH_RANGE = 0.5, 1.6  # smallest and largest depth
_MAX_ASYMMETRY = 0.03  # largest root mean square distance of mirrored points from the surface
_MIN_NOSE_HEIGHT = 0.04  # smallest protrusion of the middle of the face
_MIN_NORMAL_VARIATION = 0.03  # smallest variation of normals, see `_normal_variation`
_VARIATION_CELL_SIDE = 0.08  # side of the cells in `_normal_variation`
# Height of the rows in `_ridge_height`, largest distance of the ridge from the middle, distance of its sides:
_RIDGE_ROW_HEIGHT, _MAX_RIDGE_OFFSET, _RIDGE_SIDE_RANGE = 0.05, 0.03, (0.07, 0.12)
# Smallest ratio of the larger to the smaller asymmetry about the horizontal axes, and of relief and of nose
# at the front to those at the back:
_MIN_ASYMMETRY_RATIO, _MIN_RELIEF_RATIO, _MIN_NOSE_RATIO = 2.2, 1.4, 1.35


def face_direction(positions: Doubles, triangles: Index, eyes: Doubles) -> Direction | None:
    """Return the direction in which a face looks: x, z, -x or -z; None if it is uncertain.

    positions : (v, 3) vertices of any unit, Y up
    triangles : (f, 3) vertex indices
    eyes : (n, 3) vertices of eyeballs, or joints of the eyes; empty if unknown

    Known eyes show the front, because they lie in front of the middle of the head. Without them, the head
    must be symmetric about a vertical plane. The front is then the side with more relief and with a nose.
    """
    if not len(triangles):
        return None
    corners = positions[triangles[:: 1 + len(triangles) // _MAX_ANALYSED_TRIANGLES]]
    return _direction_from_eyes(corners[:, 0], eyes) or _direction_from_shape(corners)


def _direction_from_eyes(points: Doubles, eyes: Doubles) -> Direction | None:
    if len(eyes) < 2:
        return None
    middle, spread = (eyes.min(axis=0) + eyes.max(axis=0)) / 2, np.ptp(eyes, axis=0)
    front = 2 if spread[0] > spread[2] else 0
    width = spread[2 - front]
    if (2 * np.abs(eyes - middle)[:, 2 - front]).min() < _MIN_EYE_GAP * width:
        return None  # the vertices are those of one eye
    offset = np.abs(points - middle)
    near = points[
        (offset[:, 1] < width / 2)
        & (np.hypot(offset[:, 0], offset[:, 2]) < _HEAD_RADIUS_IN_EYE_WIDTHS * width)
    ]
    if spread[front] > _MAX_EYE_DEPTH * width or spread[1] > _MAX_EYE_HEIGHT * width or not len(near):
        return None
    shift = middle - (near.min(axis=0) + near.max(axis=0)) / 2
    if (
        abs(shift[front]) < _MIN_EYE_OFFSET_AHEAD * width
        or abs(shift[2 - front]) > _MAX_EYE_OFFSET_ASIDE * width
    ):
        return None
    return _axis_name(front, shift[front])


def _direction_from_shape(corners: Doubles) -> Direction | None:
    """Return the direction in which a head or a standing figure looks; None if it is uncertain.

    corners : (f, 3, 3) corner positions of the triangles
    """
    top, height = float(corners[..., 1].max()), _head_height(corners[:, 0])
    head = corners[corners[..., 1].max(axis=1) >= top - height]
    normals = _area_normals(head)
    if height <= 0 or not normals.any():
        return None
    points, normals = _sample_surface(head, normals)
    points = (points - [0.0, top, 0.0]) / height
    points[:, ::2] -= (points[:, ::2].min(axis=0) + points[:, ::2].max(axis=0)) / 2
    asymmetry = _asymmetry(points, 0), _asymmetry(points, 2)
    front = 2 if asymmetry[0] < asymmetry[1] else 0
    low, high = sorted(asymmetry)
    depths = np.ptp(points[:, front])
    if (
        low > _MAX_ASYMMETRY
        or high < _MIN_ASYMMETRY_RATIO * low
        or not _HEAD_DEPTH_RANGE[0] < depths < _HEAD_DEPTH_RANGE[1]
    ):
        return None
    sides = points[:, front] > 0, points[:, front] < 0
    reliefs = [_normal_variation(points[side], normals[side]) for side in sides]
    noses = [_ridge_height(points[side], front) for side in sides]
    first = int(noses[1] > noses[0])
    has_nose = noses[first] > max(_MIN_NOSE_HEIGHT, _MIN_NOSE_RATIO * noses[1 - first])
    has_relief = reliefs[first] > max(_MIN_NORMAL_VARIATION, _MIN_RELIEF_RATIO * reliefs[1 - first])
    if not (has_nose and has_relief):
        return None
    return _axis_name(front, 1 - 2 * first)


def _axis_name(axis: int, sign: float) -> Direction:
    if axis == 0:
        return "x" if sign > 0 else "-x"
    return "z" if sign > 0 else "-z"


def _head_height(points: Doubles) -> float:
    """Return the height of the head of a figure.

    The head extends from the top of the figure down to the shoulders, where the figure becomes wider.

    points : (n, 3) points of the figure, Y up
    """
    ordered = points[np.argsort(-points[:, 1])]
    depth, across = ordered[0, 1] - ordered[:, 1], ordered[:, ::2]
    widths = np.maximum.accumulate(across) - np.minimum.accumulate(across)
    fits = np.flatnonzero((widths.min(axis=1) <= _MAX_HEAD_WIDTH * depth) & (depth > 0.03 * depth[-1]))
    return float(depth[fits[0]] if len(fits) else depth[-1])


def _area_normals(corners: Doubles) -> Doubles:
    """Return normals of triangles (f, 3, 3) as columns (3, f) whose lengths are twice the triangle areas."""
    a, b, c = np.moveaxis(corners, 0, -1)
    return cross_columns(b - a, c - a)


def _sample_surface(corners: Doubles, normals: Doubles) -> tuple[Doubles, Doubles]:
    """Return points (n, 3) that are spread evenly over triangles (f, 3, 3), and their unit normals.

    normals : (3, f) normals of the triangles, whose lengths are twice the triangle areas
    """
    areas = np.sqrt(dot_columns(normals, normals))
    total = np.cumsum(areas)
    chosen = np.searchsorted(
        total, (np.arange(_SURFACE_SAMPLE_COUNT) + 0.5) / _SURFACE_SAMPLE_COUNT * total[-1]
    )
    shares = np.sort(np.random.default_rng(0).random((2, _SURFACE_SAMPLE_COUNT)), axis=0)
    shares = np.diff(shares, axis=0, prepend=0, append=1)
    return np.einsum("fkc,kf->fc", corners[chosen], shares), (normals[:, chosen] / areas[chosen]).T


def _asymmetry(points: Doubles, mirrored_axis: int) -> float:
    """Return the root mean square distance of mirrored points (n, 3) from the nearest original points.

    mirrored_axis : index of the coordinate that is mirrored
    """
    single = points.astype(np.float32)
    mirrored = single[:: len(points) // _MIRRORED_SAMPLE_COUNT] * np.where(
        np.arange(3) == mirrored_axis, -1, 1
    ).astype(np.float32)
    squares = (-2 * mirrored) @ single[::2].T
    squares += (single[::2] ** 2).sum(axis=1)
    nearest = squares.min(axis=1) + (mirrored**2).sum(axis=1)
    return float(np.sqrt(np.maximum(nearest, 0).mean()))


def _normal_variation(points: Doubles, normals: Doubles) -> float:
    """Return how much normals (n, 3) of nearby points (n, 3) differ, from 0 (not at all) to 1 [-]."""
    keys = np.floor(points / _VARIATION_CELL_SIDE).astype(np.int64) @ [1, 1 << 20, 1 << 40]
    cells = np.unique(keys, return_inverse=True)[1].reshape(-1)
    sums: Doubles = np.stack([np.bincount(cells, one) for one in normals.T])
    return 1 - float(np.sqrt(dot_columns(sums, sums)).sum()) / max(len(points), 1)


def _ridge_height(points: Doubles, front_axis: int) -> float:
    """Return how far the nose protrudes beyond the cheeks of a face; nearly 0 if there is no nose.

    points : (n, 3) points of the front or back of a head
    front_axis : index of the coordinate along which the face may look
    """
    row = (points[:, 1] / -_RIDGE_ROW_HEIGHT).astype(int)
    across, depth = points[:, 2 - front_axis], np.abs(points[:, front_axis])
    low, high = _RIDGE_SIDE_RANGE
    bands = (
        np.abs(across) < _MAX_RIDGE_OFFSET,
        (across > low) & (across < high),
        (across < -low) & (across > -high),
    )
    middle, left, right = reach = np.zeros((3, row.max(initial=0) + 1))
    for deepest, band in zip(reach, bands, strict=True):
        np.maximum.at(deepest, row[band], depth[band])
    has_points = (middle > 0) & (left > 0) & (right > 0)
    return float((middle - np.maximum(left, right))[has_points].max(initial=0.0))
