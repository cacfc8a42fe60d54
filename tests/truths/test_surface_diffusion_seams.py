"""Heat across a uv seam: a cylinder whose seam passes through the light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.surface_diffusion import diffuse_on_surface, welded_surface
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS

Floats = NDArray[np.float64]

RADIUS_MM, HEIGHT_MM, AROUND, ALONG = 5.0, 16.0, 72, 36


def cylinder(seam: int) -> Mesh:
    """Return an open cylinder around the y axis with its uv seam at one of the columns."""
    row, column = np.mgrid[: ALONG + 1, : AROUND + 1]
    position = (column + seam) % AROUND
    angle = 2 * np.pi * position / AROUND
    y = HEIGHT_MM * (row / ALONG - 0.5)
    positions = np.stack((RADIUS_MM * np.sin(angle), y, RADIUS_MM * np.cos(angle)), axis=-1).reshape(-1, 3)
    a = (row * (AROUND + 1) + column)[:-1, :-1].ravel()
    b, c, d = a + 1, a + AROUND + 1, a + AROUND + 2
    triangles = np.vstack((np.column_stack((a, b, d)), np.column_stack((a, d, c))))
    uv = np.column_stack(((column / AROUND).ravel(), (row / ALONG).ravel()))
    return build_mesh(positions, uv, triangles, np.zeros(len(triangles)), SKIN_MATERIALS)


def light(positions: Floats) -> Floats:
    """Return a spot at angle 0, asymmetric about the seam."""
    return np.exp(-((positions - [1.0, 0.5, RADIUS_MM]) ** 2).sum(axis=1, keepdims=True))


def spread(mesh: Mesh) -> Floats:
    """Return the diffused light at the mesh's vertices (v, 1), with the seam welded."""
    surface = welded_surface(mesh)
    return diffuse_on_surface(*surface, light(surface[0]), [2.0])[0][mesh.point]


def test_seams_have_no_effect_wherever_they_are() -> None:
    through, behind = cylinder(0), cylinder(AROUND // 2)
    assert len(through.positions) > through.point.max() + 1
    exact = {
        tuple(p): value for p, value in zip(behind.positions.tolist(), spread(behind)[:, 0], strict=True)
    }
    same = np.array([exact[tuple(p)] for p in through.positions.tolist()])
    assert np.abs(spread(through)[:, 0] - same).max() < 1e-12


def test_an_unwelded_seam_is_an_insulator() -> None:
    """The test above would show this if seams were left open."""
    mesh = cylinder(0)
    cut = diffuse_on_surface(mesh.positions, mesh.triangles, light(mesh.positions.astype(float)), [2.0])[0]
    assert np.abs(cut - spread(mesh)).max() > 0.1 * cut.max()


def test_cylinders_are_flat_to_heat() -> None:
    """The circumference is a strip of 2 pi R, whose cosine decays by exp(-v/2R²)."""
    surface = welded_surface(cylinder(7))
    around = surface[0][:, :1] / RADIUS_MM
    decay = diffuse_on_surface(*surface, around, [2.0])[0] / np.where(np.abs(around) > 0.1, around, np.inf)
    kept = decay[np.abs(around[:, 0]) > 0.1]
    assert np.allclose(kept, np.exp(-2.0 / (2 * RADIUS_MM**2)), rtol=1e-3)
