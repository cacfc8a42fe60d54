"""Cameras as OpenCV has them: a matrix of intrinsics, a rotation and a translation."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse, shown_value
from dermis.base.quantities import numbers

Doubles = NDArray[np.float64]
_CORNER = 0.5  # from the middle of the first pixel, which is OpenCV's origin, to the picture's corner [pixel]
_ROUNDING = 1e-4  # of rotations and skews as they are written in files
_LEAST_MM = 1.0
_LARGEST = 1e9
_MOST_PIXELS = 1e6  # along a side


class OpenCvCamera(NamedTuple):
    """X_cam = R X + t [mm], and K X_cam the pixel: x to the right, y down, z forward.

    K, R : (3, 3); fx, fy, cx and cy [pixel]
    t : (3,) [mm]
    """

    K: Doubles
    R: Doubles
    t: Doubles


def from_opencv(K: ArrayLike, R: ArrayLike, t: ArrayLike, size: tuple[int, int]) -> dict[str, Any]:
    """Fields of a camera.

    Raises DermisError for matrices that are none of a pinhole camera.
    """
    k, rotation, moved = _array("K", K, (3, 3)), _array("R", R, (3, 3)), _array("t", t, (3,))
    _check_intrinsics(k)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > _ROUNDING or np.linalg.det(rotation) < 0:
        came = f"R R^T is not 1, or its determinant is {np.linalg.det(rotation):.3g}"
        refuse("R", "a rotation matrix", came, "Make one of a vector with cv2.Rodrigues")
    width, height = _sides(size)
    fx, fy, cx, cy = k[0, 0], k[1, 1], k[0, 2], k[1, 2]
    position = -rotation.T @ moved
    before = moved[2] if moved[2] > _LEAST_MM else max(float(np.linalg.norm(moved)), _LEAST_MM)
    return {
        "position": position,
        "target": position + before * rotation[2],
        "up": -rotation[1],
        "frame_mm": height / fy * before,
        "principal_point": ((cx + _CORNER) / width, (cy + _CORNER) / height),
        "pixel_aspect": fy / fx,
    }


def intrinsics(seen: tuple[float, tuple[float, float], float], size: tuple[int, int]) -> Doubles:
    """(3, 3) K [pixel].

    seen : tangent of half the vertical angle, principal point from the upper left corner in widths and
        heights, width of a pixel over its height
    """
    half_tangent, principal_point, pixel_aspect = seen
    size = _sides(size)
    fy = 0.5 * size[1] / half_tangent
    cx, cy = np.multiply(principal_point, size) - _CORNER
    return np.array([[fy / pixel_aspect, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def extrinsics(position: ArrayLike, target: ArrayLike, up: ArrayLike) -> tuple[Doubles, Doubles]:
    """(3, 3) R and (3,) t [mm] of a camera at a position that looks at a target."""
    forward = _unit(np.subtract(target, position))
    right = _unit(np.cross(forward, np.asarray(up, np.float64)))
    rotation = np.array([right, np.cross(forward, right), forward])
    return rotation, -rotation @ np.asarray(position, np.float64)


def _check_intrinsics(k: Doubles) -> None:
    if k[0, 0] <= 0 or k[1, 1] <= 0 or np.abs(k[2] - (0, 0, 1)).max() > _ROUNDING:
        came = f"its diagonal is {np.diag(k).tolist()} and its last row {k[2].tolist()}"
        remedy = "Pass [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
        refuse("K", "fx, fy above 0 and a last row of 0, 0, 1", came, remedy)
    if abs(k[0, 1]) > _ROUNDING * k[0, 0] or abs(k[1, 0]) > _ROUNDING * k[0, 0]:
        came, remedy = f"its skew is {k[0, 1]:.4g} pixels", "Resample the picture to upright pixels"
        refuse("K", "pixels with right angles", came, remedy)


def _array(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Doubles:
    try:
        found = np.asarray(values, np.float64)
    except (TypeError, ValueError, OverflowError):
        refuse(name, f"numbers of shape {shape}", f"{shown_value(values, 40)} came", "Correct it")
    if shape == (3,) and found.shape in ((3, 1), (1, 3)):  # as OpenCV returns them
        found = found.reshape(3)
    if found.shape != shape or not (np.abs(found) <= _LARGEST).all():
        came = f"shape {found.shape} came" if found.shape != shape else "others came"
        refuse(name, f"numbers of shape {shape} up to {_LARGEST:g}", came, "Correct it")
    return found


def _sides(size: tuple[int, int]) -> tuple[int, int]:
    width, height = numbers("size", size, (2,), 1, _MOST_PIXELS, "pixels").tolist()
    return int(width), int(height)


def _unit(vector: NDArray[Any]) -> Doubles:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)
