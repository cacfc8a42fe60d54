"""Matrices from world to clip space for cameras and shadow maps; column vectors, depth 1 near to 0 far."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.assets.mesh import Mesh
from dermis.errors import refuse
from dermis.scene.lights import DirectionalLight, Light

Vec = NDArray[np.float64]
Matrix = NDArray[np.float64]
Triple = tuple[float, float, float]
_WIDEST_LIGHT_DEGREES = 80.0


@dataclass(frozen=True)
class ShadowView:
    """How a light sees the head.

    clip : (4, 4) world to clip space
    texel : side of a texel of its map [mm]; for all but parallel light per mm of distance
    origin : the eye, in parallel light a point in the map's middle [mm]
    right, up : axes of its map, unit vectors
    near, far : depths at which the map holds 1 and 0 [mm]
    """

    clip: Matrix
    texel: float
    origin: Vec
    right: Vec
    up: Vec
    near: float
    far: float


def frame_of(forward: Vec, up: Vec) -> tuple[Vec, Vec, Vec]:
    """Right, up and forward as unit vectors."""
    # In plain floats: numpy takes ten times as long for so few numbers, and a frame has many of them.
    f = _unit(forward.tolist())
    r = _cross(f, up.tolist())
    if math.hypot(*r) < 1e-6:
        r = _cross(f, (1.0, 0.0, 0.0) if abs(f[0]) < 0.9 else (0.0, 0.0, 1.0))
    r = _unit(r)
    return np.array(r), np.array(_cross(r, f)), np.array(f)


def _unit(v: Sequence[float]) -> Triple:
    x, y, z = v
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


def _cross(a: Sequence[float], b: Sequence[float]) -> Triple:
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def perspective(
    eye: Vec, axes: tuple[Vec, Vec, Vec], half: tuple[float, float], near: float, far: float
) -> Matrix:
    """Looking along axes[2] with the tangents `half` of the half angles; depth 1 at near, 0 at far.

    Floats are densest at 0: depths turned round are even over the whole range.
    """
    view = np.empty((3, 4))
    view[:, :3] = axes
    view[:, 3] = -view[:, :3] @ eye
    clip = np.empty((4, 4))
    clip[0], clip[1], clip[3] = view[0] / half[0], view[1] / half[1], view[2]
    clip[2] = view[2] * (-near / (far - near))
    clip[2, 3] += far * near / (far - near)
    return clip


def depth_range(mesh: Mesh, eye: Vec, forward: Vec) -> tuple[float, float]:
    """Nearest and farthest depth of the mesh before the eye, a little widened [mm]."""
    z = (mesh.outline - eye) @ forward
    near, far = float(z.min()), float(z.max())
    return max(near - 1.0, 0.5, 1e-3 * far), max(far + 1.0, 2.0)


def shadow_view(light: Light, centre: Vec, mesh: Mesh, size: int, culprit: str) -> ShadowView:
    """The tightest map of `size` texels from the light around the whole mesh.

    Raises DermisError when a point light stands inside the mesh's bounds: one map cannot look all around.
    """
    if isinstance(light, DirectionalLight):
        return parallel_view(np.array(light.direction), mesh, size)
    eye = np.array(light.position) + centre
    points = mesh.outline
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = frame_of(middle - eye, np.array([0.0, 1.0, 0.0]))
    x, y, z = np.array(axes) @ (points - eye).T
    near, far = float(z.min()), float(z.max())
    half = float(np.abs((x / z, y / z)).max()) if near > 0.0 else math.inf
    if near <= 1.0 or half > math.tan(math.radians(_WIDEST_LIGHT_DEGREES)):
        place = [round(c) for c in light.position]
        refuse(
            culprit, "a place outside the head", f"it is at {place} mm", "Move it away or set shadows = false"
        )
    half, near, far = 1.02 * half, 0.98 * near, 1.02 * far
    clip = perspective(eye, axes, (half, half), near, far)
    return ShadowView(clip, 2.0 * half / size, eye, axes[0], axes[1], near, far)


def parallel_view(direction: Vec, mesh: Mesh, size: int) -> ShadowView:
    """The tightest map of `size` texels around the whole mesh in parallel light."""
    points = mesh.outline
    axes = frame_of(direction, np.array([0.0, 1.0, 0.0]))
    local = points @ np.stack(axes, axis=1)
    low, high = local.min(axis=0) - 1.0, local.max(axis=0) + 1.0
    half = 0.51 * float(max(high[0] - low[0], high[1] - low[1]))
    clip = np.eye(4)
    clip[0, :3], clip[1, :3] = axes[0] / half, axes[1] / half
    clip[2, :3] = -axes[2] / (high[2] - low[2])
    clip[0, 3], clip[1, 3] = -0.5 * (low[0] + high[0]) / half, -0.5 * (low[1] + high[1]) / half
    clip[2, 3] = high[2] / (high[2] - low[2])
    middle = 0.5 * (low[0] + high[0]) * axes[0] + 0.5 * (low[1] + high[1]) * axes[1]
    return ShadowView(clip, 2.0 * half / size, middle, axes[0], axes[1], float(low[2]), float(high[2]))
