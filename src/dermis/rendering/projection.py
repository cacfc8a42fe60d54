"""Matrices from world to clip space for cameras and shadow maps; column vectors, depth 1 near to 0 far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.assets.mesh import Mesh
from dermis.errors import refuse
from dermis.scene.lights import DirectionalLight, Light

Vec = NDArray[np.float64]
Matrix = NDArray[np.float64]
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
    f = forward / np.linalg.norm(forward)
    r = np.cross(f, up)
    if np.linalg.norm(r) < 1e-6:
        r = np.cross(f, np.array([1.0, 0.0, 0.0] if abs(f[0]) < 0.9 else [0.0, 0.0, 1.0]))
    r /= np.linalg.norm(r)
    return r, np.cross(r, f), f


def perspective(
    eye: Vec, axes: tuple[Vec, Vec, Vec], half: tuple[float, float], near: float, far: float
) -> Matrix:
    """Looking along axes[2] with the tangents `half` of the half angles; depth 1 at near, 0 at far.

    Floats are densest at 0: depths turned round are even over the whole range.
    """
    view = _view(eye, axes)
    clip = np.zeros((4, 4))
    clip[0, 0], clip[1, 1] = 1.0 / half[0], 1.0 / half[1]
    clip[2, 2], clip[2, 3] = -near / (far - near), far * near / (far - near)
    clip[3, 2] = 1.0
    return clip @ view


def depth_range(mesh: Mesh, eye: Vec, forward: Vec) -> tuple[float, float]:
    """Nearest and farthest depth of the mesh before the eye, a little widened [mm]."""
    z = (mesh.positions - eye) @ forward
    near, far = float(z.min()), float(z.max())
    return max(near - 1.0, 0.5, 1e-3 * far), max(far + 1.0, 2.0)


def shadow_view(light: Light, centre: Vec, mesh: Mesh, size: int, culprit: str) -> ShadowView:
    """The tightest map of `size` texels from the light around the whole mesh.

    Raises DermisError when a point light stands inside the mesh's bounds: one map cannot look all around.
    """
    if isinstance(light, DirectionalLight):
        return parallel_view(np.array(light.direction), mesh, size)
    eye = np.array(light.position) + centre
    points = mesh.positions.astype(np.float64)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = frame_of(middle - eye, np.array([0.0, 1.0, 0.0]))
    x, y, z = ((points - eye) @ axis for axis in axes)
    steepest = np.tan(np.radians(_WIDEST_LIGHT_DEGREES))
    if z.min() <= 1.0 or max(np.abs(x / z).max(), np.abs(y / z).max()) > steepest:
        place = [round(c) for c in light.position]
        refuse(
            culprit, "a place outside the head", f"it is at {place} mm", "Move it away or set shadows = false"
        )
    half = 1.02 * max(float(np.abs(x / z).max()), float(np.abs(y / z).max()))
    near, far = 0.98 * float(z.min()), 1.02 * float(z.max())
    clip = perspective(eye, axes, (half, half), near, far)
    return ShadowView(clip, 2.0 * half / size, eye, axes[0], axes[1], near, far)


def parallel_view(direction: Vec, mesh: Mesh, size: int) -> ShadowView:
    """The tightest map of `size` texels around the whole mesh in parallel light."""
    points = mesh.positions.astype(np.float64)
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


def _view(eye: Vec, axes: tuple[Vec, Vec, Vec]) -> Matrix:
    view = np.eye(4)
    view[:3, :3] = np.stack(axes)
    view[:3, 3] = -view[:3, :3] @ eye
    return view
