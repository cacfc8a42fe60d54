"""Targets of profile fits: samples of R(r), or the light that emerges through rings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from dermis.base.errors import refuse
from dermis.optics.media import Floats


@dataclass(frozen=True)
class PointTarget:
    """Samples of a diffusion profile R(r) that is finite at r = 0, as the target of a fit.

    radius_mm : (n,) radii r, increasing, preferably log-spaced from 1e-4 to 60 [mm]
    reflectance : (n, c) R(r) in c channels [1/mm2]
    total : (c,) light that emerges at all radii [-]
    """

    radius_mm: Floats
    reflectance: Floats
    total: Floats

    kind: ClassVar[Literal["pointwise"]] = "pointwise"

    def __post_init__(self) -> None:
        """Raise DermisError for arrays with wrong shapes or values."""
        _check_target(self.kind, self.radius_mm, self.reflectance, self.total)
        if not self.radius_mm[0] > 0.0:
            refuse("radii of a profile", "numbers above 0", f"got {self.radius_mm[0]:g}", "Leave it out")

    @cached_property
    def _sqrt_quadrature_weights(self) -> Floats:
        # The trapezoidal rule in log r converges fast because r^2 R^2 vanishes at both ends.
        steps = np.diff(np.log(self.radius_mm))
        dlog = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
        return np.asarray(self.radius_mm * np.sqrt(dlog))

    @cached_property
    def samples(self) -> Floats:
        """Return samples (n, c) of R(r), weighted so that their squares sum to the integral of r R(r)^2."""
        return self._sqrt_quadrature_weights[:, None] * self.reflectance

    def design_matrix_and_derivatives(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """Return samples (n, k) of k Gaussians at the n radii of the target, and their derivatives (n, k).

        The integral of each Gaussian over the plane is 1. The samples are weighted like `samples`. The
        derivatives are with respect to the logarithm of the variance.

        variance_mm2 : (k,) variances of the Gaussians [mm2]
        """
        u = self.radius_mm[:, None] ** 2 / (2.0 * variance_mm2)
        gaussians = self._sqrt_quadrature_weights[:, None] * np.exp(-u) / (2.0 * np.pi * variance_mm2)
        return gaussians, gaussians * (u - 1.0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """Return the relative error (c,) of a sum of Gaussians [-].

        It is sqrt(integral of r (fit - R)^2 / integral of r R^2).

        Source: [dEonLuebke2007] section 14.4.
        """
        residual = self.design_matrix_and_derivatives(variance_mm2)[0] @ weight - self.samples
        return np.asarray(np.sqrt((residual**2).sum(axis=0) / (self.samples**2).sum(axis=0)))

    def mean_radius_at(self, light_fractions: Sequence[float]) -> Floats:
        """Return the radii within which given fractions of the light emerge, on average over channels [mm].

        light_fractions : increasing fractions of the light, 0 to 1 [-]
        """
        radial_density = self._sqrt_quadrature_weights[:, None] ** 2 * np.abs(self.reflectance)
        return _radii_at_fractions(light_fractions, self.radius_mm, radial_density)

    def channel(self, channel_index: int) -> PointTarget:
        """Return the target with only one of its channels, to fit this channel separately."""
        channel = slice(channel_index, channel_index + 1)
        return PointTarget(self.radius_mm, self.reflectance[:, channel], self.total[channel])


@dataclass(frozen=True)
class RingTarget:
    """Light that emerges through a disc and the rings around it, as the target of a fit.

    A ring target is also valid for profiles that are infinite at r = 0.

    edges_mm : (n + 1,) radii of the ring edges, increasing, preferably 0 and then log-spaced [mm]
    energy : (n, c) light through each ring in c channels [-]
    total : (c,) light that emerges at all radii [-]
    """

    edges_mm: Floats
    energy: Floats
    total: Floats

    kind: ClassVar[Literal["annulus"]] = "annulus"

    def __post_init__(self) -> None:
        """Raise DermisError for arrays with wrong shapes or values."""
        _check_target(self.kind, self.edges_mm[1:], self.energy, self.total)
        if not 0.0 <= self.edges_mm[0] < self.edges_mm[1]:
            refuse("edges of rings", "numbers that increase from 0", f"got {self.edges_mm[:2]}", "Sort them")

    @property
    def samples(self) -> Floats:
        """Return the light (n, c) through each ring; a fit minimises the sum of its squared errors [-]."""
        return self.energy

    def design_matrix_and_derivatives(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """Return the light (n, k) of k Gaussians through each of the n rings, and its derivatives (n, k).

        The integral of each Gaussian over the plane is 1. The derivatives are with respect to the logarithm
        of the variance.

        variance_mm2 : (k,) variances of the Gaussians [mm2]
        """
        u = self.edges_mm[:, None] ** 2 / (2.0 * variance_mm2)
        outside = np.exp(-u)
        return -np.diff(outside, axis=0), -np.diff(u * outside, axis=0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """Return the relative error (c,) of a sum of Gaussians, as defined by `ring_error` [-]."""
        return ring_error(self, self.design_matrix_and_derivatives(variance_mm2)[0] @ weight)

    def mean_radius_at(self, light_fractions: Sequence[float]) -> Floats:
        """Return the radii within which given fractions of the light emerge, on average over channels [mm].

        light_fractions : increasing fractions of the light, 0 to 1 [-]
        """
        return _radii_at_fractions(light_fractions, self.edges_mm[1:], np.abs(self.energy))

    def channel(self, channel_index: int) -> RingTarget:
        """Return the target with only one of its channels, to fit this channel separately."""
        channel = slice(channel_index, channel_index + 1)
        return RingTarget(self.edges_mm, self.energy[:, channel], self.total[channel])


def ring_error(target: RingTarget, fitted_energy: Floats) -> Floats:
    """Return the relative error (c,) of the light through rings [-].

    It is sqrt(sum of (fit - target)^2 / sum of target^2), summed over all rings.

    fitted_energy : (n, c) light of the fit through each ring; or (n, m, c) light through m equal sectors of
        each ring, for kernels that are not radially symmetric
    """
    cells = fitted_energy if fitted_energy.ndim == 3 else fitted_energy[:, None]
    m = cells.shape[1]
    residual = cells - target.energy[:, None] / m
    return np.asarray(np.sqrt(m * (residual**2).sum(axis=(0, 1)) / (target.energy**2).sum(axis=0)))


def _radii_at_fractions(
    light_fractions: Sequence[float], radius_mm: Floats, radial_density: Floats
) -> Floats:
    cumulative = np.cumsum(radial_density / radial_density.sum(axis=0), axis=0).mean(axis=1)
    return np.asarray(np.interp(light_fractions, cumulative, radius_mm))


def _check_target(
    target_kind: str, radius_mm: Floats, profile_values: Floats, total_reflectance: Floats
) -> None:
    error_subject = f"{target_kind} target"
    if (
        profile_values.ndim != 2
        or radius_mm.shape != profile_values.shape[:1]
        or total_reflectance.shape != profile_values.shape[1:]
    ):
        actual = f"got {radius_mm.shape}, {profile_values.shape} and {total_reflectance.shape}"
        refuse(error_subject, "arrays of n, n x c and c numbers", actual, "Correct the arrays")
    if not (
        np.isfinite(radius_mm).all()
        and np.isfinite(profile_values).all()
        and np.isfinite(total_reflectance).all()
    ):
        refuse(error_subject, "finite numbers", "got NaN or infinity", "Correct the arrays")
    if len(radius_mm) < 2 or not (np.diff(radius_mm) > 0.0).all():
        refuse(error_subject, "two or more increasing radii", "they do not increase", "Sort them")
    dark = [
        i
        for i in range(profile_values.shape[1])
        if not (profile_values[:, i].any() and total_reflectance[i] > 0.0)
    ]
    if dark:
        peak, sum_ = profile_values[:, dark[0]].max(), total_reflectance[dark[0]]
        actual = f"channel {dark[0]} has a maximum of {peak:.3g} and a sum of {sum_:.3g}"
        advice = "Leave it out, or use another model, another skin or more photons"
        refuse(error_subject, "light in every channel", actual, advice)
