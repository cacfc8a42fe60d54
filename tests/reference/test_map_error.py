"""The judge of uv maps, with maps whose fault is known: part of a sphere by longitude and latitude."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import eval_legendre

from dermis.errors import DermisError
from dermis.mesh.primitives import uv_sphere
from dermis.reference.map_error import MapError, map_error, patch_of

Floats = NDArray[np.float64]

RADIUS_MM, SEGMENTS, RINGS = 30.0, 180, 90
MESH = uv_sphere(RADIUS_MM, SEGMENTS, RINGS)
VARIANCES = [1.0, 4.0]
U, V = 0.5, 0.28
"""The middle of the patch: in front, 40 degrees north, where the map is 0.77 as wide as at the equator."""
DEGREE = 20


def on_sphere(u: Floats, v: Floats) -> Floats:
    phi, theta = 2 * np.pi * u, np.pi * v
    return np.stack((-np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)), axis=-1)


PATCH = patch_of(MESH, RADIUS_MM * on_sphere(np.array(U), np.array(V)), 6.0, VARIANCES)
GRID_V, GRID_U = np.meshgrid(
    V + np.linspace(-0.16, 0.16, 121), U + np.linspace(-0.12, 0.12, 151), indexing="ij"
)
STEP_U, STEP_V = (2 * np.pi * RADIUS_MM * 0.24 / 150, np.pi * RADIUS_MM * 0.32 / 120)
"""Size of a texel at the equator [mm]."""
TEXEL_MM2 = (STEP_U * STEP_V * np.sin(np.pi * GRID_V)).ravel()


def texels() -> tuple[NDArray[np.int64], Floats]:
    """Triangle and weights of each texel: of a cell's two triangles, the upper is right of the diagonal."""
    x, y = GRID_U.ravel() * SEGMENTS, GRID_V.ravel() * RINGS
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    x, y = x - column, y - row
    upper = (row - 1) * SEGMENTS + column
    lower = (RINGS - 1) * SEGMENTS + row * SEGMENTS + column
    right = np.column_stack((1 - x, y, x - y))
    left = np.column_stack((1 - y, y - x, x))
    return np.where(x >= y, upper, lower), np.where((x >= y)[:, None], right, left)


def harmonic(direction: Floats, factor: float = 1.0) -> Floats:
    """A constant and a harmonic of degree 20, waves of 9 mm, (..., 2) in two channels."""
    wave = factor * eval_legendre(
        DEGREE, np.stack((direction @ [0.3, 0.4, 0.866], direction @ [0.8, 0.6, 0.0]), -1)
    )
    return 0.5 + np.asarray(wave)


def at_vertices() -> Floats:
    """The irradiance where the patch wants it, read by uv as from a map."""
    triangle, weights = PATCH.vertex_places()
    uv = np.einsum("mi,mij->mj", weights, MESH.uv[MESH.triangles[triangle]])
    return harmonic(on_sphere(uv[:, 0], uv[:, 1]))


def judge(blurred: list[Floats]) -> MapError:
    levels = np.stack([level.reshape(-1, 2) for level in blurred])
    return map_error(PATCH, at_vertices(), VARIANCES, *texels(), levels, TEXEL_MM2)


def blurred_on_map(stretch: Floats) -> list[Floats]:
    """The map blurred along u, then v, rows being `stretch` as wide as at the equator."""
    light = harmonic(on_sphere(GRID_U, GRID_V))
    levels = []
    for variance in VARIANCES:
        sigma = np.sqrt(variance)
        rows = [
            gaussian_filter1d(row, sigma / (STEP_U * s), axis=0)
            for row, s in zip(light, stretch, strict=True)
        ]
        levels.append(gaussian_filter1d(np.stack(rows), sigma / STEP_V, axis=0))
    return levels


def test_texels_are_where_their_uv_says() -> None:
    triangle, weights = texels()
    uv = np.einsum("mi,mij->mj", weights, MESH.uv[MESH.triangles[triangle]])
    assert np.allclose(uv, np.column_stack((GRID_U.ravel(), GRID_V.ravel())), atol=1e-6)


def test_a_blur_that_is_right_has_no_error() -> None:
    """Harmonics decay on a sphere by a known factor; what is left is that of the triangles."""
    exact = [np.exp(-DEGREE * (DEGREE + 1) * v / (2 * RADIUS_MM**2)) for v in VARIANCES]
    error = judge([harmonic(on_sphere(GRID_U, GRID_V), factor) for factor in exact])
    assert (error.relative_rmse < 0.003).all()
    assert np.allclose(error.energy_ratio, 1, atol=0.001)
    assert (error.worst < 0.01).all()
    centre = np.linalg.norm(RADIUS_MM * on_sphere(GRID_U, GRID_V).reshape(-1, 3) - PATCH.centre_mm, axis=1)
    assert np.mean((centre <= 6.0) == error.judged) > 0.99 and error.heat.shape[1] == error.judged.sum()


def test_a_blur_that_is_too_weak_or_too_bright_has_that_error() -> None:
    unblurred = harmonic(on_sphere(GRID_U, GRID_V))
    exact = [np.exp(-DEGREE * (DEGREE + 1) * v / (2 * RADIUS_MM**2)) for v in VARIANCES]
    truth = [harmonic(on_sphere(GRID_U, GRID_V), factor) for factor in exact]
    assert np.allclose(judge([1.1 * level for level in truth]).relative_rmse, 0.1, atol=0.003)
    assert np.allclose(judge([1.1 * level for level in truth]).energy_ratio, 1.1, atol=0.002)
    error, area = judge([unblurred, unblurred]), TEXEL_MM2[:, None]
    for level, true in enumerate(truth):
        lost = (area * (unblurred - true).reshape(-1, 2) ** 2)[error.judged].sum()
        kept = (area * true.reshape(-1, 2) ** 2)[error.judged].sum()
        assert error.relative_rmse[level] == pytest.approx(np.sqrt(lost / kept), rel=0.02)


def test_stretch_correction_on_the_map_pays() -> None:
    rows = np.sin(np.pi * GRID_V[:, 0])
    corrected, plain = judge(blurred_on_map(rows)), judge(blurred_on_map(np.ones_like(rows)))
    assert (corrected.relative_rmse < 0.01).all()
    assert (plain.relative_rmse > 4 * corrected.relative_rmse).all()


def test_levels_that_the_patch_is_too_coarse_for_are_refused() -> None:
    with pytest.raises(DermisError, match="half of the least sigma"):
        map_error(PATCH, at_vertices(), [0.01, 4.0], *texels(), np.ones((2, len(TEXEL_MM2), 2)))


def test_texels_elsewhere_and_arrays_that_do_not_fit_are_refused() -> None:
    triangle, weights = texels()
    levels = np.ones((2, len(triangle), 2))
    with pytest.raises(DermisError, match=r"none of 18271 lies within 6 mm"):
        map_error(PATCH, at_vertices(), VARIANCES, 0 * triangle, weights, levels)
    with pytest.raises(DermisError, match=r"texels \(m,\)"):
        map_error(PATCH, at_vertices(), VARIANCES, triangle, weights, levels[:1])
