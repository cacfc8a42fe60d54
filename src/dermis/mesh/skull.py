"""Position of the skull in a mesh, which may be a head, a bust or a body."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Ints

Point = tuple[float, float, float]
_CROWN_TO_CENTRE_MM = 120.0  # half the height of an adult head
_HEAD_HEIGHT_RANGE_MM = 100.0, 1000.0  # smallest and largest height of heads and busts
_MIN_BODY_HEIGHT_MM = 300.0
MAX_ELONGATION = 2.4
"""Largest ratio of length to width of a head with neck or shoulders; forearms have 3 and more [-]."""
_MAX_RELATIVE_WIDTH = 3.0  # largest width of a bust relative to its depth
_HEAD_RADIUS_ABOUT_EYES_MM = 250.0  # largest horizontal distance between the eyes and other parts of the head
_MAX_FLAT_THICKNESS_RATIO = 0.5  # thickness relative to width below which a mesh is flat
_MIN_MEAN_NORMAL_LENGTH = 0.2  # length of the mean normal of an open surface; 0 for closed meshes
_WORD_PATTERN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
# Sections of a standing figure, as fractions of its height, and widths relative to its height.
_HEAD_SECTION_HEIGHT = 0.95
_NECK_SECTION_HEIGHTS = 0.82, 0.85, 0.88
_SHOULDER_SECTION_HEIGHTS = 0.74, 0.77, 0.8
_MIN_FIGURE_HEIGHT_TO_DEPTH = 2.5
_MAX_HEAD_WIDTH, _MAX_NECK_WIDTH, _MIN_SHOULDERS_TO_NECK = 0.25, 0.16, 1.6


def is_head_sized(positions: Floats) -> bool:
    """Return whether vertices (v, 3) have the size and proportions of a head or bust [mm]."""
    width, height, depth = np.ptp(positions, axis=0)
    low, high = _HEAD_HEIGHT_RANGE_MM
    if not (low <= height <= high and max(width, depth) <= _MAX_RELATIVE_WIDTH * height):
        return False
    _, across, along = principal_sizes(positions)
    return bool(along <= MAX_ELONGATION * across)


def principal_sizes(positions: Floats) -> Doubles:
    """Return the extents (3,) of a set of vertices (v, 3) along its principal axes, the longest axis last."""
    points = positions.astype(np.float64)
    return np.asarray(np.ptp(points @ np.linalg.eigh(np.cov(points.T)).eigenvectors, axis=0))


def is_standing_figure(positions: Floats, triangles: Ints) -> bool:
    """Return whether a mesh looks like a standing person: a small head, a narrow neck and wide shoulders.

    positions : (v, 3) vertices of any unit, Y up
    triangles : (f, 3) vertex indices
    """
    width, height, depth = (float(one) for one in np.ptp(positions, axis=0))
    if height <= _MIN_FIGURE_HEIGHT_TO_DEPTH * min(width, depth):
        return False
    points, ends = positions.astype(np.float64), positions[:, 1][triangles]
    low, high = ends.min(axis=1), ends.max(axis=1)
    levels = (_HEAD_SECTION_HEIGHT, *_NECK_SECTION_HEIGHTS, *_SHOULDER_SECTION_HEIGHTS)
    heights = [float(points[:, 1].min()) + level * height for level in levels]
    head, *others = (_horizontal_section(points, triangles[(low <= y) & (high > y)], y) for y in heights)
    neck = min(others[: len(_NECK_SECTION_HEIGHTS)], key=lambda one: one.width)
    shoulders = max(others[len(_NECK_SECTION_HEIGHTS) :], key=lambda one: one.width)
    return (
        head.parts == neck.parts == 1
        and 0 < head.width < _MAX_HEAD_WIDTH * height
        and 0 < neck.width < _MAX_NECK_WIDTH * height
        and shoulders.width > _MIN_SHOULDERS_TO_NECK * neck.width
        and abs(neck.middle - shoulders.middle) < 0.5 * neck.width
    )


def skull_centre_below(positions: NDArray[np.floating], crown_height: float) -> Point:
    """Return the centre of the skull of a head whose crown is at a given height [mm].

    positions : (v, 3) vertices of the head, Y up [mm]
    crown_height : y coordinate of the crown [mm]
    """
    x, y, z = positions.T
    skull = y > crown_height - 2 * _CROWN_TO_CENTRE_MM
    centre_x, centre_z = (float(c.min() + c.max()) / 2 for c in (x[skull], z[skull]))
    return centre_x, crown_height - _CROWN_TO_CENTRE_MM, centre_z


def body_skull_centre(positions: Floats, triangles: Ints, eyes: Floats) -> Point | None:
    """Return the centre of the skull of a body: at the level of its eyes, or at the top of a standing figure.

    The result is None for a mesh without eyes that is not a standing figure, and for a mesh that is too small
    to be a body.

    positions : (v, 3) vertices, Y up [mm]
    triangles : (f, 3) vertex indices
    eyes : (n, 3) vertices of eyeballs [mm]; empty if unknown
    """
    if np.ptp(positions[:, 1]) < _MIN_BODY_HEIGHT_MM:
        return None
    if len(eyes):
        x, y, z = 0.5 * (eyes.min(axis=0) + eyes.max(axis=0))
        near = np.hypot(positions[:, 0] - x, positions[:, 2] - z) < _HEAD_RADIUS_ABOUT_EYES_MM
        return skull_centre_below(positions[near], float(y) + _CROWN_TO_CENTRE_MM)
    if is_standing_figure(positions, triangles):
        return skull_centre_below(positions, float(positions[:, 1].max()))
    return None


def head_bone(bone_names: tuple[str, ...]) -> int | None:
    """Return the index of the bone of the head, such as "head" or "mixamorig:Head"; None if there is none."""
    last_words = ([word.casefold() for word in _WORD_PATTERN.findall(name)[-1:]] for name in bone_names)
    return next((k for k, word in enumerate(last_words) if word == ["head"]), None)


def centre_of_box(positions: Floats) -> Point:
    """Return the centre of the bounding box of vertices (v, 3) [mm]."""
    x, y, z = 0.5 * (positions.min(axis=0) + positions.max(axis=0)).astype(np.float64)
    return float(x), float(y), float(z)


def facing_axes(positions: Floats, normals: Floats) -> Doubles:
    """Return directions to the viewer's right, up and to the front of a mesh without a head, as rows (3, 3).

    The directions are x, y and z, unless the mesh is flat: the front of a flat mesh is the side to which its
    normals point.

    positions, normals : (v, 3) vertices, Y up [mm], and their normals
    """
    sizes = np.ptp(positions, axis=0)
    thin = int(sizes.argmin())
    front, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    if sizes[thin] < _MAX_FLAT_THICKNESS_RATIO * np.partition(sizes, 1)[1]:
        front = np.eye(3)[thin] * (-1.0 if normals[:, thin].mean() < -_MIN_MEAN_NORMAL_LENGTH else 1.0)
        up = up if thin != 1 else np.array([0.0, 0.0, -front[1]])
    return np.array([np.cross(up, front), up, front])


class _Section(NamedTuple):
    """Intersection of a mesh with a horizontal plane, seen from the front.

    parts : number of separate intervals along x
    width : total length of the intervals
    middle : midpoint between the lowest and the highest x of all intervals
    """

    parts: int
    width: float
    middle: float


def _horizontal_section(positions: Doubles, cut_triangles: Ints, plane_height: float) -> _Section:
    """Return the intersection of a mesh with the horizontal plane at a height.

    positions : (v, 3) vertices of the mesh, Y up
    cut_triangles : (n, 3) vertex indices of the triangles that the plane cuts
    plane_height : y coordinate of the plane
    """
    if not len(cut_triangles):
        return _Section(0, 0.0, 0.0)
    (x, y), a, b = positions.T[:2], cut_triangles, np.roll(cut_triangles, 1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing: Doubles = x[a] + (x[b] - x[a]) * (plane_height - y[a]) / (y[b] - y[a])
    crossing[(y[a] > plane_height) == (y[b] > plane_height)] = np.nan
    low, high = np.nanmin(crossing, axis=1), np.nanmax(crossing, axis=1)
    order = np.argsort(low)
    low, reached = low[order], np.maximum.accumulate(high[order])
    gaps = np.maximum(low[1:] - reached[:-1], 0.0)
    width = reached[-1] - low[0] - gaps.sum()
    return _Section(1 + int(np.count_nonzero(gaps)), float(width), float(low[0] + reached[-1]) / 2)
