"""Pinhole cameras. Positions are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.renamed import renamed_attribute
from dermis.mesh.head import Head
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import Direction, FrozenModel, Vector
from dermis.scene.opencv import OpenCvCamera, camera_fields, extrinsics, intrinsics

_DEFAULT_DISTANCE_MM = 1100.0  # as in portrait photography; from closer, the nose looks large
_MIN_DISTANCE_PER_MESH_SIZE = 3.0  # least distance relative to the size of a mesh that is shown completely
_FRAME_SIZE_PER_MESH_SIZE = 1.08  # size of the frame relative to a mesh that is shown completely
_TARGET_HEIGHT_MM, _MARGIN_ABOVE_HEADWEAR_MM = -25.0, 12.0  # relative to the centre of the head
_WORLD_UP = (0.0, 1.0, 0.0)
# Preset "headshot": from the front left and slightly above, with free space on the side where the face looks
_HEADSHOT_AZIMUTH_DEGREES, _HEADSHOT_ELEVATION_DEGREES, _HEADSHOT_FRAME_MM = 26.0, 3.0, 208.0
_HEADSHOT_DISTANCE_MM, _HEADSHOT_TARGET_MM = 1500.0, (-13.0, -10.0, 14.0)


_PictureFraction = Annotated[float, Field(ge=-10, le=10), BoundsReason("lenses do not shift farther")]


class ImageRectangle(NamedTuple):
    """Image rectangle of a camera, in the plane at distance 1 in front of the camera.

    The picture coordinates (x, y), each from -1 at the left or bottom to 1 at the right or top, correspond to
    the point ((x + shift[0]) half[0], (y + shift[1]) half[1]) in this plane.

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
    frame_mm: Annotated[
        float, Field(ge=0.01, le=1e5), BoundsReason("mm: from a part of a pore to a crowd")
    ] = 340.0
    """Height of the picture in the plane of the target [mm]."""
    principal_point: tuple[_PictureFraction, _PictureFraction] = (0.5, 0.5)
    """Point of the picture on the optical axis, as fractions of width and height from the upper left
    corner."""
    pixel_aspect: Annotated[
        float, Field(ge=0.1, le=10), BoundsReason("pixels of sensors are nearly square")
    ] = 1.0
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

        For a calibration with lens distortion, the camera matches the undistorted pictures.

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
            For a K with skew, an R that is not a rotation, and arrays with another shape.
        """
        return cls(**camera_fields(K, R, t, size))

    def to_opencv(self, size: tuple[int, int]) -> OpenCvCamera:
        """Return K, R and t of OpenCV: X_cam = R X + t, x to the right, y down, z forward.

        X is a position relative to the head's centre [mm], like all positions in a scene. Pixel centres have
        integer coordinates: the upper left pixel is at (0, 0), the corner of the picture at (-0.5, -0.5).

        Parameters
        ----------
        size : (int, int)
            Width and height of the picture [pixel].

        Returns
        -------
        OpenCvCamera
            Arrays K (3, 3) [pixel], R (3, 3) and t (3,) [mm].
        """
        lens = self.half_view_tangent, self.principal_point, self.pixel_aspect
        return OpenCvCamera(intrinsics(lens, size), *extrinsics(self.position, self.target, self.up))

    @property
    def half_view_tangent(self) -> float:
        """Return the tangent of half the vertical angle of view, ignoring any lens shift."""
        return 0.5 * self.frame_mm / math.dist(self.position, self.target)

    half_tangent = renamed_attribute("half_tangent", "half_view_tangent")

    def image_rectangle(self, aspect: float) -> ImageRectangle:
        """Return the image rectangle in the plane at distance 1 in front of the camera.

        aspect : width of the picture divided by its height
        """
        u, v = self.principal_point
        half = self.half_view_tangent
        return ImageRectangle((half * aspect * self.pixel_aspect, half), (1.0 - 2.0 * u, 2.0 * v - 1.0))


def portrait(head: Head) -> Camera:
    """Return a camera that shows head and shoulders from the front, and high headwear completely.

    Parameters
    ----------
    head : Head
        The head. If the mesh has no head, for example a hand, the camera shows the whole mesh.

    Returns
    -------
    Camera
        Camera 1.1 m from the head, or farther from a large mesh without a head.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> dermis.portrait(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())).position
    (0.0, -25.0, 1100.0)
    """
    return _camera_at_azimuth(head, 0.0)


def three_quarter(head: Head) -> Camera:
    """Return a camera for a three-quarter view, 40 degrees from the front towards the head's left.

    Parameters
    ----------
    head : Head
        The head. If the mesh has no head, for example a hand, the camera shows the whole mesh.

    Returns
    -------
    Camera
        Camera 1.1 m from the head, or farther from a large mesh without a head.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> camera = dermis.three_quarter(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps()))
    >>> round(camera.position[0])
    707
    """
    return _camera_at_azimuth(head, 40.0)


def headshot(head: Head) -> Camera:
    """Return a camera for a close portrait of the face, 26 degrees from the front towards the head's left.

    The picture ends at the forehead and below the chin. Shoulders and long hair are outside it.

    Parameters
    ----------
    head : Head
        The head. If the mesh has no head, for example a hand, the camera shows the whole mesh.

    Returns
    -------
    Camera
        Camera 1.5 m from the head, or farther from a large mesh without a head.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> dermis.headshot(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())).frame_mm
    208.0
    """
    if head.skull_centre_mm is None:
        return _camera_showing_all(head, _HEADSHOT_AZIMUTH_DEGREES)
    elevation = math.radians(_HEADSHOT_ELEVATION_DEGREES)
    x, _, z = _direction_at_azimuth(_HEADSHOT_AZIMUTH_DEGREES)
    towards = (math.cos(elevation) * x, math.sin(elevation), math.cos(elevation) * z)
    return Camera(
        position=_offset_point(_HEADSHOT_TARGET_MM, towards, _HEADSHOT_DISTANCE_MM),
        target=_HEADSHOT_TARGET_MM,
        frame_mm=_HEADSHOT_FRAME_MM,
    )


def side(head: Head) -> Camera:
    """Return a camera on the left side of the head, for a view in profile.

    Parameters
    ----------
    head : Head
        The head. If the mesh has no head, for example a hand, the camera shows the whole mesh.

    Returns
    -------
    Camera
        Camera 1.1 m from the head, or farther from a large mesh without a head.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> round(dermis.side(dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())).position[0])
    1100
    """
    return _camera_at_azimuth(head, 90.0)


def full_body(head: Head) -> Camera:
    """Return a camera that shows the whole mesh of a head from the front, including any body.

    Parameters
    ----------
    head : Head
        The head, whose mesh may include a body.

    Returns
    -------
    Camera
        Camera 1.1 m from the centre of the mesh, or three times the mesh's size if this is farther.

    Examples
    --------
    >>> import dermis
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> camera = dermis.full_body(dermis.Head("ball", uv_sphere(450.0, 8, 4), Maps()))
    >>> round(camera.position[2]), round(camera.frame_mm)
    (2700, 972)
    """
    return _camera_showing_all(head, 0.0)


def cheek(head: Head) -> Camera:
    """Return a camera for a close-up of the left cheek.

    The key light of the light preset "studio" meets the skin there at grazing incidence.
    """
    beside = (40.0, -35.0) if head.skull_centre_mm is not None else (0.0, 0.0)
    focus = _to_scene_axes(head, head.frontmost_point_mm(*beside))
    view_direction = _to_scene_axes(head, _direction_at_azimuth(58.0))
    position = _offset_point(focus, view_direction, 300.0)
    return Camera(position=position, target=focus, up=_to_scene_axes(head, _WORLD_UP), frame_mm=48.0)


def ear(head: Head) -> Camera:
    """Return a camera for a close-up of the left ear."""
    p = head.front_view_positions_mm
    near_ear = p[(np.abs(p[:, 1] + 10.0) < 40.0) & (np.abs(p[:, 2]) < 60.0)]
    x, y, z = (near_ear if len(near_ear) else p)[np.argmax((near_ear if len(near_ear) else p)[:, 0])]
    focus = _to_scene_axes(head, (float(x), float(y), float(z)))
    position = _offset_point(focus, _to_scene_axes(head, _direction_at_azimuth(75.0)), 600.0)
    return Camera(position=position, target=focus, up=_to_scene_axes(head, _WORLD_UP), frame_mm=120.0)


CAMERA_PRESETS = {
    "portrait": portrait,
    "three-quarter": three_quarter,
    "profile": side,
    "ear": ear,
    "cheek": cheek,
    "full_body": full_body,
    "headshot": headshot,
}
"""Functions of the head that return a camera, by name; hyphens and underscores are interchangeable."""


def camera_preset(preset_name: str, head: Head) -> Camera:
    """Return the camera that a preset places for a head.

    Raises DermisError for a name that is not in `CAMERA_PRESETS`.
    """
    preset = find_camera_preset(preset_name)
    if preset is None:
        expected = f"one of {', '.join(CAMERA_PRESETS)} or a TOML file"
        refuse(f"camera {preset_name}", expected, "it is neither", "Check the name")
    return preset(head)


def find_camera_preset(preset_name: str) -> Callable[[Head], Camera] | None:
    """Return the function of a camera preset, or None for a name that is not a preset."""
    by_name = {key.replace("-", "_"): preset for key, preset in CAMERA_PRESETS.items()}
    return by_name.get(preset_name.replace("-", "_"))


def _camera_at_azimuth(head: Head, azimuth_degrees: float) -> Camera:
    if head.skull_centre_mm is None:
        return _camera_showing_all(head, azimuth_degrees)
    frame_mm, extension_mm = Camera.model_fields["frame_mm"].default, 0.0
    if head.undressed is not None:  # the frame is extended upwards for high headwear
        top_mm = float(head.mesh.positions[:, 1].max()) - head.centre_mm[1] + _MARGIN_ABOVE_HEADWEAR_MM
        extension_mm = max(top_mm - (_TARGET_HEIGHT_MM + 0.5 * frame_mm), 0.0)
    middle = (0.0, _TARGET_HEIGHT_MM + 0.5 * extension_mm, 0.0)
    return Camera(
        position=_offset_point(middle, _direction_at_azimuth(azimuth_degrees), _DEFAULT_DISTANCE_MM),
        target=middle,
        frame_mm=frame_mm + extension_mm,
    )


def _camera_showing_all(head: Head, azimuth_degrees: float) -> Camera:
    """Return a camera that shows the whole mesh of a head, with a margin.

    azimuth_degrees : azimuth of the camera: 0 in front of the head, 90 at its left side [degrees]
    """
    x, _, z = _direction_at_azimuth(azimuth_degrees)
    # rows: to the right, up and towards the camera
    axes = np.array([[z, 0.0, -x], [0.0, 1.0, 0.0], [x, 0.0, z]]) @ head.front_view_axes
    points = (head.mesh.outline.points_mm - np.array(head.centre_mm)) @ axes.T
    low, high = points.min(axis=0), points.max(axis=0)
    middle, distance = (
        0.5 * (low + high),
        max(_DEFAULT_DISTANCE_MM, _MIN_DISTANCE_PER_MESH_SIZE * float((high - low).max())),
    )
    across, towards = np.abs(points - middle)[:, :2].max(axis=1), (points - middle)[:, 2]
    frame_mm = 2.0 * _FRAME_SIZE_PER_MESH_SIZE * float((across / (1.0 - towards / distance)).max())
    target, position = (
        _vector_tuple(np.round((middle + np.array([0, 0, far])) @ axes, 3)) for far in (0.0, distance)
    )
    return Camera(position=position, target=target, up=_vector_tuple(axes[1]), frame_mm=round(frame_mm, 3))


def _to_scene_axes(head: Head, vector: Vector) -> Vector:
    """Convert a vector from the axes of a head (left, up, front) to the axes of the scene."""
    return _vector_tuple(np.array(vector) @ head.front_view_axes)


def _vector_tuple(vector: Doubles) -> Vector:
    x, y, z = (float(one) + 0.0 for one in vector)
    return x, y, z


def _direction_at_azimuth(azimuth_degrees: float) -> Vector:
    return (math.sin(math.radians(azimuth_degrees)), 0.0, math.cos(math.radians(azimuth_degrees)))


def _offset_point(point: Vector, direction: Vector, length: float) -> Vector:
    x, y, z = (p + length * d for p, d in zip(point, direction, strict=True))
    return (x, y, z)
