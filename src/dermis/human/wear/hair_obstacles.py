"""Hair around what a person wears: guides are moved out of clothing, and pressed flat below headwear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from dermis.base.arrays import Doubles, Index, Mask
from dermis.human.hair.skin_surface import SkinSurface
from dermis.mesh.groom import KNOTS_PER_GUIDE, NO_CEILING_MM, Groom, Guides
from dermis.mesh.grown_strands import guide_frames, posed_guide_knots

_CLOTH_CLEARANCE_MM = 5.0  # distance of guides from cloth; strands between guides sag by some millimetres
_BORDER_MM = 9.0  # distance beyond the border of cloth within which the cloth is continued as a plane
_REACH_MM = 60.0  # depth in clothing from which hair is moved out
_MIN_WALL_COSINE = 0.5  # between normals of cloth and the direction from the axis of the neck, on walls
_WALL_COLUMNS, _WALL_ROW_MM = 72, 6.0
_HANG_DECAY, _RISE_DECAY = 0.85, 0.88  # of the push by a collar, from knot to knot below and above it
_HANGING_MM = 70.0  # distance below the top of a garment that hair over its collar reaches
_ROOM_FRACTION = 0.55  # height of pressed hair relative to the outside of headwear
_HIDDEN_MM = 10.0  # distance inside the rim of headwear from which hair is hidden
_LEAST_ROOM_MM = 0.6  # least height of hair below headwear
_PASSES = 4
_SMOOTHING = np.array([0.25, 0.5, 0.25])  # of displacements along a guide, between passes


class Limits(NamedTuple):
    """Limits of hair at n points of guides.

    displacement_mm : (n, 3) displacement to the nearest place where hair may be; 0 for most points [mm]
    height_mm : (n,) height above the surface on which hair lies, infinite far from it [mm]
    ceiling_mm : (n,) largest height above the skin, `NO_CEILING_MM` where nothing covers hair, and
        `-NO_CEILING_MM` where it is hidden [mm]
    """

    displacement_mm: Doubles
    height_mm: Doubles
    ceiling_mm: Doubles


class Obstacle(Protocol):
    """Something worn that limits where hair can be."""

    def limits(self, knots_mm: Doubles, grown: Mask) -> Limits:
        """Return the limits at the knots (g, k, 3) of guides [mm].

        grown : (g, k) mask of the knots up to which hair grows
        """


class ClothObstacle:
    """Outside of a garment, on which hair lies.

    Hair is moved out along the normals of the cloth, and where it hangs over a collar or a hood also away
    from the axis of the neck.

    points_mm, normals : (m, 3) points of the outside of the garment [mm], and unit normals there
    is_collar : (m,) mask of the points of collars and hoods
    axis_mm : x and z of the vertical axis of the neck [mm]
    """

    def __init__(
        self, points_mm: Doubles, normals: Doubles, is_collar: Mask, axis_mm: tuple[float, float]
    ) -> None:
        self._surface, self._axis = SkinSurface(points_mm, normals), np.array(axis_mm)
        self._low, self._high = points_mm.min(axis=0), points_mm.max(axis=0)
        radial, radius, angle = self._polar(points_mm)
        wall = is_collar & ((normals[:, [0, 2]] * radial).sum(axis=1) > _MIN_WALL_COSINE)
        self._wall_mm = self._wall(angle[wall], points_mm[wall, 1], radius[wall])

    def limits(self, knots_mm: Doubles, grown: Mask) -> Limits:
        """Return the limits at the knots (g, k, 3) of guides [mm]; see `Obstacle.limits`."""
        points = knots_mm.reshape(-1, 3)
        move, height = np.zeros(points.shape), np.full(len(points), np.inf)
        is_near = (points > self._low - _REACH_MM) & (points < self._high + _REACH_MM)
        near = np.flatnonzero(is_near.all(axis=1))
        base, normal = self._surface.project(points[near])
        distance = ((points[near] - base) * normal).sum(axis=1)
        beside = self._surface.distances_mm(points[near]) > np.abs(distance) + _BORDER_MM
        distance[beside | (distance < -_REACH_MM)] = np.inf
        move[near] = np.maximum(_CLOTH_CLEARANCE_MM - distance, 0.0)[:, None] * normal
        height[near] = np.maximum(distance, _CLOTH_CLEARANCE_MM)
        outward = self._outward(knots_mm, grown, move)
        return Limits(move + outward, height, np.full(len(points), NO_CEILING_MM))

    def _outward(self, knots_mm: Doubles, grown: Mask, moved_mm: Doubles) -> Doubles:
        """Return displacements (n, 3) away from the neck of guides that hang over a collar [mm].

        moved_mm : (n, 3) displacements of the knots to the outside of the cloth near them [mm]
        """
        points = knots_mm.reshape(-1, 3) + moved_mm
        radial, radius, angle = self._polar(points)
        column, row = self._cell(angle, points[:, 1])
        last_row = self._wall_mm.shape[1] - 1
        wall = self._wall_mm[column, np.clip(row, 0, last_row)] * ((row >= 0) & (row <= last_row))
        lowest = np.where(grown, knots_mm[..., 1], np.inf).min(axis=1)
        hangs = np.repeat(lowest < self._high[1] - _HANGING_MM, knots_mm.shape[1])
        need = np.where(hangs & (wall > 0.0), wall + _CLOTH_CLEARANCE_MM - radius, 0.0)
        push = np.where(need < _REACH_MM, np.maximum(need, 0.0), 0.0).reshape(grown.shape)
        for k in range(1, KNOTS_PER_GUIDE):  # hair hangs from a collar instead of following it inwards
            push[:, k] = np.maximum(push[:, k], _HANG_DECAY * push[:, k - 1])
        for k in range(KNOTS_PER_GUIDE - 2, 0, -1):
            push[:, k] = np.maximum(push[:, k], _RISE_DECAY * push[:, k + 1])
        outward = push.reshape(-1, 1) * radial
        return np.stack([outward[:, 0], np.zeros(len(points)), outward[:, 1]], axis=1)

    def _polar(self, points_mm: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return directions (n, 2) along x and z from the axis, distances (n,) [mm] and angles (n,) [rad]."""
        offset = points_mm[:, [0, 2]] - self._axis
        radius = np.linalg.norm(offset, axis=1)
        return offset / np.maximum(radius, 1e-6)[:, None], radius, np.arctan2(offset[:, 0], offset[:, 1])

    def _cell(self, angle: Doubles, y_mm: Doubles) -> tuple[Index, Index]:
        """Return the columns and rows (n,) of the cells of the wall at angles [rad] and heights [mm]."""
        column = np.floor(angle / (2.0 * np.pi) * _WALL_COLUMNS).astype(np.int64) % _WALL_COLUMNS
        return column, np.floor((self._high[1] - y_mm) / _WALL_ROW_MM).astype(np.int64)

    def _wall(self, angle: Doubles, y_mm: Doubles, radius_mm: Doubles) -> Doubles:
        """Return the largest distance of cloth from the axis by column and row, 0 without cloth [mm]."""
        from scipy.ndimage import maximum_filter

        column, row = self._cell(angle, y_mm)
        wall = np.zeros((_WALL_COLUMNS, int(row.max(initial=0)) + 1))
        np.maximum.at(wall, (column, row), radius_mm)
        return np.asarray(maximum_filter(wall, 3, mode=("wrap", "nearest")))


class Room(Protocol):
    """Room between skin and headwear."""

    def limits_mm(self, points_mm: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return height above the skin, height of the outside, and distance inside the rim [mm]."""

    def outward(self, points_mm: Doubles) -> Doubles:
        """Return unit vectors (n, 3) away from the skull."""


class HeadwearObstacle:
    """Inside of headwear, in which hair is pressed flat."""

    def __init__(self, room: Room) -> None:
        self._room = room

    def limits(self, knots_mm: Doubles, grown: Mask) -> Limits:
        """Return the limits at the knots (g, k, 3) of guides [mm]; see `Obstacle.limits`."""
        points_mm = knots_mm.reshape(-1, 3)
        height, room, inside_mm = self._room.limits_mm(points_mm)
        is_covered = np.isfinite(room)
        ceiling = np.maximum(_ROOM_FRACTION * room, _LEAST_ROOM_MM)
        inward = np.where(is_covered, np.maximum(height - ceiling, 0.0), 0.0)
        flat = np.where(is_covered, np.maximum(np.minimum(height, ceiling), 0.0), np.inf)
        ceiling = np.where(inside_mm > _HIDDEN_MM, -NO_CEILING_MM, np.minimum(ceiling, NO_CEILING_MM))
        return Limits(-inward[:, None] * self._room.outward(points_mm), flat, ceiling)


def fit_groom(groom: Groom, points_mm: Doubles, obstacles: Sequence[Obstacle]) -> Groom:
    """Return a groom whose guides respect obstacles, in the rest pose of a person.

    points_mm : (p, 3) points of the person's mesh at rest [mm]
    """
    if not obstacles:
        return groom
    guides, grown = groom.guides, _grown_mask(groom)
    for step in range(_PASSES):
        knots, _ = posed_guide_knots(guides, points_mm)
        found = [obstacle.limits(knots, grown) for obstacle in obstacles]
        move = np.sum([one.displacement_mm for one in found], axis=0).reshape(knots.shape)
        move[:, 0] = 0.0  # roots stay in the skin
        if step == 0:
            guides = _with_heights(guides, found)
        if not move[grown].any():  # as for short hair and clothing
            break
        if step < _PASSES - 2:
            move = _smooth_along(move)
        guides = _displaced(guides, points_mm, move)
    return replace(groom, guides=guides)


def _grown_mask(groom: Groom) -> Mask:
    """Return the mask (g, k) of the knots of guides up to which the longest hair grows."""
    longest = float((groom.parameters["length_mm"] / groom.parameters["guide_mm"]).max())
    along = np.linspace(0.0, 1.0, KNOTS_PER_GUIDE)
    return np.asarray(along <= np.minimum(groom.guides.cut, longest)[:, None] + 1.0 / KNOTS_PER_GUIDE)


def _with_heights(guides: Guides, found: Sequence[Limits]) -> Guides:
    shape, rest = guides.rest_mm.shape[:2], guides.rest_mm.copy()
    for one in found:
        rest[..., 3] = np.minimum(rest[..., 3], one.height_mm.reshape(shape))
    ceiling = np.min([one.ceiling_mm for one in found], axis=0).reshape(shape).astype(np.float32)
    return replace(guides, rest_mm=rest, ceiling_mm=np.minimum(guides.ceilings_mm, ceiling))


def _displaced(guides: Guides, points_mm: Doubles, move_mm: Doubles) -> Guides:
    """Return guides whose knots are displaced by (g, k, 3) in the pose of the points [mm]."""
    _, axes = guide_frames(guides, points_mm)
    local = guides.local_mm + np.einsum("gkaic,gkc->gkai", axes, move_mm)
    rest = guides.rest_mm.copy()
    rest[..., :3] += move_mm
    return replace(guides, local_mm=local.astype(np.float32), rest_mm=rest)


def _smooth_along(move_mm: Doubles) -> Doubles:
    """Return displacements (g, k, 3) smoothed along each guide; 0 at the roots."""
    padded = np.pad(move_mm, ((0, 0), (1, 1), (0, 0)), mode="edge")
    count, kernel = move_mm.shape[1], _SMOOTHING
    smooth = sum(kernel[k] * padded[:, k : k + count] for k in range(3))
    result = np.asarray(np.where(np.abs(move_mm) > np.abs(smooth), move_mm, smooth))
    result[:, 0] = 0.0
    return result
