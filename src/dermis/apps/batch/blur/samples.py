"""Cameras and times of the frames whose average is a blurred picture."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.scene.camera import Camera

SENSOR_HEIGHT_MM = 24.0
FOCUS_FACT_NAMES = "blur.focus_depth_mm", "blur.aperture_mm"
"""Facts about the blur of an image: depth of the plane in focus, and diameter of the aperture."""
_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


class Aperture(NamedTuple):
    """Aperture of a thin lens and the plane in focus.

    diameter_mm : diameter of the aperture; 0 for a pinhole [mm]
    focus_depth_mm : distance of the plane in focus from the lens, along the optical axis [mm]
    """

    diameter_mm: float
    focus_depth_mm: float


def thin_lens(points_mm: Doubles, camera: Camera, f_number: float, focus_mm: float) -> Aperture:
    """Return the aperture of a camera that focuses on the nearest of some points.

    points_mm : (n, 3) points, such as the corneas, relative to the head's centre [mm]
    camera : camera of the picture, whose angle of view determines the focal length
    f_number : focal length divided by the diameter of the aperture; 0 for a pinhole
    focus_mm : distance of the plane in focus behind the nearest point [mm]

    Raises DermisError if the plane in focus is not farther from the lens than the focal length.
    """
    axis = np.subtract(camera.target, camera.position) / math.dist(camera.target, camera.position)
    depth_mm = float(((points_mm - np.array(camera.position)) @ axis).min()) + focus_mm
    focal_mm = 0.5 * SENSOR_HEIGHT_MM / camera.half_view_tangent
    if depth_mm <= focal_mm:
        expected = f"a plane in focus farther from the lens than its focal length of {focal_mm:.4g} mm"
        refuse("blur: focus_mm", expected, f"its distance is {depth_mm:.4g} mm", "Raise it")
    return Aperture(focal_mm / f_number if f_number else 0.0, depth_mm)


def aperture_points(count: int) -> Doubles:
    """Return points (n, 2) in the unit disc with uniform density, on a golden-angle spiral.

    Consecutive points have different radii, so that times of the exposure and positions in the aperture are
    not correlated.
    """
    step = next(k for k in range(max(int(0.618 * count), 1), 2 * count) if math.gcd(k, count) == 1)
    order = (np.arange(count) * step) % count
    radius, angle = np.sqrt((order + 0.5) / count), _GOLDEN_ANGLE * order
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def shutter_times_ms(count: int, shutter_ms: float) -> Doubles:
    """Return the times (n,) of the frames relative to the middle of the exposure [ms]."""
    return shutter_ms * ((np.arange(count) + 0.5) / count - 0.5)


def camera_at(camera: Camera, aperture: Aperture, point: Doubles, picture_size: tuple[int, int]) -> Camera:
    """Return the pinhole camera at a point of the aperture, which images the plane in focus as the lens does.

    point : (2,) point in the unit disc, to the right and up
    picture_size : width and height [pixel]
    """
    if not aperture.diameter_mm:
        return camera
    K, R, t = camera.to_opencv(picture_size)
    x, y = 0.5 * aperture.diameter_mm * point
    K = K.copy()
    K[0, 2] += K[0, 0] * x / aperture.focus_depth_mm
    K[1, 2] -= K[1, 1] * y / aperture.focus_depth_mm
    return Camera.from_opencv(K, R, t - [x, -y, 0.0], picture_size)
