"""Eyeballs of true shape in a head: which of its points tell where they are and where they look."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dermis.base.arrays import Doubles, Ints
from dermis.base.summary import ShortRepr
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import SCLERA_MM, apex_mm
from dermis.mesh.rig import Motion, Rig


@dataclass(frozen=True, repr=False)
class Eyes(ShortRepr):
    """The eyeballs of a head, in their true shape: a ball with a cornea, see mesh/eyeball.py.

    apex, back, side : (k,) control points of each: the cornea's apex, the one opposite, one of the equator to
        the right of who looks out of it
    material : (k,) index of what its triangles are made of
    look : of both
    ball_mm, middle_mm : (k,) radius of each ball, and where on the axis its middle lies, in mm of a usual
        eye, whose cornea it has; 0 for the middle of one of usual size
    sight : (k, 3) the way each looks in its own space: along the axis, unless lids show it elsewhere
    """

    apex: Ints
    back: Ints
    side: Ints
    material: Ints
    look: EyeLook
    radius_mm: Doubles = field(default_factory=lambda: np.full(2, SCLERA_MM))
    centre_offset_mm: Doubles = field(default_factory=lambda: np.zeros(2))
    gaze: Doubles = field(default_factory=lambda: np.tile([0.0, 0.0, 1.0], (2, 1)))

    def frames(self, rig: Rig, motion: Motion) -> Doubles:
        """(k, 4, 4) from the head's space [mm] to each eye's own: in mm of a usual eye, z along its axis.

        The cornea lies in all spaces where a usual eye has it, whatever the size of the ball behind.
        """
        count = len(self.apex)
        points = rig.pose_points(np.concatenate([self.apex, self.back, self.side]), motion)
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
        """The same eyes of another look."""
        return replace(self, look=look)
