"""Matrices from world to clip space for cameras and shadow maps; column vectors, depth 1 near to 0 far."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.mesh.outline import Outline
from dermis.scene.camera import Window
from dermis.scene.lights import PointLight

Vec = NDArray[np.float64]
Matrix = NDArray[np.float64]
Triple = tuple[float, float, float]
Axes = tuple[Triple, Triple, Triple]
Row = tuple[float, float, float, float]
Rows = tuple[Row, Row, Row]
_WIDEST_LIGHT = math.tan(math.radians(80.0))
_NEAREST_MM = 1.0
_UP = 0.0, 1.0, 0.0
_CENTRED = 0.0, 0.0
MIDDLE = np.full((1, 2), 0.5)
"""The one place of a sample in the pixel: its middle."""


class Views(NamedTuple):
    """Views of the world for the layers of a texture array: a layer for each sample of each view.

    clips : (k, 4, 4) world to clip space
    places : (n, 2) of the samples in a pixel, from 0 to 1 to the right and down
    """

    clips: Matrix
    places: Matrix

    def matrices(self, size: tuple[int, int]) -> Matrix:
        """(k n, 4, 4) world to clip space, shifted so that each layer's sample is the middle of the pixel.

        size : of the picture [pixel]
        """
        moved = (self.places - 0.5) * (-2.0 / size[0], 2.0 / size[1])  # of a picture 2 wide and high
        each = np.repeat(self.clips[:, None], len(moved), axis=1)
        each[:, :, :2] += moved[..., None] * self.clips[:, None, 3:]
        return each.reshape(-1, 4, 4)


class ShadowView(NamedTuple):
    """A light's view of the head, for its shadow map.

    clip : (4, 4) world to clip space
    texel : side of a texel of its map [mm]; for all but parallel light per mm of distance
    origin : the eye, in parallel light a point in the map's middle [mm]
    right, up : axes of its map, unit vectors
    near, far : depths at which the map holds 1 and 0 [mm]
    """

    clip: Matrix
    texel: float
    origin: Triple
    right: Triple
    up: Triple
    near: float
    far: float


def shadow_layers(views: Sequence[ShadowView | None]) -> Views:
    """A layer for each view but None, sampled at the middles of its pixels."""
    return Views(np.array([view.clip for view in views if view]).reshape(-1, 4, 4), MIDDLE)


def frame_of(forward: Vec, up: Vec) -> tuple[Vec, Vec, Vec]:
    """Right, up and forward as unit vectors."""
    right, upward, ahead = axes_of(forward.tolist(), up.tolist())
    return np.array(right), np.array(upward), np.array(ahead)


def axes_of(forward: Sequence[float], up: Sequence[float] = _UP) -> Axes:
    """The same in plain floats: numpy takes ten times as long for so few numbers, and a frame has many."""
    f = unit(forward)
    r = _cross(f, up)
    if math.hypot(*r) <= 1e-6 * math.hypot(*up):
        r = _cross(f, (1.0, 0.0, 0.0) if abs(f[0]) < 0.9 else (0.0, 0.0, 1.0))
    r = unit(r)
    return r, _cross(r, f), f


def place_of(position: Sequence[float], centre: Sequence[float]) -> Triple:
    """A point in world space.

    position : relative to the head's centre
    """
    return position[0] + centre[0], position[1] + centre[1], position[2] + centre[2]


def between(start: Sequence[float], end: Sequence[float]) -> Triple:
    """The vector from one place to another."""
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def unit(v: Sequence[float]) -> Triple:
    """The direction of a vector."""
    x, y, z = v
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[float], b: Sequence[float]) -> Triple:
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def rows_of(eye: Triple, axes: Axes) -> Rows:
    """The upper three rows of the view matrix: right, up and depth."""
    right, up, forward = axes
    return (*right, -_dot(right, eye)), (*up, -_dot(up, eye)), (*forward, -_dot(forward, eye))


def perspective(rows: Rows, window: Window, near: float, far: float) -> list[Sequence[float]]:
    """Rows of the matrix to clip space for a window before the eye; depth 1 at near, 0 at far.

    Floats are densest at 0: reversed depth is evenly precise over the whole range.
    """
    scale = -near / (far - near)
    depth = [scale * c for c in rows[2]]
    depth[3] -= far * scale
    along = zip(rows, window.half, window.shift, strict=False)
    across = [[c / half - shift * w for c, w in zip(row, rows[2], strict=True)] for row, half, shift in along]
    return [*across, depth, rows[2]]


def depth_range(outline: Outline, rows: Rows) -> tuple[float, float]:
    """Nearest and farthest depth of the shape before the eye, a little widened [mm]."""
    z = np.array(rows[2], np.float32) @ outline.columns
    near, far = float(z.min()) - outline.slack_mm, float(z.max()) + outline.slack_mm
    return max(near - 1.0, 0.5, 1e-3 * far), max(far + 1.0, 2.0)


def point_views(
    lights: Sequence[tuple[str, PointLight]], centre: Triple, outline: Outline, size: int
) -> list[ShadowView]:
    """The tightest maps of `size` texels around the whole mesh for all lights, by a few products.

    lights : each with its name before it

    Raises DermisError when one stands inside the mesh's bounds: a single map cannot look all around.
    """
    if not lights:
        return []
    eyes = [place_of(light.position, centre) for _, light in lights]
    axes = [axes_of(between(eye, outline.middle_mm)) for eye in eyes]
    rows = [rows_of(*one) for one in zip(eyes, axes, strict=True)]
    stacked = np.array(list(zip(*rows, strict=True)), np.float32).reshape(-1, 4)
    seen = (stacked @ outline.columns).reshape(3, len(rows), -1)
    depth = seen[2]
    near, far = depth.min(axis=1).tolist(), depth.max(axis=1).tolist()
    _check_outside(lights, [one > _NEAREST_MM for one in near])
    steepest = _steepest(seen[:2], depth)
    _check_outside(lights, [one <= _WIDEST_LIGHT for one in steepest])
    slack = outline.slack_mm
    bounds = [
        (1.02 * h, max(0.98 * n - slack, 0.1 * n), 1.02 * f + slack)
        for h, n, f in zip(steepest, near, far, strict=True)
    ]
    clips = [
        perspective(r, Window((h, h), _CENTRED), n, f) for r, (h, n, f) in zip(rows, bounds, strict=True)
    ]
    return [
        ShadowView(clip, 2.0 * h / size, eye, right, up, n, f)
        for clip, eye, (right, up, _), (h, n, f) in zip(np.array(clips), eyes, axes, bounds, strict=True)
    ]


def _check_outside(lights: Sequence[tuple[str, PointLight]], outside: Sequence[bool]) -> None:
    if not all(outside):
        culprit, light = lights[outside.index(False)]
        came = f"it is at {[round(c) for c in light.position]} mm"
        refuse(culprit, "a place outside the head", came, "Move it away or set shadows = false")


def _steepest(sides: NDArray[np.floating], depth: NDArray[np.floating]) -> list[float]:
    """The largest tangent in each view; overwrites `sides`, as new memory takes longer than arithmetic."""
    for side in sides:
        side /= depth  # one by one: dividing them at once makes numpy allocate buffers
    found: list[float] = np.abs(sides, out=sides).max(axis=(0, 2)).tolist()
    return found


def parallel_view(direction: Vec, outline: Outline, size: int) -> ShadowView:
    """The tightest map of `size` texels around the whole mesh in parallel light."""
    points = outline.places_mm
    axes = frame_of(direction, np.array(_UP))
    local = points @ np.stack(axes, axis=1)
    room = 1.0 + np.array([0.0, 0.0, outline.slack_mm])
    low, high = local.min(axis=0) - room, local.max(axis=0) + room
    half = 0.51 * float(max(high[0] - low[0], high[1] - low[1]))
    clip = np.eye(4)
    clip[0, :3], clip[1, :3] = axes[0] / half, axes[1] / half
    clip[2, :3] = -axes[2] / (high[2] - low[2])
    clip[0, 3], clip[1, 3] = -0.5 * (low[0] + high[0]) / half, -0.5 * (low[1] + high[1]) / half
    clip[2, 3] = high[2] / (high[2] - low[2])
    middle = 0.5 * (low[0] + high[0]) * axes[0] + 0.5 * (low[1] + high[1]) * axes[1]
    origin, right, up = ((float(x), float(y), float(z)) for x, y, z in (middle, axes[0], axes[1]))
    return ShadowView(clip, 2.0 * half / size, origin, right, up, float(low[2]), float(high[2]))


@cache
def pixel_samples(count: int) -> NDArray[np.float64]:
    """(count, 2) places in the unit square: Hammersley's set, even in both axes for any count."""
    index = np.arange(count)
    y, digit, rest = np.zeros(count), 0.5, index.copy()
    while rest.any():
        y += digit * (rest & 1)
        rest >>= 1
        digit /= 2
    places = np.stack([(index + 0.5) / count, y + 0.5 / count], axis=-1) % 1.0
    places.flags.writeable = False
    return places
