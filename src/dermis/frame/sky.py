"""Views of a head from all around, through which its places learn how much of the sky they see."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.projection import MIDDLE, Views, frame_of
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head
from dermis.mesh.morph_targets import no_targets
from dermis.mesh.outline import Outline, RigOutline, outline_of
from dermis.mesh.rig import Motion

Floats = NDArray[np.float64]
VIEWS = 64
SIDE = 256
"""Texels along the side of a depth map."""
_MARGIN_MM = 1.0
_BORDER = 2.0  # texels around the head: what is lifted off its surface stays inside
_AROUND_MM = 100.0  # how far from a head's middle its points count
_MOST_POINTS = 512


class Look(NamedTuple):
    """Views from all around.

    views : of the depth maps
    to_map : (k, 3, 4) from points to columns and rows [texel], and to depth
    towards : (k, 3) unit vectors to where they look from
    steps_mm : (k, 2, 3) from a texel to the one on its right and to the one above
    """

    views: Views
    to_map: Floats
    towards: Floats
    steps_mm: Floats


@dataclass(frozen=True, eq=False)
class Anchors:
    """Points that tell how a head is turned.

    points : (s,) of the control points
    arms : (s, 3) from their middle at rest, as much as they count
    outline : them, with the bones that move them
    """

    points: NDArray[np.intp]
    arms: Floats
    outline: RigOutline


def look_around(outline: Outline, turn: Floats) -> Look:
    """The tightest views of a shape from all around.

    turn : (3, 3) rotation that the directions follow
    """
    axes = _axes() @ turn.T
    seen = (axes.reshape(-1, 3).astype(np.float32) @ outline.columns[:3]).reshape(*axes.shape[:2], -1)
    low, high = seen.min(axis=2).astype(np.float64), seen.max(axis=2).astype(np.float64)
    half, middle = 0.5 * (high - low) + _MARGIN_MM, 0.5 * (high + low)
    half[:, 2] += outline.slack_mm
    half[:, :2] *= SIDE / (SIDE - 2.0 * _BORDER)
    clips = np.zeros((VIEWS, 4, 4))
    clips[:, :3, :3], clips[:, :3, 3] = axes / half[..., None], -middle / half
    clips[:, 2] *= -0.5  # from 1 near to 0 far
    clips[:, 2, 3] += 0.5
    clips[:, 3, 3] = 1.0
    to_map = clips[:, :3].copy()
    to_map[:, :2] *= 0.5 * SIDE * np.array([[1.0], [-1.0]])
    to_map[:, :2, 3] += 0.5 * SIDE - 0.5
    steps = axes[:, :2] * (2.0 / SIDE * half[:, :2, None])
    return Look(Views(clips, MIDDLE), to_map, -axes[:, 2], steps)


@lru_cache(maxsize=1)
def _axes() -> Floats:
    """(k, 3, 3) right, up and forward."""
    return np.array([frame_of(-towards, np.array([0.0, 1.0, 0.0])) for towards in fibonacci_sphere(VIEWS)])


def anchors_of(head: Head) -> Anchors:
    """Those near the head's middle: a turn of the neck counts, shoulders that stay do not."""
    rig = head.control
    points = np.unique(np.linspace(0, len(rig.positions_mm) - 1, _MOST_POINTS).astype(np.intp))
    places = rig.positions_mm[points].astype(np.float64)
    weight = np.exp(-((places - head.centre_mm) ** 2).sum(axis=1) / _AROUND_MM**2)[:, None]
    arms = weight * (places - (weight * places).sum(axis=0) / weight.sum())
    return Anchors(points, arms, outline_of(rig.positions_mm, no_targets(), rig.skeleton, points))


def turn_of(anchors: Anchors, motion: Motion) -> Floats:
    """(3, 3) rotation of a head as a whole: the nearest to what its points do [Kabsch1976].

    Morph targets do not turn a head, and are left out.
    """
    rest = anchors.outline.rest_mm.copy()
    rest[:3] = motion.positions_mm[anchors.points].T
    moved = replace(anchors.outline, rest_mm=rest).posed(np.zeros(0, np.float32), motion.matrices)
    left, _, right = np.linalg.svd(moved.T.astype(np.float64) @ anchors.arms)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return np.asarray(left @ right)
