"""Eyeballs of realistic shape in a head, given by control points."""

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
    """The eyeballs of a head: balls with a cornea, see mesh/eyeball.py.

    apex, back, side : (k,) control points of each eyeball: apex of the cornea, the point opposite to it, and
        the point of the equator towards +X when the head looks along +Z
    material : (k,) index of the material
    look : appearance of both eyes
    radius_mm : (k,) radius of the ball, relative to an eye with a cornea of adult size
    centre_offset_mm : (k,) position of the ball's centre on the axis, 0 for a ball of adult size
    gaze : (k, 3) direction of gaze in the eye's own coordinates: the axis, or another one that the lids
        suggest
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
        """Return the matrices (k, 4, 4) from the head's coordinates [mm] to those of each eye.

        An eye's coordinates are in mm of an eye with a cornea of adult size, with z along its axis. The
        cornea is at the same position in all of them, whatever the size of the ball.
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
        """Return the eyes with another appearance."""
        return replace(self, look=look)
