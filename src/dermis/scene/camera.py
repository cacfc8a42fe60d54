"""Pinhole cameras; places are in mm from the head's centre, +X to the head's left, +Z to its front."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from dermis.base.errors import refuse
from dermis.mesh.head import Head
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import Direction, FrozenModel, Vector
from dermis.scene.opencv import OpenCvCamera, extrinsics, from_opencv, intrinsics

_DISTANCE_MM = 1100.0  # a portrait lens' distance: closer makes noses large


_Fraction = Annotated[float, Field(ge=-10, le=10), BoundsReason("lenses do not shift farther")]


class Window(NamedTuple):
    """What a picture shows of a plane at distance 1 before the eye.

    Its x, from -1 at the left to 1, and its y, from -1 at the bottom to 1, are (x + shift) half there.
    """

    half: tuple[float, float]
    shift: tuple[float, float]


class Camera(FrozenModel):
    """Where the picture is taken from."""

    synonyms: ClassVar[Mapping[str, str]] = {
        "eye": "position",
        "location": "position",
        "look_at": "target",
        "field_of_view": "frame_mm (height of what is shown at the target)",
        "fov": "frame_mm (height of what is shown at the target)",
    }

    position: Vector = Field(kw_only=False)
    """Place of the eye [mm]."""
    target: Vector = (0.0, 0.0, 0.0)
    """The point on the optical axis that is looked at: as a rule the middle of the picture [mm]."""
    up: Direction = (0.0, 1.0, 0.0)
    """The direction that is upwards in the picture."""
    frame_mm: Annotated[float, Field(ge=0.01, le=1e5), BoundsReason("mm: from a pore's wall to a crowd")] = (
        340.0
    )
    """Height of what the picture shows at the target's distance [mm]."""
    principal_point: tuple[_Fraction, _Fraction] = (0.5, 0.5)
    """Where the optical axis meets the picture, from its upper left corner, in widths and heights of it."""
    pixel_aspect: Annotated[
        float, Field(ge=0.1, le=10), BoundsReason("sensors' pixels are nearly square")
    ] = 1.0
    """Width of a pixel over its height."""

    @model_validator(mode="after")
    def _check_view(self) -> Camera:
        view = np.subtract(self.target, self.position)
        if np.linalg.norm(np.cross(view, self.up)) < 1e-6 * np.linalg.norm(self.up):
            raise ValueError("a position away from the target, and not along up from it")
        return self

    @classmethod
    def from_opencv(cls, K: ArrayLike, R: ArrayLike, t: ArrayLike, size: tuple[int, int]) -> Camera:
        """The camera of a calibration by OpenCV, for pictures of a size; see `to_opencv`.

        Lens distortion is not in these: undistort pictures first.

        Raises DermisError for a K with skew, an R that is no rotation, and numbers of another shape.
        """
        return cls(**from_opencv(K, R, t, size))

    def to_opencv(self, size: tuple[int, int]) -> OpenCvCamera:
        """K, R and t as OpenCV has them: X_cam = R X + t, x to the right, y down, z forward.

        size : width and height of the picture [pixel]

        X and t are in mm, X from the head's centre, as all places of a scene. The middles of pixels have
        whole coordinates: the upper left one is at (0, 0), the corner of the picture at (-0.5, -0.5).
        """
        lens = self.half_tangent, self.principal_point, self.pixel_aspect
        return OpenCvCamera(intrinsics(lens, size), *extrinsics(self.position, self.target, self.up))

    @property
    def half_tangent(self) -> float:
        """Tangent of half the vertical angle of view, were the axis in the middle."""
        return 0.5 * self.frame_mm / math.dist(self.position, self.target)

    def window(self, aspect: float) -> Window:
        """What a picture of this width over height shows."""
        u, v = self.principal_point
        half = self.half_tangent
        return Window((half * aspect * self.pixel_aspect, half), (1.0 - 2.0 * u, 2.0 * v - 1.0))


def portrait(head: Head) -> Camera:
    """Head and shoulders from the front."""
    return _camera_at_azimuth(head, 0.0)


def three_quarter(head: Head) -> Camera:
    """From the head's left front."""
    return _camera_at_azimuth(head, 40.0)


def side(head: Head) -> Camera:
    """From the head's left side."""
    return _camera_at_azimuth(head, 90.0)


def cheek(head: Head) -> Camera:
    """Close to the left cheek, which the studio's key light rakes: pores show."""
    focus = head.frontmost(40.0, -35.0)
    view_direction = _azimuth_direction(58.0)
    return Camera(position=_offset_point(focus, view_direction, 300.0), target=focus, frame_mm=48.0)


def ear(head: Head) -> Camera:
    """Close to the left ear."""
    p = head.mesh.positions - np.array(head.centre_mm, dtype=np.float32)
    near_ear = p[(np.abs(p[:, 1] + 10.0) < 40.0) & (np.abs(p[:, 2]) < 60.0)]
    x, y, z = (near_ear if len(near_ear) else p)[np.argmax((near_ear if len(near_ear) else p)[:, 0])]
    focus = float(x), float(y), float(z)
    return Camera(
        position=_offset_point(focus, _azimuth_direction(75.0), 600.0), target=focus, frame_mm=120.0
    )


PRESETS = {
    "portrait": portrait,
    "three-quarter": three_quarter,
    "profile": side,
    "ear": ear,
    "cheek": cheek,
}


def preset(name: str, head: Head) -> Camera:
    """The camera preset of that name.

    Raises DermisError for a name that is none of `PRESETS`.
    """
    if name not in PRESETS:
        refuse(
            f"camera {name}", f"one of {', '.join(PRESETS)} or a TOML file", "it is neither", "Check the name"
        )
    return PRESETS[name](head)


def _camera_at_azimuth(head: Head, degrees: float) -> Camera:
    middle = (0.0, -25.0, 0.0)
    return Camera(position=_offset_point(middle, _azimuth_direction(degrees), _DISTANCE_MM), target=middle)


def _azimuth_direction(degrees: float) -> Vector:
    return (math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees)))


def _offset_point(point: Vector, direction: Vector, length: float) -> Vector:
    x, y, z = (p + length * d for p, d in zip(point, direction, strict=True))
    return (x, y, z)
