"""Eyes behind a file's lids: the way in which they look through them, and corneas that stay behind."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.eyes import CORNEA_MM, plane_mm
from dermis.mesh.fitted_eyes.spheres import Sphere

Doubles = NDArray[np.float64]

_CELLS, _REACH = 33, 0.66
"""Rays along each side of what is looked at, and how many radii it reaches from the axis."""
_COLUMN = 0.25  # radii beside the axis, where the iris is
_ABOVE = 0.08  # of the opening's height: an upper lid lies on the iris, a lower one touches it
_MOST_PITCH = np.radians(15.0)
_OUT_MM, _LEAST_MM = 0.3, 0.5
"""How far a cornea may stand out of a lid that lies on the ball, and does out of the ball at least."""


@dataclass(frozen=True, eq=False)
class Lids:
    """What lies before an eyeball, seen from far ahead.

    ball : the eyeball
    axes : (3, 3) rows across, up and ahead
    corners : (f, 3, 3) triangles around, from the ball's middle along the axes [mm]
    """

    ball: Sphere
    axes: Doubles
    corners: Doubles

    @cached_property
    def places(self) -> Doubles:
        """(n, 2) where the rays meet the plane through the ball's middle [mm]."""
        line = np.linspace(-_REACH, _REACH, _CELLS) * self.ball.radius
        x, y = np.meshgrid(line, line)
        return np.stack([x.ravel(), y.ravel()], axis=1)

    @cached_property
    def front(self) -> Doubles:
        """(n,) how far before the ball's middle each ray meets it [mm]."""
        return np.asarray(np.sqrt(self.ball.radius**2 - (self.places**2).sum(axis=1)))

    @cached_property
    def height(self) -> Doubles:
        """(n,) how far before the ball's middle each ray meets anything else first, -inf for never [mm]."""
        low, high = self.corners[:, :, :2].min(axis=1), self.corners[:, :, :2].max(axis=1)
        reach = _REACH * self.ball.radius
        near = ((high > -reach) & (low < reach)).all(axis=1) & (self.corners[:, :, 2].max(axis=1) > 0)
        a, b, c = np.moveaxis(self.corners[near], 1, 0)
        b, c = b - a, c - a
        area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
        area = np.where(np.abs(area) < 1e-9, np.inf, area)
        x, y = (self.places[None, :, k] - a[:, None, k] for k in (0, 1))
        u = (x * c[:, None, 1] - y * c[:, None, 0]) / area[:, None]
        v = (b[:, None, 0] * y - b[:, None, 1] * x) / area[:, None]
        far = a[:, None, 2] + u * b[:, None, 2] + v * c[:, None, 2]
        met = np.where((u >= 0) & (v >= 0) & (u + v <= 1), far, -np.inf)
        return np.asarray(met.max(axis=0, initial=-np.inf))

    @property
    def pitch(self) -> float:
        """By how much an iris is higher than straight ahead that lies in the opening as irises do [rad]."""
        column = np.abs(self.places[:, 0]) < _COLUMN * self.ball.radius
        y, seen = self.places[column, 1], (self.height < self.front)[column]
        if not seen.any() or seen[y == y.min()].any() or seen[y == y.max()].any():
            return 0.0  # without lids above and below
        middle = y[seen].mean() + _ABOVE * np.ptp(y[seen])
        return float(np.clip(np.arcsin(middle / self.ball.radius), -_MOST_PITCH, _MOST_PITCH))

    def sunk_mm(self, axis: Doubles, scale: float) -> float:
        """How far a cornea along an axis has to lie further in, to stay behind lids on the ball [mm].

        axis : (3,) unit vector along which the eye looks
        scale : size of the cornea, 1 for a usual one
        """
        own, radius = self.axes @ axis, CORNEA_MM * scale
        far = scale * (plane_mm(self.ball.radius / scale) - plane_mm(CORNEA_MM))
        off = ((self.places - far * own[:2]) ** 2).sum(axis=1)
        cornea = far * own[2] + np.sqrt(np.maximum(radius**2 - off, 0.0))
        covered = (off < radius**2) & (self.height > self.front) & (cornea > self.front)
        out = float((cornea - self.height)[covered].max(initial=0.0))
        return float(np.clip(out - _OUT_MM, 0.0, max(far + radius - self.ball.radius - _LEAST_MM, 0.0)))


def lids_before(corners_mm: Doubles, ball: Sphere, ahead: Doubles) -> Lids:
    """What lies before an eyeball that looks a way.

    corners_mm : (f, 3, 3) corners of all triangles but those of eyeballs, in the head's space
    ahead : (3,) unit vector
    """
    axes = axes_along(ahead)
    return Lids(ball, axes, (corners_mm.astype(np.float64) - ball.middle) @ axes.T)


def axes_along(axis: Doubles) -> Doubles:
    """(3, 3) rows across, up and along an axis."""
    across = np.cross((0.0, 1.0, 0.0), axis)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(axis, across), axis])
