"""Lids in front of an eyeball that is fitted to a head.

The opening between the lids shows where the eye looks, and the lids limit how far forward the cornea can be.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.eyeball import CORNEA_MM, limbus_plane_mm
from dermis.mesh.fitted_eyes.balls import Sphere
from dermis.mesh.geometry import cross_2d, expand_runs

_RAYS_PER_SIDE, _HALF_SIDE_RADII = 49, 0.9
"""Number of rays along each side of a square in front of the eye, and half this side in radii of the ball."""
_IRIS_HALF_WIDTH_RADII = 0.25  # half the width of the iris in radii of the ball
_IRIS_RISE_FRACTION = 0.08  # height of the iris above the middle of the lids, in heights of their opening
_MAX_OPEN_RAY_FRACTION = 0.3  # largest fraction of rays at an end of the opening that meet no lid
_MAX_GAZE_ANGLE_RADIANS = np.radians(15.0)
_MAX_PROTRUSION_MM, _MIN_BULGE_MM = 0.3, 0.5
"""Largest height of a cornea above the lids, and least height of its apex above the ball [mm]."""


@dataclass(frozen=True, eq=False)
class Lids:
    """Surfaces in front of an eyeball, sampled by parallel rays towards it.

    ball : sphere of the eyeball
    axes : (3, 3) unit vectors as rows: across (to the side), up and ahead
    corners : (f, 3, 3) corners of the head's triangles in these axes, relative to the ball's centre [mm]
    """

    ball: Sphere
    axes: Doubles
    corners: Doubles

    @cached_property
    def ray_positions(self) -> Doubles:
        """Return the positions (n, 2) of the rays, relative to the ball's centre: x to the side, y up [mm].

        The rays are parallel to the third axis, the direction of gaze, so x and y are constant along a ray.
        """
        line = np.linspace(-_HALF_SIDE_RADII, _HALF_SIDE_RADII, _RAYS_PER_SIDE) * self.ball.radius
        x, y = np.meshgrid(line, line)
        return np.stack([x.ravel(), y.ravel()], axis=1)

    @cached_property
    def ball_depths_mm(self) -> Doubles:
        """Return the depth (n,) at which each ray hits the ball [mm]; 0 for a ray that misses it.

        Depth is measured from the ball's centre forwards, in the direction in which the eye looks.
        """
        return np.asarray(np.sqrt(np.maximum(self.ball.radius**2 - (self.ray_positions**2).sum(axis=1), 0.0)))

    @cached_property
    def obstacle_depths_mm(self) -> Doubles:
        """Return the depth (n,) at which each ray first hits the lids or other skin [mm].

        Depth is measured as in `ball_depths_mm`, and is -inf for a ray that hits no skin.
        """
        corners = self.corners[self.corners[:, :, 2].max(axis=1) > 0]
        triangle, ray = self._candidate_hits(corners)
        a, b, c = np.moveaxis(corners[triangle], 1, 0)
        b, c, p = b - a, c - a, self.ray_positions[ray] - a[:, :2]
        area = cross_2d(b, c)
        area = np.where(np.abs(area) < 1e-9, np.inf, area)
        u, v = cross_2d(p, c) / area, cross_2d(b, p) / area
        depth = a[:, 2] + u * b[:, 2] + v * c[:, 2]
        front = np.full(_RAYS_PER_SIDE**2, -np.inf)
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        np.maximum.at(front, ray[inside], depth[inside])
        return front

    def _candidate_hits(self, corners: Doubles) -> tuple[Index, Index]:
        """Return pairs of triangles and rays as two arrays of indices.

        In each pair, the ray passes through the bounding box of the triangle.

        corners : (f, 3, 3) corners of the triangles [mm]
        """
        extent = _HALF_SIDE_RADII * self.ball.radius
        cell = (corners[:, :, :2] + extent) * (_RAYS_PER_SIDE - 1) / (2 * extent)
        first = np.maximum(np.ceil(cell.min(axis=1)), 0).astype(np.int64)
        last = np.minimum(np.floor(cell.max(axis=1)), _RAYS_PER_SIDE - 1).astype(np.int64)
        size = np.maximum(last - first + 1, 0)
        triangle, index = expand_runs(np.zeros_like(size[:, 0]), size.prod(axis=1))
        row, column = np.divmod(index, size[triangle, 0])
        return triangle, (first[triangle, 1] + row) * _RAYS_PER_SIDE + first[triangle, 0] + column

    @property
    def opening_angles(self) -> tuple[float, float]:
        """Return the angles (side, up) of an eye that looks through the middle of the lids' opening [rad].

        Both angles are 0 if lids are missing on one side of the opening.
        """
        angles = []
        for axis, other, shift in ((0, 1, 0.0), (1, 0, _IRIS_RISE_FRACTION)):
            column = np.abs(self.ray_positions[:, other]) < _IRIS_HALF_WIDTH_RADII * self.ball.radius
            position = self.ray_positions[column, axis]
            is_open = (self.obstacle_depths_mm < self.ball_depths_mm)[column]
            ends = np.sign(position) * (np.abs(position) > 0.99 * position.max())
            if (
                not is_open.any()
                or max(is_open[ends == end].mean() for end in (-1, 1)) > _MAX_OPEN_RAY_FRACTION
            ):
                return 0.0, 0.0
            centre = position[is_open].mean() + shift * np.ptp(position[is_open])
            angles.append(
                float(
                    np.clip(
                        np.arcsin(centre / self.ball.radius),
                        -_MAX_GAZE_ANGLE_RADIANS,
                        _MAX_GAZE_ANGLE_RADIANS,
                    )
                )
            )
        return angles[0], angles[1]

    def turned_direction(self, angle_across: float, angle_up: float) -> Doubles:
        """Return the unit vector (3,) in head space that is turned sideways and upwards from straight ahead.

        angle_across, angle_up : angles by which the vector is turned sideways and upwards [rad]
        """
        local = (
            np.sin(angle_across) * np.cos(angle_up),
            np.sin(angle_up),
            np.cos(angle_across) * np.cos(angle_up),
        )
        return np.asarray(np.array(local) @ self.axes)

    def cornea_recess_mm(self, eye_axis: Doubles, cornea_scale: float) -> float:
        """Return the distance by which a cornea must be moved inwards to stay behind the lids [mm].

        eye_axis : (3,) unit vector of the eye's axis
        cornea_scale : size of the cornea relative to an adult's [-]
        """
        local, radius = self.axes @ eye_axis, CORNEA_MM * cornea_scale
        centre = cornea_scale * (
            limbus_plane_mm(self.ball.radius / cornea_scale) - limbus_plane_mm(CORNEA_MM)
        )
        distance2 = ((self.ray_positions - centre * local[:2]) ** 2).sum(axis=1)
        cornea = centre * local[2] + np.sqrt(np.maximum(radius**2 - distance2, 0.0))
        covered = (distance2 < radius**2) & (
            np.minimum(self.obstacle_depths_mm, cornea) > self.ball_depths_mm
        )
        protrusion = float((cornea - self.obstacle_depths_mm)[covered].max(initial=0.0))
        deepest = max(centre + radius - self.ball.radius - _MIN_BULGE_MM, 0.0)
        return float(np.clip(protrusion - _MAX_PROTRUSION_MM, 0.0, deepest))


def lids_in_front(corners_mm: Doubles, ball: Sphere, gaze_direction: Doubles) -> Lids:
    """Return the surfaces in front of an eyeball, mostly its lids.

    corners_mm : (f, 3, 3) corners of all triangles except the triangles of eyeballs, in head space
    ball : sphere of the eyeball
    gaze_direction : (3,) unit vector of the direction of gaze
    """
    axes = eye_axes(gaze_direction)
    return Lids(ball, axes, (corners_mm.astype(np.float64) - ball.centre) @ axes.T)


def eye_axes(eye_axis: Doubles) -> Doubles:
    """Return unit vectors as rows (3, 3): across (horizontal), up, and `eye_axis` itself."""
    across = np.cross((0.0, 1.0, 0.0), eye_axis)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(eye_axis, across), eye_axis])
