"""Eyeballs of a head: their control points, shapes and appearance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dermis.base.arrays import Doubles, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import SCLERA_MM, apex_mm
from dermis.mesh.rig import PoseArrays, Rig


@dataclass(frozen=True, repr=False)
class Eyes(ShortRepr):
    """The k eyeballs of a head: spheres with a cornea, see mesh/eyeball.py.

    apex, back : (k,) indices of two control points of each eyeball: the apex of the cornea, and the point
        opposite to it
    side : (k,) index of the control point on each eyeball's equator, on the side of +X when the head looks
        along +Z
    material : (k,) index of the material of each eyeball
    look : appearance of both eyes
    radius_mm : (k,) radius of the ball when the eye is scaled to a cornea of adult size [mm]
    centre_offset_mm : (k,) shift of the ball's centre along the axis, from its position in an adult eye [mm]
    gaze : (k, 3) unit direction of gaze in eye coordinates: the axis of the eye (0, 0, 1); for eyes of a file
        without corneas, whose axes follow from the lids, the direction straight ahead
    """

    apex: Ints
    back: Ints
    side: Ints
    material: Ints
    look: EyeLook
    radius_mm: Doubles = field(default_factory=lambda: np.full(2, SCLERA_MM))
    centre_offset_mm: Doubles = field(default_factory=lambda: np.zeros(2))
    gaze: Doubles = field(default_factory=lambda: np.tile([0.0, 0.0, 1.0], (2, 1)))

    def eye_matrices(self, rig: Rig, pose_arrays: PoseArrays) -> Doubles:
        """Return the matrices (k, 4, 4) from head coordinates [mm] to the coordinates of each eye.

        Eye coordinates are scaled to an eye with a cornea of adult size [mm], with z along the axis of the
        eye. The position of the cornea in eye coordinates does not depend on the size of the ball.
        """
        count = len(self.apex)
        points = rig.pose_points(np.concatenate([self.apex, self.back, self.side]), pose_arrays)
        apex, back, side = points.reshape(3, count, 3)
        length = np.linalg.norm(apex - back, axis=1, keepdims=True)
        behind = (self.radius_mm - self.centre_offset_mm)[:, None]
        axis, scale = (apex - back) / length, (apex_mm() + behind) / length
        centre = back + axis * behind / scale
        across = side - centre
        across -= (across * axis).sum(axis=1, keepdims=True) * axis
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        rotation = np.stack([across, np.cross(axis, across), axis], axis=1) * scale[:, :, None]
        frames = np.zeros((count, 4, 4))
        frames[:, :3, :3], frames[:, 3, 3] = rotation, 1.0
        frames[:, :3, 3] = -np.einsum("kij,kj->ki", rotation, centre)
        return frames

    def with_look(self, look: EyeLook) -> Eyes:
        """Return these eyes with another appearance."""
        return replace(self, look=look)
