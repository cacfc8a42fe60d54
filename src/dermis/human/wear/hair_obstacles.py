"""Hair around what a person wears: guides are moved out of clothing, and pressed flat below headwear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair.skin_surface import SkinSurface
from dermis.mesh.groom import NO_CEILING_MM, Groom, Guides
from dermis.mesh.grown_strands import guide_frames, posed_guide_knots

_CLOTH_CLEARANCE_MM = 2.5  # distance of guides from cloth; strands between them need less
_BORDER_MM = 9.0  # distance beyond the border of cloth within which the cloth is continued as a plane
_REACH_MM = 60.0  # depth in clothing from which hair is moved out
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

    def limits(self, points_mm: Doubles) -> Limits:
        """Return the limits at points (n, 3) [mm]."""


class ClothObstacle:
    """Outside of a garment, on which hair lies.

    points_mm, normals : (m, 3) points of the outside of the garment [mm], and unit normals there
    """

    def __init__(self, points_mm: Doubles, normals: Doubles) -> None:
        self._surface = SkinSurface(points_mm, normals)
        self._low, self._high = points_mm.min(axis=0) - _REACH_MM, points_mm.max(axis=0) + _REACH_MM

    def limits(self, points_mm: Doubles) -> Limits:
        """Return the limits at points (n, 3) [mm]."""
        count = len(points_mm)
        move, height = np.zeros((count, 3)), np.full(count, np.inf)
        near = np.flatnonzero(((points_mm > self._low) & (points_mm < self._high)).all(axis=1))
        base, normal = self._surface.project(points_mm[near])
        offset = points_mm[near] - base
        distance = (offset * normal).sum(axis=1)
        beside = self._surface.distances_mm(points_mm[near]) > np.abs(distance) + _BORDER_MM
        distance[beside | (distance < -_REACH_MM)] = np.inf
        move[near] = np.maximum(_CLOTH_CLEARANCE_MM - distance, 0.0)[:, None] * normal
        height[near] = np.maximum(distance, _CLOTH_CLEARANCE_MM)
        return Limits(move, height, np.full(count, NO_CEILING_MM))


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

    def limits(self, points_mm: Doubles) -> Limits:
        """Return the limits at points (n, 3) [mm]."""
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
    guides = groom.guides
    moved = np.zeros((*guides.rest_mm.shape[:2], 3))
    for step in range(_PASSES):
        knots, _ = posed_guide_knots(guides, points_mm)
        flat = knots.reshape(-1, 3)
        found = [obstacle.limits(flat) for obstacle in obstacles]
        move = sum((one.displacement_mm for one in found), np.zeros_like(flat)).reshape(moved.shape)
        move[:, 0] = 0.0  # roots stay in the skin
        if step < _PASSES - 2:
            move = _smooth_along(move)
        guides = _displaced(guides, points_mm, move)
        if step == 0:
            guides = _with_heights(guides, found)
    return replace(groom, guides=guides)


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
