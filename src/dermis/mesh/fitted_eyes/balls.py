"""Detection of the two eyeballs of a head in the meshes that the head's file declares to be eyes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.geometry import label_components, triangle_areas
from dermis.mesh.mesh import Mesh

EYEBALL_RADIUS_RANGE_MM = 8.0, 20.0
"""Accepted radii of the eyeballs in a file; real eyeballs have about 12 mm, but artists' models vary [mm]."""
MAX_SPHERE_DEVIATION = 0.06
"""Largest accepted `Sphere.deviation` of an eyeball [-]."""
_MIN_EYEBALL_POINTS = 20
_MIN_COVERED_FRACTION = 0.25  # fraction of the sphere that an eyeball covers
_MAX_PART_DISTANCE_RADII = 1.2  # distance from the centre within which cornea, iris and pupil are, in radii
_GAZE_TARGET_DISTANCE_MM = 1000.0  # distance of the point that eyes without a cornea look at
_FIT_ITERATIONS = 12
_MIN_BULGE_RADII, _MIN_CORNEA_RADII = 0.025, 0.045
"""Least heights above the sphere, in radii: of points that may be on a cornea, and of a cornea's apex."""
_MIN_CORNEA_COSINE = 0.7  # cosine of the largest angle between a cornea's points and its axis
_DEVIATION_QUANTILE = 0.85  # fraction of the area that is closer to the sphere than its `deviation`


@dataclass(frozen=True, eq=False)
class DetectedEyeball:
    """Eyeball detected in a file.

    sphere : sphere fitted to the sclera
    gaze : (3,) unit vector of the direction of gaze
    cornea : whether a bulging cornea determines `gaze`; otherwise the eye is assumed to look straight ahead
    points : (n,) indices of the mesh points that belong to the eyeball
    """

    sphere: Sphere
    gaze: Doubles
    cornea: bool
    points: Index


@dataclass(frozen=True, eq=False)
class _EyePiece:
    """Connected component of the triangles that a file declares to be eyes, with a fitted sphere.

    points, area : (n,) indices of the mesh points, and area of the surface around each of them [mm2]
    sphere : sphere fitted to the points
    """

    points: Index
    area: Doubles  # area of the surface around each point [mm2]
    sphere: Sphere

    @property
    def covered_fraction(self) -> float:
        return float(self.area.sum() / (4 * np.pi * self.sphere.radius**2))

    @property
    def rejection_reason(self) -> str:
        """Return the reason why this component is not an eyeball; an empty string if it is one."""
        (low, high), (_, radius, deviation) = EYEBALL_RADIUS_RANGE_MM, self.sphere
        if len(self.points) < _MIN_EYEBALL_POINTS:
            return f"has only {len(self.points)} points"
        if deviation > MAX_SPHERE_DEVIATION:
            return (
                f"deviates from a ball by {deviation:.0%} of its radius, more than {MAX_SPHERE_DEVIATION:.0%}"
            )
        if not low <= radius <= high:
            return f"is a ball of {radius:.1f} mm radius, not of {low:g} to {high:g} mm"
        covered = self.covered_fraction
        return "" if covered >= _MIN_COVERED_FRACTION else f"is only {covered:.0%} of a ball"


def find_eyeballs(mesh: Mesh) -> tuple[tuple[DetectedEyeball, DetectedEyeball] | None, str]:
    """Find the left and the right eyeball of a mesh.

    Returns both eyeballs and an empty string, or None and the reason why two eyeballs were not found. The
    reason is an empty string if the file declares no eyes.
    """
    eye_triangles = np.flatnonzero(np.array([material.eye for material in mesh.materials])[mesh.material])
    if not len(eye_triangles):
        return None, ""
    pieces = sorted(_eye_pieces(mesh, eye_triangles), key=lambda piece: -float(piece.area.sum()))
    chosen: list[_EyePiece] = []
    for piece in pieces:
        nested = any(_distance_in_radii(piece.sphere.centre, one) < 1.0 for one in chosen)
        if not piece.rejection_reason and not nested:
            chosen.append(piece)
    if len(chosen) == 2:
        left, right = sorted(chosen, key=lambda piece: -float(piece.sphere.centre[0]))
        return _add_gaze(mesh, left, right, pieces), ""
    names = ", ".join(sorted({repr(one.name) for one in mesh.materials if one.eye}))
    count = f"{len(chosen)} ball{'s' * (len(chosen) > 1)} instead of two"
    return (
        None,
        f"eyes: {names} stay plain: {count if chosen else f'the largest piece {pieces[0].rejection_reason}'}",
    )


def _eye_pieces(mesh: Mesh, eye_triangles: Index) -> list[_EyePiece]:
    """Return the connected components of the eye triangles, each with a fitted sphere.

    eye_triangles : (n,) indices of the triangles whose material is declared to be an eye
    """
    corners = mesh.point[mesh.triangles[eye_triangles]].astype(np.int64)
    points, triangles = np.unique(corners, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    label = label_components(len(points), triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())
    thirds = np.repeat(triangle_areas(mesh.positions[mesh.triangles[eye_triangles]]) / 3, 3)
    area = np.bincount(triangles.ravel(), thirds, minlength=len(points))
    positions = mesh.points_mm[points]
    pieces = []
    for piece in range(int(label.max()) + 1):
        inside = label == piece
        sphere = fit_sphere(positions[inside], area[inside])
        pieces.append(_EyePiece(points[inside], area[inside], sphere))
    return pieces


def _distance_in_radii(points: Doubles, eye_piece: _EyePiece) -> Doubles:
    """Return the distances of points (..., 3) from the centre of a fitted sphere, divided by its radius."""
    return np.asarray(np.linalg.norm(points - eye_piece.sphere.centre, axis=-1) / eye_piece.sphere.radius)


def _add_gaze(
    mesh: Mesh, left_sclera: _EyePiece, right_sclera: _EyePiece, eye_pieces: list[_EyePiece]
) -> tuple[DetectedEyeball, DetectedEyeball]:
    """Return the left and the right eyeball, with their gaze and the points of cornea and iris.

    left_sclera, right_sclera : connected components that are the left and the right sclera
    eye_pieces : all connected components of the eyes; components inside a sclera belong to the same eyeball
    """
    positions = mesh.points_mm
    centre = (left_sclera.sphere.centre + right_sclera.sphere.centre) / 2
    ahead = np.cross(left_sclera.sphere.centre - right_sclera.sphere.centre, (0.0, 1.0, 0.0))
    ahead /= np.linalg.norm(ahead)
    balls = []
    for ball in (left_sclera, right_sclera):
        farthest = [
            0.0 if p is ball else _distance_in_radii(positions[p.points], ball).max() for p in eye_pieces
        ]
        parts = [
            piece
            for piece, radii in zip(eye_pieces, farthest, strict=True)
            if radii < _MAX_PART_DISTANCE_RADII
        ]
        points, area = (np.concatenate([getattr(p, name) for p in parts]) for name in ("points", "area"))
        axis = corneal_axis(positions[points], area, ball.sphere, ahead)
        gaze = centre + _GAZE_TARGET_DISTANCE_MM * ahead - ball.sphere.centre if axis is None else axis
        balls.append(DetectedEyeball(ball.sphere, gaze / np.linalg.norm(gaze), axis is not None, points))
    return balls[0], balls[1]


class Sphere(NamedTuple):
    """Sphere fitted to points.

    centre : (3,) centre [mm]
    radius : radius [mm]
    deviation : distance from the sphere within which 85 % of the fitted surface lies, divided by the radius
        of the sphere [-]
    """

    centre: Doubles
    radius: float
    deviation: float


def fit_sphere(points: Doubles, point_areas: Doubles) -> Sphere:
    """Fit a sphere to a surface robustly: outliers such as a cornea get low weights.

    For centre c and radius r this is a least squares fit of |p|² = 2 p·c + (r² - |c|²), with Cauchy weights
    that are updated iteratively.

    points : (n, 3) points p of the surface [mm]
    point_areas : (n,) area of the surface around each point [mm²]
    """
    weight, fraction = np.ones(len(points)), point_areas / point_areas.sum()
    start = points.mean(axis=0)
    p = points - start
    for _ in range(_FIT_ITERATIONS):
        root = np.sqrt(weight * fraction)[:, None]
        rows = np.column_stack((2 * p, np.ones(len(p))))
        solution = np.linalg.lstsq(rows * root, (p * p).sum(axis=1) * root[:, 0], rcond=None)[0]
        radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
        distance = np.abs(np.linalg.norm(p - solution[:3], axis=1) - radius)
        order = np.argsort(distance)
        total = np.cumsum(fraction[order])
        median, most = (
            float(distance[order][min(np.searchsorted(total, quantile), len(total) - 1)])
            for quantile in (0.5, _DEVIATION_QUANTILE)
        )
        weight = 1.0 / (1.0 + (distance / max(2.0 * median, 1e-3 * radius, 1e-9)) ** 2)
    return Sphere(start + solution[:3], radius, most / max(radius, 1e-9))


def corneal_axis(
    points: Doubles, point_areas: Doubles, ball: Sphere, front_direction: Doubles
) -> Doubles | None:
    """Return the unit vector (3,) from an eyeball's centre to its cornea, or None if there is no bulge.

    points : (n, 3) all points of the eye [mm]
    point_areas : (n,) area of the surface around each point [mm²]
    ball : sphere of the sclera
    front_direction : (3,) unit vector, roughly the direction in which the head looks
    """
    offset = points - ball.centre
    distance = np.linalg.norm(offset, axis=1)
    height = distance / ball.radius - 1.0
    bulges = (height > _MIN_BULGE_RADII) & (offset @ front_direction > 0.3 * distance)
    if not bulges.any() or height[bulges].max() < _MIN_CORNEA_RADII:
        return None
    volume = (point_areas * height)[bulges]
    mean = _normalise((volume[:, None] * offset[bulges]).sum(axis=0))
    if volume[offset[bulges] @ mean < _MIN_CORNEA_COSINE * distance[bulges]].sum() > 0.1 * volume.sum():
        return None
    if np.count_nonzero(bulges) < 8:
        return mean
    axis = _normalise(fit_sphere(points[bulges], point_areas[bulges]).centre - ball.centre)
    return axis if axis @ mean > 0.95 else mean


def _normalise(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))
