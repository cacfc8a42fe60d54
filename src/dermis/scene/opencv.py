"""Conversion between cameras and OpenCV matrices: intrinsics, rotation and translation."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_array

Doubles = NDArray[np.float64]
# OpenCV's origin is the centre of the first pixel, not the corner of the picture [pixel]
_PIXEL_CENTRE_OFFSET = 0.5
_ROUNDING_TOLERANCE = 1e-4  # tolerance for rotations and skews that were rounded in files
_MIN_DISTANCE_MM = 1.0
_MAX_MATRIX_VALUE = 1e9
_MAX_PICTURE_SIDE = 1e6  # largest number of pixels along a side


class OpenCvCamera(NamedTuple):
    """Pinhole camera in OpenCV's convention: X_cam = R X + t, with x to the right, y down and z forward.

    The homogeneous pixel coordinates of a scene point X [mm] are K X_cam.

    K : (3, 3) intrinsic matrix [pixel]
    R : (3, 3) rotation from the scene to the camera
    t : (3,) translation [mm]
    """

    K: Doubles
    R: Doubles
    t: Doubles


def camera_fields(K: ArrayLike, R: ArrayLike, t: ArrayLike, size: tuple[int, int]) -> dict[str, Any]:
    """Return the fields of a `Camera` from OpenCV matrices.

    K : intrinsic matrix [pixel], see `OpenCvCamera`
    R : rotation from the scene to the camera
    t : translation [mm]
    size : width and height of the picture [pixel]

    Raises DermisError for matrices that do not describe a pinhole camera.
    """
    k, rotation, translation = (
        _checked_matrix("K", K, (3, 3)),
        _checked_matrix("R", R, (3, 3)),
        _checked_matrix("t", t, (3,)),
    )
    _check_intrinsics(k)
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > _ROUNDING_TOLERANCE or np.linalg.det(rotation) < 0:
        actual = f"R R^T is not 1, or its determinant is {np.linalg.det(rotation):.3g}"
        refuse("R", "a rotation matrix", actual, "Convert a rotation vector with cv2.Rodrigues")
    width, height = _checked_picture_size(size)
    fx, fy, cx, cy = k[0, 0], k[1, 1], k[0, 2], k[1, 2]
    position = -rotation.T @ translation
    distance = translation[2]
    if distance <= _MIN_DISTANCE_MM:
        distance = max(float(np.linalg.norm(translation)), _MIN_DISTANCE_MM)
    return {
        "position": position,
        "target": position + distance * rotation[2],
        "up": -rotation[1],
        "frame_mm": height / fy * distance,
        "principal_point": ((cx + _PIXEL_CENTRE_OFFSET) / width, (cy + _PIXEL_CENTRE_OFFSET) / height),
        "pixel_aspect": fy / fx,
    }


def intrinsics(lens: tuple[float, tuple[float, float], float], picture_size: tuple[int, int]) -> Doubles:
    """Return the intrinsic matrix K (3, 3) of a camera [pixel].

    lens : three values: the tangent of half the vertical angle of view; the principal point, measured from
        the upper left corner in fractions of width and height; the width of a pixel divided by its height
    picture_size : width and height of the picture [pixel]
    """
    half_view_tangent, principal_point, pixel_aspect = lens
    picture_size = _checked_picture_size(picture_size)
    fy = 0.5 * picture_size[1] / half_view_tangent
    cx, cy = np.multiply(principal_point, picture_size) - _PIXEL_CENTRE_OFFSET
    return np.array([[fy / pixel_aspect, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def extrinsics(position: ArrayLike, target: ArrayLike, up: ArrayLike) -> tuple[Doubles, Doubles]:
    """Return the rotation R (3, 3) and translation t (3,) [mm] of a camera that looks at a target.

    position, target : (3,) positions of camera and target [mm]
    up : (3,) direction in the scene that points up in the picture
    """
    forward = _normalise(np.subtract(target, position))
    right = _normalise(np.cross(forward, np.asarray(up, np.float64)))
    rotation = np.array([right, np.cross(forward, right), forward])
    return rotation, -rotation @ np.asarray(position, np.float64)


def _check_intrinsics(K: Doubles) -> None:
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[2] - (0, 0, 1)).max() > _ROUNDING_TOLERANCE:
        actual = f"its diagonal is {np.diag(K).tolist()} and its last row {K[2].tolist()}"
        advice = "Pass [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
        refuse("K", "fx, fy above 0 and a last row of 0, 0, 1", actual, advice)
    if abs(K[0, 1]) > _ROUNDING_TOLERANCE * K[0, 0] or abs(K[1, 0]) > _ROUNDING_TOLERANCE * K[0, 0]:
        actual, advice = f"its skew is {K[0, 1]:.4g} pixels", "Resample the picture to upright pixels"
        refuse("K", "pixels with right angles", actual, advice)


def _checked_matrix(matrix_name: str, matrix: ArrayLike, matrix_shape: tuple[int, ...]) -> Doubles:
    try:
        found = np.asarray(matrix, np.float64)
    except (TypeError, ValueError, OverflowError):
        refuse(
            matrix_name, f"numbers of shape {matrix_shape}", f"got {format_value(matrix, 40)}", "Correct it"
        )
    if matrix_shape == (3,) and found.shape in ((3, 1), (1, 3)):  # as OpenCV returns them
        found = found.reshape(3)
    if found.shape != matrix_shape or not (np.abs(found) <= _MAX_MATRIX_VALUE).all():
        actual = f"got shape {found.shape}" if found.shape != matrix_shape else "got larger numbers"
        refuse(
            matrix_name, f"numbers of shape {matrix_shape} up to {_MAX_MATRIX_VALUE:g}", actual, "Correct it"
        )
    return found


def _checked_picture_size(picture_size: tuple[int, int]) -> tuple[int, int]:
    width, height = checked_array("size", picture_size, (2,), 1, _MAX_PICTURE_SIDE, "pixels").tolist()
    return int(width), int(height)


def _normalise(vector: NDArray[Any]) -> Doubles:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)
