"""Eyes behind a file's lids: the way in which they look through them, and corneas that stay behind."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.eyeball import CORNEA_MM, plane_mm
from dermis.mesh.fitted_eyes.balls import Sphere

_CELLS, _REACH = 49, 0.9
"""Rays along each side of what is looked at, and how many radii it reaches from the axis."""
_COLUMN = 0.25  # radii beside the axis, where the iris is
_ABOVE = 0.08  # of the opening's height: an upper lid lies on the iris, a lower one touches it
_BESIDE = 0.3  # of the rays at an end, beyond which there is no lid
_MOST = np.radians(15.0)
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
        return np.asarray(np.sqrt(np.maximum(self.ball.radius**2 - (self.places**2).sum(axis=1), 0.0)))

    @cached_property
    def height(self) -> Doubles:
        """(n,) how far before the ball's middle each ray meets anything else first, -inf for never [mm]."""
        corners = self.corners[self.corners[:, :, 2].max(axis=1) > 0]
        triangle, ray = self._meetings(corners)
        a, b, c = np.moveaxis(corners[triangle], 1, 0)
        b, c, p = b - a, c - a, self.places[ray] - a[:, :2]
        area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
        area = np.where(np.abs(area) < 1e-9, np.inf, area)
        u = (p[:, 0] * c[:, 1] - p[:, 1] * c[:, 0]) / area
        v = (b[:, 0] * p[:, 1] - b[:, 1] * p[:, 0]) / area
        far = a[:, 2] + u * b[:, 2] + v * c[:, 2]
        met = np.full(_CELLS**2, -np.inf)
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        np.maximum.at(met, ray[inside], far[inside])
        return met

    def _meetings(self, corners: Doubles) -> tuple[Index, Index]:
        """Triangles and rays, pair by pair, of which the rays lie within the triangles' bounds."""
        reach = _REACH * self.ball.radius
        cell = (corners[:, :, :2] + reach) * (_CELLS - 1) / (2 * reach)
        first = np.maximum(np.ceil(cell.min(axis=1)), 0).astype(np.int64)
        last = np.minimum(np.floor(cell.max(axis=1)), _CELLS - 1).astype(np.int64)
        size = np.maximum(last - first + 1, 0)
        count = size.prod(axis=1)
        triangle = np.repeat(np.arange(len(corners)), count)
        own = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
        row, column = np.divmod(own, size[triangle, 0])
        return triangle, (first[triangle, 1] + row) * _CELLS + first[triangle, 0] + column

    @property
    def iris(self) -> tuple[float, float]:
        """Where in the opening an iris lies that looks straight ahead, as angles across and up [rad].

        Zeros without lids on all sides. Lids show best where a file's eyes look: balls and lids of artists
        are seldom around one centre.
        """
        found = []
        for way, beside, share in ((0, 1, 0.0), (1, 0, _ABOVE)):
            column = np.abs(self.places[:, beside]) < _COLUMN * self.ball.radius
            at, seen = self.places[column, way], (self.height < self.front)[column]
            ends = np.sign(at) * (np.abs(at) > 0.99 * at.max())
            if not seen.any() or max(seen[ends == end].mean() for end in (-1, 1)) > _BESIDE:
                return 0.0, 0.0
            middle = at[seen].mean() + share * np.ptp(at[seen])
            found.append(float(np.clip(np.arcsin(middle / self.ball.radius), -_MOST, _MOST)))
        return found[0], found[1]

    def looking(self, across: float, up: float) -> Doubles:
        """(3,) unit vector by angles across and up [rad]."""
        own = np.sin(across) * np.cos(up), np.sin(up), np.cos(across) * np.cos(up)
        return np.asarray(np.array(own) @ self.axes)

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
