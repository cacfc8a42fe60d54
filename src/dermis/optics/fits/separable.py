"""Separable kernels a(x) a(y) for blurs in two passes, fitted to radially symmetric diffusion profiles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.fits.targets import RingTarget, ring_error
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

SECTORS_PER_QUADRANT = 16
"""Number of equal sectors in each quarter of a ring."""

_QUADRATURE_NODES = 8
_START_LIGHT_FRACTIONS = (
    (0.3, 0.9),
    (0.1, 0.6),
)  # light within the radii that set the two variances of a start


@dataclass(frozen=True)
class SeparableKernel:
    """Kernel A a(x) a(y), where a(x) is a sum of w exp(-x^2 / 2v) / sqrt(2 pi v); not radially symmetric.

    albedo : (c,) total reflectance A [-]
    variance_mm2 : (k, c) variances v of the k Gaussians, in increasing order [mm2]
    weight : (k, c) weights w, which sum to 1 in each channel [-]

    Source: [Jimenez2015].
    """

    albedo: Floats
    variance_mm2: Floats
    weight: Floats

    def half_line_integral(self, offset_mm: ArrayLike) -> Floats:
        """Return the integral (..., c) of a(x) from 0 to an offset, at most 1/2 [-]."""
        from scipy.special import erf

        x = np.asarray(offset_mm, dtype=np.float64)[..., None, None]
        return np.asarray(0.5 * (self.weight * erf(x / np.sqrt(2.0 * self.variance_mm2))).sum(axis=-2))

    def sector_energy(self, edges_mm: Floats) -> Floats:
        """Return the light (n, SECTORS_PER_QUADRANT, c) through equal sectors of n rings [-].

        Each quadrant of a ring is divided into SECTORS_PER_QUADRANT sectors, and the light of corresponding
        sectors in the four quadrants is added.

        edges_mm : (n + 1,) radii of the ring edges [mm]
        """
        channels = zip(self.variance_mm2.T, self.weight.T, strict=True)
        sectors = np.stack([_sector_fractions(edges_mm, v, w) for v, w in channels], axis=2)
        return np.asarray(self.albedo * sectors)


@dataclass(frozen=True)
class SeparableFit:
    """Separable kernel with its errors relative to a diffusion profile.

    kernel : the separable kernel
    error : (c,) relative root-mean-square error of the light through sectors of rings [-]
    energy_error : (c,) relative error of the total reflectance [-]
    """

    kernel: SeparableKernel
    error: Floats
    energy_error: Floats


def preintegrated_kernel(profile: GaussianSum) -> SeparableKernel:
    """Return the separable kernel whose a(x) is the integral of a profile over y, normalised to 1.

    The kernel is exact where light varies only along x or only along y.

    Source: [Jimenez2015].
    """
    variance = np.broadcast_to(profile.variance_mm2[:, None], profile.weight.shape)
    return SeparableKernel(profile.albedo, variance, profile.weight / profile.albedo)


def evaluate_kernel(kernel: SeparableKernel, target: RingTarget) -> SeparableFit:
    """Return a separable kernel together with its errors relative to a diffusion profile.

    target : light of the profile that emerges through concentric rings around a narrow beam
    """
    error = ring_error(target, kernel.sector_energy(target.edges_mm))
    return SeparableFit(kernel, error, kernel.albedo / target.total - 1.0)


def fit_separable(target: RingTarget) -> SeparableFit:
    """Fit a separable kernel of two Gaussians to the light through concentric rings around a narrow beam.

    The total reflectance of each channel is that of `target`; only the variances and weights are fitted.

    Source: [Jimenez2015], the artist-friendly model.
    """
    parameters = np.stack([_fit_channel_kernel(target.channel(i)) for i in range(len(target.total))], axis=1)
    fraction, log_variance = parameters[0], parameters[1:]
    order = np.argsort(log_variance, axis=0)
    weight = np.take_along_axis(np.stack([fraction, 1.0 - fraction]), order, axis=0)
    variance = np.exp(np.take_along_axis(log_variance, order, axis=0))
    return evaluate_kernel(SeparableKernel(target.total, variance, weight), target)


def _fit_channel_kernel(target: RingTarget) -> Floats:
    """Fit a separable kernel of two Gaussians to a target with one channel; return its parameters (3,).

    The parameters are the weight of the first Gaussian and the logarithms of both variances.
    """
    from scipy.optimize import least_squares

    scale = np.sqrt(SECTORS_PER_QUADRANT) / np.linalg.norm(target.energy)

    def sector_residuals(unknowns: Floats) -> Floats:
        cells = _sector_fractions(
            target.edges_mm, np.exp(unknowns[1:]), np.array([unknowns[0], 1.0 - unknowns[0]])
        )
        return np.asarray(scale * (target.total * cells - target.energy / SECTORS_PER_QUADRANT).ravel())

    edges = target.edges_mm
    low, high = 2.0 * np.log(edges[1] / 4.0), 2.0 * np.log(edges[-1])
    starts = [np.log(target.mean_radius_at(fractions) ** 2 / 2.0) for fractions in _START_LIGHT_FRACTIONS]
    bounds = ([0.0, low, low], [1.0, high, high])
    fits = [
        least_squares(sector_residuals, np.append(0.5, np.clip(start, low, high)), bounds=bounds, xtol=1e-10)
        for start in starts
    ]
    return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def _sector_fractions(edges_mm: Floats, variance: Floats, weight: Floats) -> Floats:
    """Return the fraction (n, SECTORS_PER_QUADRANT) of a kernel a(x) a(y) in each sector of n rings [-].

    The kernel has one channel and the integral 1. Sectors are those of `SeparableKernel.sector_energy`.

    edges_mm : (n + 1,) radii of the ring edges [mm]
    variance, weight : (k,) variances [mm2] and weights of the Gaussians whose sum is a(x)
    """
    cells = np.zeros((len(edges_mm) - 1, SECTORS_PER_QUADRANT))
    for i in range(len(variance)):
        cells += weight[i] ** 2 * _elliptic_sector_fractions(edges_mm, variance[i], variance[i])
        for j in range(i):
            crossed = _elliptic_sector_fractions(edges_mm, variance[i], variance[j])
            cells += weight[i] * weight[j] * (crossed + crossed[:, ::-1])
    return cells


def _elliptic_sector_fractions(edges_mm: Floats, variance_x_mm2: float, variance_y_mm2: float) -> Floats:
    """Return the fraction (n, SECTORS_PER_QUADRANT) of an elliptic Gaussian in each sector of n rings [-].

    Sectors are those of `SeparableKernel.sector_energy`.

    edges_mm : (n + 1,) radii of the ring edges [mm]
    variance_x_mm2, variance_y_mm2 : variances along x and y [mm2]
    """
    x, w = np.polynomial.legendre.leggauss(_QUADRATURE_NODES)
    theta = np.linspace(0.0, 0.5 * np.pi, SECTORS_PER_QUADRANT + 1)
    # Angle on the circle before it is stretched to the ellipse: equal angles contain equal light.
    phi = np.arctan2(np.sqrt(variance_x_mm2) * np.sin(theta), np.sqrt(variance_y_mm2) * np.cos(theta))
    half = 0.5 * np.diff(phi)[:, None]
    node = phi[:-1, None] + half * (1.0 + x)
    variance = variance_x_mm2 * np.cos(node) ** 2 + variance_y_mm2 * np.sin(node) ** 2
    within = -np.expm1(-(edges_mm[:, None, None] ** 2) / (2.0 * variance))
    return np.asarray(np.diff((within * half * w).sum(axis=2), axis=0) * 2.0 / np.pi)
