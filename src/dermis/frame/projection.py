"""Projection matrices of cameras and shadow maps, for column vectors and reversed depth (1 near, 0 far)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.outline import Outline
from dermis.scene.camera import ImageRectangle
from dermis.scene.lights import PointLight

Vectors = NDArray[np.float64]
Matrix = NDArray[np.float64]
Triple = tuple[float, float, float]
Axes = tuple[Triple, Triple, Triple]
MatrixRow = tuple[float, float, float, float]
MatrixRows = tuple[MatrixRow, MatrixRow, MatrixRow]
_MAX_HALF_VIEW_TANGENT = math.tan(math.radians(80.0))
_MIN_LIGHT_DISTANCE_MM = 1.0
_UP_DIRECTION = 0.0, 1.0, 0.0
_NO_RECTANGLE_SHIFT = 0.0, 0.0
PIXEL_CENTRE = np.full((1, 2), 0.5)
"""Sample position of views with one sample per pixel."""


class Views(NamedTuple):
    """Projections for the layers of a texture array: one layer for each sample position of each view.

    clips : (k, 4, 4) matrices from world to clip space
    sample_positions : (n, 2) positions of the samples in a pixel, from 0 to 1 to the right and down [pixels]
    """

    clips: Matrix
    sample_positions: Matrix

    def clip_matrices_of_samples(self, layer_size: tuple[int, int]) -> Matrix:
        """Return (k n, 4, 4) matrices from world to clip space, one for each of n samples of k views.

        They are shifted so that pixel centres fall on sample positions.

        layer_size : (width, height) of a layer [pixels]
        """
        shift = (self.sample_positions - 0.5) * (-2.0 / layer_size[0], 2.0 / layer_size[1])  # in clip space
        matrices = np.repeat(self.clips[:, None], len(shift), axis=1)
        matrices[:, :, :2] += shift[..., None] * self.clips[:, None, 3:]
        return matrices.reshape(-1, 4, 4)


class ShadowView(NamedTuple):
    """View of the head from a light, for its shadow map.

    clip : (4, 4) matrix from world to clip space
    texel : side of a texel: in mm for parallel light, else relative to the distance from the light [-]
    origin : position of the light; for parallel light the centre of the map [mm]
    right, up : unit vectors along the rows and columns of the map
    near, far : depths at which the map stores 1 and 0 [mm]
    """

    clip: Matrix
    texel: float
    origin: Triple
    right: Triple
    up: Triple
    near: float
    far: float


def shadow_map_views(views: Sequence[ShadowView | None]) -> Views:
    """Return the projections of all shadow maps, sampled at pixel centres.

    views : view of the head for each shadow map; None for a light without shadows, which is skipped
    """
    return Views(np.array([view.clip for view in views if view]).reshape(-1, 4, 4), PIXEL_CENTRE)


def view_axes_array(forward: Vectors, up: Vectors) -> tuple[Vectors, Vectors, Vectors]:
    """Return the unit vectors right, up and forward of a view direction, as NumPy arrays."""
    right, upward, ahead = view_axes(forward.tolist(), up.tolist())
    return np.array(right), np.array(upward), np.array(ahead)


def view_axes(forward: Sequence[float], up: Sequence[float] = _UP_DIRECTION) -> Axes:
    """Return the unit vectors right, up and forward of a view direction, as tuples.

    For single vectors, this function is faster than NumPy. If `up` is parallel to `forward`, it is replaced
    by a horizontal axis.
    """
    f = unit_vector(forward)
    r = _cross(f, up)
    if math.hypot(*r) <= 1e-6 * math.hypot(*up):
        r = _cross(f, (1.0, 0.0, 0.0) if abs(f[0]) < 0.9 else (0.0, 0.0, 1.0))
    r = unit_vector(r)
    return r, _cross(r, f), f


def world_position(position: Sequence[float], centre: Sequence[float]) -> Triple:
    """Return the world position of a point that is given relative to the centre of the head [mm].

    position : point relative to the centre of the head [mm]
    centre : centre of the head [mm]
    """
    return position[0] + centre[0], position[1] + centre[1], position[2] + centre[2]


def vector_between(start_point: Sequence[float], end_point: Sequence[float]) -> Triple:
    """Return the vector from `start_point` to `end_point`."""
    return end_point[0] - start_point[0], end_point[1] - start_point[1], end_point[2] - start_point[2]


def unit_vector(vector: Sequence[float]) -> Triple:
    """Return a vector scaled to unit length."""
    x, y, z = vector
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


def _dot(first_vector: Sequence[float], second_vector: Sequence[float]) -> float:
    return (
        first_vector[0] * second_vector[0]
        + first_vector[1] * second_vector[1]
        + first_vector[2] * second_vector[2]
    )


def _cross(first_vector: Sequence[float], second_vector: Sequence[float]) -> Triple:
    (ax, ay, az), (bx, by, bz) = first_vector, second_vector
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def view_rows(eye: Triple, axes: Axes) -> MatrixRows:
    """Return the upper three rows of the view matrix, which give x to the right, y up and depth forward.

    eye : position of the camera or light in the world [mm]
    axes : unit vectors right, up and forward
    """
    right, up, forward = axes
    return (*right, -_dot(right, eye)), (*up, -_dot(up, eye)), (*forward, -_dot(forward, eye))


def perspective_rows(
    view_matrix_rows: MatrixRows, image_rectangle: ImageRectangle, near: float, far: float
) -> list[Sequence[float]]:
    """Return the rows of the matrix from world to clip space for a rectangle of the image plane.

    Depth is reversed, which gives a similar precision at all distances, because floats are densest near 0.

    view_matrix_rows : upper three rows of the view matrix
    image_rectangle : rectangle of the image plane that the picture shows
    near, far : distances at which depth is 1 and 0 [mm]
    """
    scale = -near / (far - near)
    depth = [scale * c for c in view_matrix_rows[2]]
    depth[3] -= far * scale
    lateral = zip(view_matrix_rows, image_rectangle.half, image_rectangle.shift, strict=False)
    across = [
        [c / half - shift * w for c, w in zip(row, view_matrix_rows[2], strict=True)]
        for row, half, shift in lateral
    ]
    return [*across, depth, view_matrix_rows[2]]


def depth_range(outline: Outline, view_matrix_rows: MatrixRows) -> tuple[float, float]:
    """Return the nearest and farthest depth of a shape in view space, with a small margin [mm].

    view_matrix_rows : upper three rows of the view matrix
    """
    z = np.array(view_matrix_rows[2], np.float32) @ outline.homogeneous_points
    near, far = float(z.min()) - outline.margin_mm, float(z.max()) + outline.margin_mm
    return max(near - 1.0, 0.5, 1e-3 * far), max(far + 1.0, 2.0)


def point_shadow_views(
    lights: Sequence[tuple[str, PointLight]], centre: Triple, outline: Outline, map_side: int
) -> list[ShadowView]:
    """Return, for each point light, the narrowest view from the light that contains the whole mesh.

    lights : name of each light in error messages, and the light
    centre : centre of the head, the origin of light positions [mm]
    outline : outline of the head's shape
    map_side : side of the shadow maps [texels]

    Raises DermisError if a light is inside the bounds of the mesh, because one shadow map cannot cover all
    directions.
    """
    if not lights:
        return []
    eyes = [world_position(light.position, centre) for _, light in lights]
    axes = [view_axes(vector_between(eye, outline.centre_mm)) for eye in eyes]
    rows = [view_rows(*one) for one in zip(eyes, axes, strict=True)]
    stacked = np.array(list(zip(*rows, strict=True)), np.float32).reshape(-1, 4)
    view_points = (stacked @ outline.homogeneous_points).reshape(3, len(rows), -1)
    depth = view_points[2]
    near, far = depth.min(axis=1).tolist(), depth.max(axis=1).tolist()
    _check_lights_outside(lights, [one > _MIN_LIGHT_DISTANCE_MM for one in near])
    steepest = _largest_tangents(view_points[:2], depth)
    _check_lights_outside(lights, [one <= _MAX_HALF_VIEW_TANGENT for one in steepest])
    slack = outline.margin_mm
    bounds = [
        (1.02 * h, max(0.98 * n - slack, 0.1 * n), 1.02 * f + slack)
        for h, n, f in zip(steepest, near, far, strict=True)
    ]
    clips = [
        perspective_rows(r, ImageRectangle((h, h), _NO_RECTANGLE_SHIFT), n, f)
        for r, (h, n, f) in zip(rows, bounds, strict=True)
    ]
    return [
        ShadowView(clip, 2.0 * h / map_side, eye, right, up, n, f)
        for clip, eye, (right, up, _), (h, n, f) in zip(np.array(clips), eyes, axes, bounds, strict=True)
    ]


def _check_lights_outside(lights: Sequence[tuple[str, PointLight]], outside_flags: Sequence[bool]) -> None:
    if not all(outside_flags):
        light_label, light = lights[outside_flags.index(False)]
        actual = f"it is at {[round(c) for c in light.position]} mm"
        refuse(light_label, "a position outside the head", actual, "Move it away or set shadows = false")


def _largest_tangents(side_coordinates: NDArray[np.floating], depth: NDArray[np.floating]) -> list[float]:
    """Return, for each view, the tangent of half the field of view that contains all points [-].

    side_coordinates : (2, k, n) x and y of n points in k views; overwritten to avoid allocations
    depth : (k, n) depths of the points
    """
    for side in side_coordinates:
        side /= depth  # one by one: NumPy allocates buffers when it divides both at once
    largest: list[float] = np.abs(side_coordinates, out=side_coordinates).max(axis=(0, 2)).tolist()
    return largest


def parallel_shadow_view(direction: Vectors, outline: Outline, map_side: int) -> ShadowView:
    """Return the narrowest view along the direction of parallel light that contains the whole mesh.

    direction : (3,) direction in which the view looks
    outline : outline of the head's shape
    map_side : side of the shadow map [texels]
    """
    points = outline.points_mm
    axes = view_axes_array(direction, np.array(_UP_DIRECTION))
    local = points @ np.stack(axes, axis=1)
    margin = 1.0 + np.array([0.0, 0.0, outline.margin_mm])
    low, high = local.min(axis=0) - margin, local.max(axis=0) + margin
    half = 0.51 * float(max(high[0] - low[0], high[1] - low[1]))
    clip = np.eye(4)
    clip[0, :3], clip[1, :3] = axes[0] / half, axes[1] / half
    clip[2, :3] = -axes[2] / (high[2] - low[2])
    clip[0, 3], clip[1, 3] = -0.5 * (low[0] + high[0]) / half, -0.5 * (low[1] + high[1]) / half
    clip[2, 3] = high[2] / (high[2] - low[2])
    middle = 0.5 * (low[0] + high[0]) * axes[0] + 0.5 * (low[1] + high[1]) * axes[1]
    origin, right, up = ((float(x), float(y), float(z)) for x, y, z in (middle, axes[0], axes[1]))
    return ShadowView(clip, 2.0 * half / map_side, origin, right, up, float(low[2]), float(high[2]))


@cache
def pixel_sample_positions(sample_count: int) -> NDArray[np.float64]:
    """Return the sample positions within a pixel: a (sample_count, 2) Hammersley set in the unit square."""
    index = np.arange(sample_count)
    y, digit, remaining = np.zeros(sample_count), 0.5, index.copy()
    while remaining.any():
        y += digit * (remaining & 1)
        remaining >>= 1
        digit /= 2
    points = np.stack([(index + 0.5) / sample_count, y + 0.5 / sample_count], axis=-1) % 1.0
    points.flags.writeable = False
    return points
