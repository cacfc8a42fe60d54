"""Pinhole cameras. Positions are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from dermis.base.errors import refuse
from dermis.mesh.head import Head
from dermis.scene.field_errors import Reason
from dermis.scene.frozen_model import Direction, FrozenModel, Vector
from dermis.scene.opencv import OpenCvCamera, extrinsics, from_opencv, intrinsics

_DISTANCE_MM = 1100.0  # of portrait photography; from a shorter distance the nose looks large


_Fraction = Annotated[float, Field(ge=-10, le=10), Reason("lenses do not shift farther")]


class Window(NamedTuple):
    """Image rectangle of a camera, in the plane at distance 1 in front of it.

    The picture coordinates (x, y), each from -1 at the left or bottom to 1 at the right or top, correspond to
    the point ((x + shift[0]) half[0], (y + shift[1]) half[1]) of this plane.

    half : half width and half height of the rectangle
    shift : offset of the rectangle from the optical axis, in units of `half`
    """

    half: tuple[float, float]
    shift: tuple[float, float]


class Camera(FrozenModel):
    """Pinhole camera at a position, which looks at a target.

    Examples
    --------
    >>> import dermis
    >>> camera = dermis.Camera(position=(0, 0, 1100), frame_mm=340)
    >>> round(float(camera.to_opencv((512, 512)).K[1, 1]), 1)
    1656.5
    """

    synonyms: ClassVar[Mapping[str, str]] = {
        "eye": "position",
        "location": "position",
        "look_at": "target",
        "field_of_view": "frame_mm (height of the picture at the target)",
        "fov": "frame_mm (height of the picture at the target)",
    }

    position: Vector = Field(kw_only=False)
    """Position of the camera [mm]."""
    target: Vector = (0.0, 0.0, 0.0)
    """Point on the optical axis, normally in the middle of the picture [mm]."""
    up: Direction = (0.0, 1.0, 0.0)
    """Direction that is up in the picture."""
    frame_mm: Annotated[float, Field(ge=0.01, le=1e5), Reason("mm: from a part of a pore to a crowd")] = 340.0
    """Height of the picture in the plane of the target [mm]."""
    principal_point: tuple[_Fraction, _Fraction] = (0.5, 0.5)
    """Point of the picture on the optical axis, as fractions of width and height from the upper left
    corner."""
    pixel_aspect: Annotated[float, Field(ge=0.1, le=10), Reason("pixels of sensors are nearly square")] = 1.0
    """Width of a pixel divided by its height."""

    @model_validator(mode="after")
    def _check_view(self) -> Camera:
        view = np.subtract(self.target, self.position)
        if np.linalg.norm(np.cross(view, self.up)) < 1e-6 * np.linalg.norm(self.up):
            raise ValueError("a position away from the target, and a view that is not parallel to up")
        return self

    @classmethod
    def from_opencv(cls, K: ArrayLike, R: ArrayLike, t: ArrayLike, size: tuple[int, int]) -> Camera:
        """Return the camera of an OpenCV calibration without lens distortion.

        A calibration with distortion is valid for undistorted pictures.

        Parameters
        ----------
        K : (3, 3) array_like
            Intrinsic matrix [pixel].
        R : (3, 3) array_like
            Rotation from the scene to the camera.
        t : (3,) array_like
            Translation [mm].
        size : (int, int)
            Width and height of the picture [pixel].

        Returns
        -------
        Camera
            Camera for pictures of this size; `to_opencv` is the inverse.

        Raises
        ------
        DermisError
            For a K with skew, an R that is not a rotation, and arrays of another shape.
        """
        return cls(**from_opencv(K, R, t, size))

    def to_opencv(self, size: tuple[int, int]) -> OpenCvCamera:
        """Return K, R and t of OpenCV: X_cam = R X + t, x to the right, y down, z forward.

        X is in mm from the head's centre, like all positions of a scene. Pixel centres have integer
        coordinates: the upper left pixel is at (0, 0), the corner of the picture at (-0.5, -0.5).

        Parameters
        ----------
        size : (int, int)
            Width and height of the picture [pixel].

        Returns
        -------
        OpenCvCamera
            Arrays K (3, 3) [pixel], R (3, 3) and t (3,) [mm].
        """
        lens = self.half_tangent, self.principal_point, self.pixel_aspect
        return OpenCvCamera(intrinsics(lens, size), *extrinsics(self.position, self.target, self.up))

    @property
    def half_tangent(self) -> float:
        """Return the tangent of half the vertical angle of view of a camera without lens shift."""
        return 0.5 * self.frame_mm / math.dist(self.position, self.target)

    def window(self, aspect: float) -> Window:
        """Return the image rectangle at distance 1, from which projection and view rays are computed.

        aspect : width of the picture divided by its height
        """
        u, v = self.principal_point
        half = self.half_tangent
        return Window((half * aspect * self.pixel_aspect, half), (1.0 - 2.0 * u, 2.0 * v - 1.0))


def portrait(head: Head) -> Camera:
    """Return a camera that shows head and shoulders from the front.

    Parameters
    ----------
    head : Head
        Not used; all camera presets are functions of the head.

    Returns
    -------
    Camera
        Camera at a distance of 1.1 m.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> dermis.portrait(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())).position
    (0.0, -25.0, 1100.0)
    """
    return _camera_at_azimuth(0.0)


def three_quarter(head: Head) -> Camera:
    """Return a camera 40 degrees to the left of the face, as seen by the head.

    Parameters
    ----------
    head : Head
        Not used; all camera presets are functions of the head.

    Returns
    -------
    Camera
        Camera at a distance of 1.1 m.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> camera = dermis.three_quarter(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps()))
    >>> round(camera.position[0])
    707
    """
    return _camera_at_azimuth(40.0)


def side(head: Head) -> Camera:
    """Return a camera on the left side of the head, for a view in profile.

    Parameters
    ----------
    head : Head
        Not used; all camera presets are functions of the head.

    Returns
    -------
    Camera
        Camera at a distance of 1.1 m.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> round(dermis.side(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())).position[0])
    1100
    """
    return _camera_at_azimuth(90.0)


def cheek(head: Head) -> Camera:
    """Return a camera for a close-up of the left cheek, where the studio's key light grazes pores."""
    focus = head.frontmost(40.0, -35.0)
    view_direction = _azimuth_direction(58.0)
    return Camera(position=_offset_point(focus, view_direction, 300.0), target=focus, frame_mm=48.0)


def ear(head: Head) -> Camera:
    """Return a camera for a close-up of the left ear."""
    p = head.mesh.positions - np.array(head.centre_mm, dtype=np.float32)
    near_ear = p[(np.abs(p[:, 1] + 10.0) < 40.0) & (np.abs(p[:, 2]) < 60.0)]
    x, y, z = (near_ear if len(near_ear) else p)[np.argmax((near_ear if len(near_ear) else p)[:, 0])]
    focus = float(x), float(y), float(z)
    position = _offset_point(focus, _azimuth_direction(75.0), 600.0)
    return Camera(position=position, target=focus, frame_mm=120.0)


CAMERA_PRESETS = {
    "portrait": portrait,
    "three-quarter": three_quarter,
    "profile": side,
    "ear": ear,
    "cheek": cheek,
}


def camera_preset(name: str, head: Head) -> Camera:
    """Return the camera of a preset, placed for a head.

    Raises DermisError for a name that is not in `CAMERA_PRESETS`.
    """
    if name not in CAMERA_PRESETS:
        expected = f"one of {', '.join(CAMERA_PRESETS)} or a TOML file"
        refuse(f"camera {name}", expected, "it is neither", "Check the name")
    return CAMERA_PRESETS[name](head)


def _camera_at_azimuth(degrees: float) -> Camera:
    middle = (0.0, -25.0, 0.0)
    return Camera(position=_offset_point(middle, _azimuth_direction(degrees), _DISTANCE_MM), target=middle)


def _azimuth_direction(degrees: float) -> Vector:
    return (math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees)))


def _offset_point(point: Vector, direction: Vector, length: float) -> Vector:
    x, y, z = (p + length * d for p, d in zip(point, direction, strict=True))
    return (x, y, z)
