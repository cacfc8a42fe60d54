"""Surface integrals of light against closed forms and plain quadrature."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from dermis.apps.truths.irradiance_samples import IrradianceSamples, MeshPoints, sample_irradiance
from dermis.apps.truths.radial_table import GaussianSum, Profile, RadialTable
from dermis.apps.truths.surface_integral import integrate_exitance
from dermis.base.errors import DermisError
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.primitives import plane, uv_sphere

Floats = NDArray[np.float64]

ERROR = 1e-3
"""Default error of `integrate_exitance`; results are within a few times this, because of the samples."""

PUBLISHED = GaussianSum(
    np.array(
        [
            [0.233, 0.455, 0.649],
            [0.100, 0.336, 0.344],
            [0.118, 0.198, 0.000],
            [0.113, 0.007, 0.007],
            [0.358, 0.004, 0.000],
            [0.078, 0.000, 0.000],
        ]
    ),
    np.array([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41]),
)


def gaussian(variance: float) -> GaussianSum:
    return GaussianSum(np.ones((1, 3)), np.array([variance]))


def along(x: Floats) -> Floats:
    """Return points on the plane z = 0, along a line that is not an axis."""
    return np.column_stack((x, 0.37 * x + 0.1, np.zeros_like(x)))


def white(values: Floats) -> Floats:
    return np.repeat(values[:, None], 3, axis=1)


def even(places: MeshPoints) -> Floats:
    return np.ones_like(places.positions)


def test_uniform_light_stays_uniform() -> None:
    samples = sample_irradiance(plane(80.0), even, 2.0)
    exitance = integrate_exitance(along(np.linspace(-8.0, 8.0, 200)), samples, PUBLISHED)
    total = np.broadcast_to(PUBLISHED.weight.sum(axis=0), exitance.shape)
    np.testing.assert_allclose(exitance, total, rtol=ERROR)
    assert exitance.mean(axis=0) == pytest.approx(total[0], rel=ERROR / 2)


@pytest.mark.parametrize("variance", [0.0064, 0.187, 7.41])
@pytest.mark.parametrize("frequency", [0.04, 0.12])
def test_waves_are_damped(variance: float, frequency: float) -> None:
    """Each channel has its own phase, so the light is coloured."""

    def waves(places: Floats) -> Floats:
        return np.cos(2.0 * np.pi * frequency * places[:, :1] + np.array([0.0, 1.0, 2.0]))

    samples = sample_irradiance(plane(44.0), lambda places: 1.0 + waves(places.positions), 0.3)
    points = along(np.linspace(-7.0, 7.0, 150))
    exitance = integrate_exitance(points, samples, gaussian(variance))
    damped = 1.0 + np.exp(-2.0 * np.pi**2 * frequency**2 * variance) * waves(points)
    np.testing.assert_allclose(exitance, damped, atol=4.0 * ERROR)


@pytest.mark.parametrize("profile", [gaussian(0.0484), gaussian(1.99), PUBLISHED])
def test_edge_of_light_is_smoothed(profile: GaussianSum) -> None:
    """Samples are refined towards the edge; the light changes over 0.02 mm between the last two."""

    def half(places: MeshPoints) -> Floats:
        return white((places.positions[:, 0] > 0.123).astype(np.float64))

    samples = sample_irradiance(plane(40.0), half, 3.0, min_spacing_mm=0.02)
    x = np.linspace(-4.0, 4.0, 161)
    exitance = integrate_exitance(np.column_stack((x, 0.0 * x, 0.0 * x)), samples, profile)
    reached = ndtr((x[:, None] - 0.123) / np.sqrt(profile.variance_mm2)) @ profile.weight
    np.testing.assert_allclose(exitance, reached, atol=0.06)
    away = np.abs(x - 0.123) > 0.1
    np.testing.assert_allclose(exitance[away], reached[away], atol=0.025)


def test_point_of_light_spreads_as_the_profile() -> None:
    spot = plane(0.002)
    samples = sample_irradiance(spot, even, 1.0)
    r = np.linspace(0.0, 12.0, 61)
    exitance = integrate_exitance(np.column_stack((r, 0.0 * r, 0.0 * r)), samples, PUBLISHED, 1e-5)
    expected = 0.002**2 * PUBLISHED.derivatives(r)[0]
    np.testing.assert_allclose(exitance, expected, rtol=1e-3, atol=1e-9 * expected.max())


def test_thin_parts_transmit_light() -> None:
    """A lit sheet is 1.5 mm behind the point, so each Gaussian is multiplied by exp(-d² / 2v)."""
    samples = sample_irradiance(plane(80.0), even, 2.0)
    exitance = integrate_exitance([[0.3, 0.2, 1.5]], samples, PUBLISHED)
    error_density = np.exp(-(1.5**2) / (2.0 * PUBLISHED.variance_mm2))
    np.testing.assert_allclose(exitance[0], error_density @ PUBLISHED.weight, rtol=2.0 * ERROR, atol=1e-5)


def test_total_light_is_conserved() -> None:
    """The sum of the exitance over a grid, exact for such a smooth spot, is that of the light."""

    def spot(places: Floats) -> Floats:
        return np.exp(-(places**2).sum(axis=1, keepdims=True) / 8.0) * np.array([1.0, 0.7, 0.4])

    samples = sample_irradiance(plane(40.0), lambda places: spot(places.positions), 0.4)
    x = np.arange(-16.0, 16.0, 0.8)
    grid = np.array([[a, b, 0.0] for a in x for b in x])
    leaving = integrate_exitance(grid, samples, PUBLISHED).sum(axis=0)
    np.testing.assert_allclose(leaving, spot(grid).sum(axis=0) * PUBLISHED.weight.sum(axis=0), rtol=3e-3)


@pytest.mark.parametrize(("radius", "variance"), [(5.0, 7.41), (5.0, 0.567), (20.0, 7.41), (2.0, 1.0)])
def test_sphere_harmonics_are_damped_as_predicted(radius: float, variance: float) -> None:
    """With k = R²/v the Gaussian of the chord times P_l integrates to 2 k exp(-k) i_l(k), a Bessel function.

    This is 1 - exp(-2k) for uniform light and 1 + exp(-2k) - (1 - exp(-2k)) / k for light proportional to z.
    """

    def light(places: MeshPoints) -> Floats:
        up = places.positions[:, 2] / radius
        return np.column_stack((np.ones_like(up), 1.0 + up, 0.5 - 0.5 * up))

    samples = sample_irradiance(uv_sphere(radius, 128, 64), light, radius)
    points = samples.positions[:: len(samples.positions) // 300]
    exitance = integrate_exitance(points, samples, gaussian(variance))
    k, up = radius**2 / variance, points[:, 2] / radius
    mean = 1.0 - np.exp(-2.0 * k)
    first = 1.0 + np.exp(-2.0 * k) - mean / k
    if (radius, variance) == (5.0, 7.41):
        assert first == pytest.approx(0.705, abs=5e-4)
    expected = np.column_stack((np.full_like(up, mean), mean + first * up, 0.5 * (mean - first * up)))
    np.testing.assert_allclose(exitance, expected, atol=2.5 * ERROR)


def bumpy() -> IrradianceSamples:
    """Return an uneven patch of coarse triangles under coloured light with a dark side and a stripe."""
    flat = sample_irradiance(plane(30.0), even, 1.3)
    x, y = flat.positions[:, 0], flat.positions[:, 1]
    places = np.column_stack((x, y, 3.0 * np.sin(0.5 * x) * np.cos(0.4 * y)))
    stripe = 4.0 * np.exp(-((x - 2.0) ** 2) / 0.5)
    light = np.column_stack((np.maximum(x, 0.0) + stripe, np.full_like(x, 3.0), np.maximum(-y, 0.0)))
    return IrradianceSamples(places, flat.triangles, light)


def points_on(samples: IrradianceSamples, count: int) -> Floats:
    rng = np.random.default_rng(4)
    chosen = rng.integers(len(samples.triangles), size=count)
    corners = samples.positions[samples.triangles[chosen]]
    points: Floats = np.einsum("nc,nca->na", rng.dirichlet((1.0, 1.0, 1.0), count), corners)
    return points[np.abs(points[:, :2]).max(axis=1) < 12.0]


def plain_sum(points: Floats, samples: IrradianceSamples, R: Callable[[Floats], Floats]) -> Floats:
    """Return sums by Gauss-Legendre quadrature on each triangle, on 400 parts of those near the point."""
    corners = samples.positions[samples.triangles]
    light, area = samples.irradiance[samples.triangles], triangle_areas(corners)
    far = np.linalg.norm(corners[:, None].mean(axis=2) - points[None], axis=2) > 1.8
    result = np.zeros((len(points), 3))
    for i, point in enumerate(points):
        for which, parts in ((far[:, i], 2), (~far[:, i], 20)):
            weights, fractions = square_rule(parts)
            places = weights @ corners[which]
            flux = (weights @ light[which]) * (fractions[:, None] * area[which][:, None, None])
            distance = np.linalg.norm(places - point, axis=2)
            result[i] += (R(distance.ravel()).reshape(flux.shape) * flux).sum(axis=(0, 1))
    return result


def square_rule(parts: int) -> tuple[Floats, Floats]:
    """Return barycentric weights (q, 3) and area fractions (q,) of a square's rule mapped onto a triangle."""
    node, weight = np.polynomial.legendre.leggauss(3)
    at = ((np.arange(parts)[:, None] + 0.5 + 0.5 * node) / parts).ravel()
    w = np.tile(weight / 2.0 / parts, parts)
    a, b = (value.ravel() for value in np.meshgrid(at, at, indexing="ij"))
    error_density = 2.0 * np.outer(w * (1.0 - at), w).ravel()
    return np.column_stack((a, (1.0 - a) * b, (1.0 - a) * (1.0 - b))), error_density


def dipole_like() -> RadialTable:
    """Return a profile that is steep near the axis, with a long exponential tail."""
    r = np.geomspace(0.02, 30.0, 150)
    R = np.exp(-np.outer(r, [0.6, 1.2, 2.0])) / (0.05 + r[:, None] ** 2)
    return RadialTable(r, R)


@pytest.mark.parametrize("profile", [PUBLISHED, dipole_like()], ids=["gaussians", "table"])
def test_octree_matches_the_plain_sum(profile: Profile) -> None:
    samples = bumpy()
    points = points_on(samples, 14)
    exact = plain_sum(points, samples, lambda r: profile.derivatives(r)[0])
    errors = []
    for error in (3e-2, 1e-2, 1e-3, 1e-4):
        difference = integrate_exitance(points, samples, profile, error) - exact
        errors.append(np.sqrt((difference**2).mean(axis=0)) / exact.mean(axis=0))
        assert (errors[-1] < error).all()
    assert (errors[-1] < 0.1 * errors[0]).all()


def test_table_of_a_gaussian_matches_the_gaussian() -> None:
    r = np.linspace(0.0, 8.0, 400)
    table = RadialTable(r, gaussian(0.567).derivatives(r)[0])
    samples, points = bumpy(), points_on(bumpy(), 50)
    by_table = integrate_exitance(points, samples, table, 1e-4)
    np.testing.assert_allclose(
        by_table, integrate_exitance(points, samples, gaussian(0.567), 1e-4), rtol=2e-4, atol=1e-6
    )


def test_channels_without_energy_are_dark() -> None:
    red = GaussianSum(np.array([[1.0, 0.0, 0.0]]), np.array([1.0]))
    exitance = integrate_exitance([[0.0, 0.0, 0.0]], sample_irradiance(plane(20.0), even, 2.0), red)
    np.testing.assert_allclose(exitance, [[1.0, 0.0, 0.0]], atol=ERROR)


def test_several_batches_of_points_are_processed() -> None:
    samples = sample_irradiance(plane(20.0), lambda p: white(10.0 + p.positions[:, 0]), 2.0)
    points = along(np.linspace(-4.0, 4.0, 2500))
    many = integrate_exitance(points, samples, gaussian(0.2), 0.01)
    some = np.concatenate([integrate_exitance(points[i::3], samples, gaussian(0.2), 0.01) for i in range(3)])
    np.testing.assert_array_equal(np.concatenate([many[i::3] for i in range(3)]), some)


@pytest.mark.parametrize(
    ("points", "error", "message"),
    [([[0.0, 0.0]], 1e-3, "points"), ([[np.nan] * 3], 1e-3, "points"), ([[0.0] * 3], 1.0, "error")],
)
def test_wrong_arguments_are_refused(points: list[list[float]], error: float, message: str) -> None:
    samples = sample_irradiance(plane(10.0), even, 5.0)
    with pytest.raises(DermisError, match=message):
        integrate_exitance(points, samples, PUBLISHED, error)


def test_a_dark_profile_is_refused() -> None:
    with pytest.raises(DermisError, match="light in at least one channel"):
        integrate_exitance([[0.0] * 3], bumpy(), GaussianSum(np.zeros((1, 3)), np.ones(1)))
