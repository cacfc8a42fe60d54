"""A sheet with a rolled rim, and light from behind summed along straight lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.irradiance_samples import MeshPoints, sample_irradiance
from dermis.apps.truths.radial_table import GaussianSum as Profile
from dermis.apps.truths.surface_integral import integrate_exitance
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS
from dermis.optics.gaussians import GaussianSum

Floats = NDArray[np.float64]


def hook(thick: float = 2.2, bend: float = 4.5, length: float = 36.0) -> Mesh:
    """Return a sheet along Y whose edge rolls over towards +Z like the helix of an ear."""
    turn = np.linspace(0.0, np.pi, 25)
    ahead = np.column_stack([np.linspace(-16.0, 0.0, 17)[:-1], np.zeros(16)])
    round_ = np.column_stack([bend * np.sin(turn), bend * (1 - np.cos(turn))])
    back = np.column_stack([np.linspace(0.0, -3.0, 5)[1:], np.full(4, 2 * bend)])
    middle = np.vstack([ahead, round_, back])
    way = np.gradient(middle, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    out = np.column_stack([way[:, 1], -way[:, 0]])
    rim = np.linspace(0.0, np.pi, 9)[1:-1, None]
    normal = np.vstack([out, np.cos(rim) * out[-1] + np.sin(rim) * way[-1], -out[::-1]])
    line = np.vstack([middle, np.repeat(middle[-1:], 7, axis=0), middle[::-1]]) + 0.5 * thick * normal
    far = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    rows = np.linspace(-0.5, 0.5, 25) * length
    across, over = np.meshgrid(np.arange(len(line)), rows)
    positions = np.stack([line[across, 0], over, line[across, 1]], axis=-1).reshape(-1, 3)
    normals = np.stack([normal[across, 0], 0 * over, normal[across, 1]], axis=-1).reshape(-1, 3)
    uv = np.stack([0.05 + 0.9 * far[across] / far[-1], 0.5 + 0.9 * over / far[-1]], axis=-1).reshape(-1, 2)
    row, column = (axis.ravel() for axis in np.mgrid[: len(rows) - 1, : len(line) - 1])
    a, b = row * len(line) + column, (row + 1) * len(line) + column
    triangles = np.column_stack((a, b + 1, a + 1, a, b, b + 1)).reshape(-1, 3)
    return build_mesh(positions, uv, triangles, np.zeros(len(triangles)), SKIN_MATERIALS, normals)


def straight(mesh: Mesh, places: Floats, blurred: GaussianSum) -> Floats:
    """Return red light from behind, summed along straight lines."""

    def light(at: MeshPoints) -> Floats:
        normals = at.interpolate(mesh, mesh.normals)
        return np.repeat(np.maximum(-normals[:, 2:], 0.0), 3, axis=1)

    samples = sample_irradiance(mesh, light, 1.0)
    profile = Profile(blurred.weight, blurred.variance_mm2)
    return integrate_exitance(places, samples, profile, 0.005)[:, 0]
