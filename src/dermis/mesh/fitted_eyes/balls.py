"""The two eyeballs of a head, among the pieces that its file calls eyes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.geometry import components, triangle_areas
from dermis.mesh.mesh import Mesh

RADIUS_MM = 8.0, 20.0
"""Radii of eyeballs: 12 in truth, and what artists make of them [mm]."""
MISS = 0.06
"""Of the radius, by which most of an eyeball lies off a sphere at most."""
_FEWEST = 20  # points
_COVERED = 0.25  # of the sphere
_BELONGS = 1.2  # radii from the middle, within which cornea, iris and pupil lie
_MEETING_MM = 1000.0  # before the eyes, where those that show no other way look
_STEPS = 12
_BULGE, _CORNEA = 0.025, 0.045
"""Of the radius: what stands out more is no roundness of the ball, and how far a cornea does at least."""
_WIDE = 0.7  # cosine of the angle from its axis within which a cornea lies
_MISSED = 0.85  # of the area, that is nearer to the sphere than its `miss`


@dataclass(frozen=True, eq=False)
class Ball:
    """An eyeball of a file.

    sphere : that of its white
    sight : (3,) unit vector along which it looks
    cornea : whether a cornea shows that; else it is straight ahead
    points : (n,) the mesh's points that it is made of
    """

    sphere: Sphere
    sight: Doubles
    cornea: bool
    points: Index


@dataclass(frozen=True, eq=False)
class _Piece:
    points: Index
    area: Doubles  # around each point [mm2]
    sphere: Sphere

    @property
    def covered(self) -> float:
        return float(self.area.sum() / (4 * np.pi * self.sphere.radius**2))

    @property
    def fault(self) -> str:
        """Why it is no eyeball; empty where it is one."""
        (low, high), (_, radius, miss) = RADIUS_MM, self.sphere
        if len(self.points) < _FEWEST:
            return f"has only {len(self.points)} points"
        if miss > MISS:
            return f"lies off the nearest ball by {miss:.0%} of its radius, where {MISS:.0%} pass"
        if not low <= radius <= high:
            return f"is a ball of {radius:.1f} mm, where {low:g} to {high:g} pass"
        return "" if self.covered >= _COVERED else f"is only {self.covered:.0%} of a ball"


def find_balls(mesh: Mesh) -> tuple[tuple[Ball, Ball] | None, str]:
    """The left and the right eyeball among what the file calls eyes, and why there are none of them.

    Nothing is said where the file calls nothing so.
    """
    called = np.flatnonzero(np.array([material.eye for material in mesh.materials])[mesh.material])
    if not len(called):
        return None, ""
    pieces = sorted(_pieces(mesh, called), key=lambda piece: -float(piece.area.sum()))
    chosen: list[_Piece] = []
    for piece in pieces:
        nested = any(_far(piece.sphere.middle, one) < 1.0 for one in chosen)
        if not piece.fault and not nested:
            chosen.append(piece)
    if len(chosen) == 2:
        left, right = sorted(chosen, key=lambda piece: -float(piece.sphere.middle[0]))
        return _looking(mesh, left, right, pieces), ""
    names = ", ".join(sorted({repr(one.name) for one in mesh.materials if one.eye}))
    count = f"{len(chosen)} ball{'s' * (len(chosen) > 1)}, where two are eyes"
    return None, f"eyes: {names} stay plain: {count if chosen else f'the largest piece {pieces[0].fault}'}"


def _pieces(mesh: Mesh, called: Index) -> list[_Piece]:
    """Connected pieces of some triangles."""
    corners = mesh.point[mesh.triangles[called]].astype(np.int64)
    points, own = np.unique(corners, return_inverse=True)
    own = own.reshape(-1, 3)
    label = components(len(points), own[:, [0, 1]].ravel(), own[:, [1, 2]].ravel())
    thirds = np.repeat(triangle_areas(mesh.positions[mesh.triangles[called]]) / 3, 3)
    area = np.bincount(own.ravel(), thirds, minlength=len(points))
    places = mesh.points_mm[points]
    found = []
    for piece in range(int(label.max()) + 1):
        inside = label == piece
        sphere = fit_sphere(places[inside], area[inside])
        found.append(_Piece(points[inside], area[inside], sphere))
    return found


def _far(places: Doubles, piece: _Piece) -> Doubles:
    """How many radii places (..., 3) lie from the middle of a ball."""
    return np.asarray(np.linalg.norm(places - piece.sphere.middle, axis=-1) / piece.sphere.radius)


def _looking(mesh: Mesh, left: _Piece, right: _Piece, pieces: list[_Piece]) -> tuple[Ball, Ball]:
    """The balls with all that lies in them, each with its own way of looking or straight ahead."""
    places = mesh.points_mm
    middle = (left.sphere.middle + right.sphere.middle) / 2
    ahead = np.cross(left.sphere.middle - right.sphere.middle, (0.0, 1.0, 0.0))
    ahead /= np.linalg.norm(ahead)
    found = []
    for ball in (left, right):
        those = [one for one in pieces if one is ball or _far(places[one.points], ball).max() < _BELONGS]
        points = np.concatenate([one.points for one in those])
        area = np.concatenate([one.area for one in those])
        shown = corneal_axis(places[points], area, ball.sphere, ahead)
        sight = middle + _MEETING_MM * ahead - ball.sphere.middle if shown is None else shown
        found.append(Ball(ball.sphere, sight / np.linalg.norm(sight), shown is not None, points))
    return found[0], found[1]


class Sphere(NamedTuple):
    """A sphere that points lie on.

    middle : (3,) [mm]
    radius : [mm]
    miss : how far most of them lie off it, as a share of the radius [-]
    """

    middle: Doubles
    radius: float
    miss: float


def fit_sphere(points: Doubles, area: Doubles) -> Sphere:
    """The sphere that most of a surface lies on; what stands out of it, as a cornea does, counts little.

    points : (n, 3) [mm]
    area : (n,) of the surface around each [mm2]

    Weighted least squares of |p|^2 = 2 p.c + (r^2 - |c|^2), again and again with Cauchy's weights.
    """
    weight, share = np.ones(len(points)), area / area.sum()
    start = points.mean(axis=0)
    p = points - start
    for _ in range(_STEPS):
        root = np.sqrt(weight * share)[:, None]
        rows = np.column_stack((2 * p, np.ones(len(p))))
        found = np.linalg.lstsq(rows * root, (p * p).sum(axis=1) * root[:, 0], rcond=None)[0]
        radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
        off = np.abs(np.linalg.norm(p - found[:3], axis=1) - radius)
        order = np.argsort(off)
        at = np.cumsum(share[order])
        middle, most = (float(off[order][min(np.searchsorted(at, s), len(at) - 1)]) for s in (0.5, _MISSED))
        weight = 1.0 / (1.0 + (off / max(2.0 * middle, 1e-3 * radius, 1e-9)) ** 2)
    return Sphere(start + found[:3], radius, most / max(radius, 1e-9))


def corneal_axis(points: Doubles, area: Doubles, ball: Sphere, ahead: Doubles) -> Doubles | None:
    """(3,) the way that a cornea on a ball looks; None where nothing stands out like one.

    points, area : of all of the eye, see `fit_sphere`
    ahead : (3,) unit vector, about where the head looks
    """
    out = points - ball.middle
    far = np.linalg.norm(out, axis=1)
    height = far / ball.radius - 1.0
    stands = (height > _BULGE) & (out @ ahead > 0.3 * far)
    if not stands.any() or height[stands].max() < _CORNEA:
        return None
    share = (area * height)[stands]
    mean = _unit((share[:, None] * out[stands]).sum(axis=0))
    if share[out[stands] @ mean < _WIDE * far[stands]].sum() > 0.1 * share.sum():
        return None
    if np.count_nonzero(stands) < 8:
        return mean
    axis = _unit(fit_sphere(points[stands], area[stands]).middle - ball.middle)
    return axis if axis @ mean > 0.95 else mean


def _unit(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))
