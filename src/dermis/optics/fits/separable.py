"""Separable kernels a(x) a(y), applied in two passes: not round, and judged as such."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.fits.targets import Rings, ring_error
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

SECTORS = 16
"""Equal sectors of a quarter turn into which each ring is cut."""

_NODES = 8
_STARTS = ((0.3, 0.9), (0.1, 0.6))  # shares of the light within the near and the far Gaussian


@dataclass(frozen=True)
class SeparableKernel:
    """Light spreads by A a(x) a(y), a(x) = sum of weight * exp(-x^2 / 2v) / sqrt(2 pi v).

    albedo : (c,) A, total reflectance [-]
    variance_mm2 : (k, c) narrow to wide [mm2]
    weight : (k, c), sums to 1 in each channel [-]

    Source: [Jimenez2015].
    """

    albedo: Floats
    variance_mm2: Floats
    weight: Floats

    def line(self, offset_mm: ArrayLike) -> Floats:
        """a(x) of one pass, shape (..., c) [1/mm]."""
        x = np.asarray(offset_mm, dtype=np.float64)[..., None, None]
        v = self.variance_mm2
        return np.asarray((self.weight * np.exp(-(x**2) / (2.0 * v)) / np.sqrt(2.0 * np.pi * v)).sum(axis=-2))

    def one_side(self, offset_mm: ArrayLike) -> Floats:
        """Integral of a(x) from 0 to an offset, shape (..., c), up to 1/2 [-]."""
        from scipy.special import erf

        x = np.asarray(offset_mm, dtype=np.float64)[..., None, None]
        return np.asarray(0.5 * (self.weight * erf(x / np.sqrt(2.0 * self.variance_mm2))).sum(axis=-2))

    def cells(self, edges_mm: Floats) -> Floats:
        """Light through the sectors of rings, (n, m, c): all four quarters in one, m = `SECTORS` [-].

        edges_mm : (n + 1,) of the rings
        """
        channels = zip(self.variance_mm2.T, self.weight.T, strict=True)
        return np.asarray(self.albedo * np.stack([_cells(edges_mm, v, w) for v, w in channels], axis=2))


@dataclass(frozen=True)
class SeparableFit:
    """A separable kernel and how well it fits.

    error : (c,) E_b over the cells of rings and sectors [-]
    energy_error : (c,) total reflectance of the kernel over the target's, less 1 [-]
    """

    kernel: SeparableKernel
    error: Floats
    energy_error: Floats


def preintegrate(profile: GaussianSum) -> SeparableKernel:
    """The kernel whose one pass is the profile seen from its side, the integral of R over y.

    It is exact where light changes along x or y alone.

    Source: [Jimenez2015].
    """
    variance = np.broadcast_to(profile.variance_mm2[:, None], profile.weight.shape)
    return SeparableKernel(profile.albedo, variance, profile.weight / profile.albedo)


def judge(kernel: SeparableKernel, target: Rings) -> SeparableFit:
    """A kernel with its errors against a profile."""
    error = ring_error(target, kernel.cells(target.edges_mm))
    return SeparableFit(kernel, error, kernel.albedo / target.total - 1.0)


def fit_separable(target: Rings) -> SeparableFit:
    """The kernel of two Gaussians, near and far, with the target's energy and the least error, per channel.

    Source: [Jimenez2015], the model made for artists.
    """
    found = np.stack([_fit_channel(target.channel(i)) for i in range(len(target.total))], axis=1)
    share, log_variance = found[0], found[1:]
    order = np.argsort(log_variance, axis=0)
    weight = np.take_along_axis(np.stack([share, 1.0 - share]), order, axis=0)
    variance = np.exp(np.take_along_axis(log_variance, order, axis=0))
    return judge(SeparableKernel(target.total, variance, weight), target)


def _fit_channel(target: Rings) -> Floats:
    """Share of the first Gaussian and the log variances of both, (3,)."""
    from scipy.optimize import least_squares

    scale = np.sqrt(SECTORS) / np.linalg.norm(target.energy)

    def residual(x: Floats) -> Floats:
        cells = _cells(target.edges_mm, np.exp(x[1:]), np.array([x[0], 1.0 - x[0]]))
        return np.asarray(scale * (target.total * cells - target.energy / SECTORS).ravel())

    edges = target.edges_mm
    low, high = 2.0 * np.log(edges[1] / 4.0), 2.0 * np.log(edges[-1])
    starts = [np.log(target.radius_of(shares) ** 2 / 2.0) for shares in _STARTS]
    bounds = ([0.0, low, low], [1.0, high, high])
    fits = [
        least_squares(residual, np.append(0.5, np.clip(start, low, high)), bounds=bounds, xtol=1e-10)
        for start in starts
    ]
    return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def _cells(edges_mm: Floats, variance: Floats, weight: Floats) -> Floats:
    """Shares of a(x) a(y) for one channel, (n, m)."""
    cells = np.zeros((len(edges_mm) - 1, SECTORS))
    for i in range(len(variance)):
        cells += weight[i] ** 2 * _elliptic(edges_mm, variance[i], variance[i])
        for j in range(i):
            crossed = _elliptic(edges_mm, variance[i], variance[j])
            cells += weight[i] * weight[j] * (crossed + crossed[:, ::-1])
    return cells


def _elliptic(edges_mm: Floats, along: float, across: float) -> Floats:
    """Shares of a Gaussian with these variances in x and y, (n, m)."""
    x, w = np.polynomial.legendre.leggauss(_NODES)
    theta = np.linspace(0.0, 0.5 * np.pi, SECTORS + 1)
    # The angle on the circle that the ellipse is stretched from: equal shares of it hold equal light.
    phi = np.arctan2(np.sqrt(along) * np.sin(theta), np.sqrt(across) * np.cos(theta))
    half = 0.5 * np.diff(phi)[:, None]
    node = phi[:-1, None] + half * (1.0 + x)
    reach = along * np.cos(node) ** 2 + across * np.sin(node) ** 2
    within = -np.expm1(-(edges_mm[:, None, None] ** 2) / (2.0 * reach))
    return np.asarray(np.diff((within * half * w).sum(axis=2), axis=0) * 2.0 / np.pi)
