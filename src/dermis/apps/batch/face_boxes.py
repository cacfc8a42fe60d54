"""Boxes around face and head in a picture, whether or not hair or other surfaces hide them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.cameras import extreme_point_indices, face_hull_indices
from dermis.apps.batch.sensor.lens import Lens
from dermis.base.arrays import Doubles
from dermis.human.hair.density import height_above_hairline
from dermis.human.labels.fields import HUMAN_FIELD_CLASSES, label_fields
from dermis.human.regions.average import average_head, is_human
from dermis.mesh.head import Head
from dermis.mesh.rig import PoseArrays
from dermis.scene.opencv import OpenCvCamera

BOX_NAMES = "face", "head", "detector"
"""Names of the boxes of an image, see `face_boxes`."""
_DIRECTION_COUNT = 256
_MIN_FACE_Z_MM = -58.0  # just in front of the ears, on the average human
# Side and downward shift of BlazeFace's boxes, divided by the longer side of the box "face": means over 200
# near-frontal people.
_DETECTOR_SCALE, _DETECTOR_SHIFT = 0.8, 0.077
_NON_FACE_CLASSES = "right_ear", "left_ear", "mouth_interior", "neck", "torso"
_NON_HEAD_CLASSES = "mouth_interior", "neck", "torso"

Box = tuple[float, float, float, float]
"""Left, upper, right and lower edge, in the pixel coordinates of landmarks."""
BoxPoints = Mapping[str, NDArray[np.int32]]
"""Indices of the control points that bound the face and the head, by name of the box."""


def box_points(head: Head) -> BoxPoints:
    """Return the indices of the control points of a head that bound its face and the whole head."""
    if is_human(head):
        return _human_box_points()
    face = face_hull_indices(head, _DIRECTION_COUNT)
    heights = head.control_rig.positions_mm[:, 1]
    above = np.flatnonzero(heights >= heights[face].min())
    return {
        "face": face,
        "head": extreme_point_indices(head.control_rig.positions_mm, above, _DIRECTION_COUNT),
    }


def face_boxes(
    head: Head, points: BoxPoints, pose_arrays: PoseArrays, camera: OpenCvCamera, lens: Lens | None = None
) -> dict[str, Box]:
    """Return boxes by name [pixel]; boxes can extend beyond the picture.

    "face" contains the forehead below the hairline, cheeks and chin, without ears, as in the annotations of
    WIDER FACE; "head" contains the whole head above the neck with its ears, without hair; "detector" is the
    square from the brows to the chin that detectors such as BlazeFace return.

    points : points that bound face and head, from `box_points`
    pose_arrays : pose of the head
    lens : lens of the camera; None for a pinhole. Points that it cannot image are ignored
    """
    boxes = {
        name: _projected_box(head, indices, pose_arrays, camera, lens) for name, indices in points.items()
    }
    left, top, right, bottom = boxes["face"]
    longer = max(right - left, bottom - top)
    x, y, half = 0.5 * (left + right), 0.5 * (top + bottom), 0.5 * _DETECTOR_SCALE * longer
    y += _DETECTOR_SHIFT * longer
    return boxes | {"detector": (x - half, y - half, x + half, y + half)}


def _projected_box(
    head: Head,
    point_indices: NDArray[np.int32],
    pose_arrays: PoseArrays,
    camera: OpenCvCamera,
    lens: Lens | None,
) -> Box:
    points: Doubles = head.control_rig.pose_points(point_indices, pose_arrays) - np.array(head.centre_mm)
    projected = (points @ camera.R.T + camera.t) @ camera.K.T
    pixels = projected[:, :2] / np.maximum(projected[:, 2:], 1e-3)
    if lens is not None:
        pixels = lens.distort_pixels(pixels, camera.K)
        pixels = pixels[np.isfinite(pixels).all(axis=1)]
        if not len(pixels):
            return np.nan, np.nan, np.nan, np.nan
    (left, top), (right, bottom) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    return left, top, right, bottom


@cache
def _human_box_points() -> BoxPoints:
    head = average_head()
    positions = head.positions_mm.astype(np.float64)
    skin = np.zeros(len(positions), bool)
    skin[np.unique(head.mesh.point[head.mesh.triangles[head.mesh.material == 0]])] = True
    inside = dict(zip(HUMAN_FIELD_CLASSES, label_fields() > 0, strict=True))
    face, whole = (
        skin & ~np.any([inside[name] for name in names], axis=0)
        for names in (_NON_FACE_CLASSES, _NON_HEAD_CLASSES)
    )
    face &= (height_above_hairline(positions) < 0) & (positions[:, 2] > _MIN_FACE_Z_MM)
    return {
        name: extreme_point_indices(positions, np.flatnonzero(mask), _DIRECTION_COUNT)
        for name, mask in (("face", face), ("head", whole))
    }
