"""Targets of fits: R(r) at points, or the light through rings."""

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
    """R(r) at radii, for profiles that are finite at their centre.

    radius_mm : (n,) increasing, preferably log-spaced from 1e-4 to 60 [mm]
    reflectance : (n, c) R(r) in c channels [1/mm2]
    total : (c,) light that emerges at all radii [-]
    """

    radius_mm: Floats
    reflectance: Floats
    total: Floats

    kind: ClassVar[Literal["pointwise"]] = "pointwise"

    def __post_init__(self) -> None:
        """Check the arrays."""
        _check(self.kind, self.radius_mm, self.reflectance, self.total)
        if not self.radius_mm[0] > 0.0:
            refuse("radii of a profile", "numbers above 0", f"got {self.radius_mm[0]:g}", "Leave it out")

    @cached_property
    def _root(self) -> Floats:
        # The trapezoidal rule in log r converges fast because r^2 R^2 vanishes at both ends.
        steps = np.diff(np.log(self.radius_mm))
        dlog = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
        return np.asarray(self.radius_mm * np.sqrt(dlog))

    @cached_property
    def samples(self) -> Floats:
        """Return values whose squares sum to the integral of r R^2, (n, c)."""
        return self._root[:, None] * self.reflectance

    def design(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """Return the samples of unit Gaussians and their derivatives by log variance, (n, k) each."""
        u = self.radius_mm[:, None] ** 2 / (2.0 * variance_mm2)
        gaussians = self._root[:, None] * np.exp(-u) / (2.0 * np.pi * variance_mm2)
        return gaussians, gaussians * (u - 1.0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """Return E = sqrt(integral of r (fit - R)^2 / integral of r R^2) of a sum of Gaussians, (c,) [-].

        Source: [dEonLuebke2007] section 14.4.
        """
        residual = self.design(variance_mm2)[0] @ weight - self.samples
        return np.asarray(np.sqrt((residual**2).sum(axis=0) / (self.samples**2).sum(axis=0)))

    def mean_radius_at(self, fractions: Sequence[float]) -> Floats:
        """Return radii within which fractions of the channels' mean light emerge, increasing [mm]."""
        rate = self._root[:, None] ** 2 * np.abs(self.reflectance)
        return _quantiles(fractions, self.radius_mm, rate)

    def channel(self, index: int) -> PointTarget:
        """Return the target of one channel."""
        channel = slice(index, index + 1)
        return PointTarget(self.radius_mm, self.reflectance[:, channel], self.total[channel])


@dataclass(frozen=True)
class RingTarget:
    """Light through a disc and the rings around it, also for profiles that are infinite at their centre.

    edges_mm : (n + 1,) increasing, preferably 0 and then log-spaced [mm]
    energy : (n, c) light through each ring in c channels [-]
    total : (c,) light that emerges at all radii [-]
    """

    edges_mm: Floats
    energy: Floats
    total: Floats

    kind: ClassVar[Literal["annulus"]] = "annulus"

    def __post_init__(self) -> None:
        """Check the arrays."""
        _check(self.kind, self.edges_mm[1:], self.energy, self.total)
        if not 0.0 <= self.edges_mm[0] < self.edges_mm[1]:
            refuse("edges of rings", "numbers that increase from 0", f"got {self.edges_mm[:2]}", "Sort them")

    @property
    def samples(self) -> Floats:
        """Return the values whose squared errors are summed, (n, c)."""
        return self.energy

    def design(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """Return the samples of unit Gaussians and their derivatives by log variance, (n, k) each."""
        u = self.edges_mm[:, None] ** 2 / (2.0 * variance_mm2)
        outside = np.exp(-u)
        return -np.diff(outside, axis=0), -np.diff(u * outside, axis=0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """Return `ring_error` of a sum of Gaussians, (c,) [-]."""
        return ring_error(self, self.design(variance_mm2)[0] @ weight)

    def mean_radius_at(self, fractions: Sequence[float]) -> Floats:
        """Return radii within which fractions of the channels' mean light emerge, increasing [mm]."""
        return _quantiles(fractions, self.edges_mm[1:], np.abs(self.energy))

    def channel(self, index: int) -> RingTarget:
        """Return the target of one channel."""
        channel = slice(index, index + 1)
        return RingTarget(self.edges_mm, self.energy[:, channel], self.total[channel])


def ring_error(target: RingTarget, energy: Floats) -> Floats:
    """Return E_b = sqrt(sum of (fit - energy)^2 / sum of energy^2), the error common to all fits, (c,) [-].

    energy : (n, c) of a radially symmetric kernel through each ring, or (n, m, c) of any kernel through the m
        equal sectors of each ring
    """
    cells = energy if energy.ndim == 3 else energy[:, None]
    m = cells.shape[1]
    residual = cells - target.energy[:, None] / m
    return np.asarray(np.sqrt(m * (residual**2).sum(axis=(0, 1)) / (target.energy**2).sum(axis=0)))


def _quantiles(fractions: Sequence[float], radius_mm: Floats, rate: Floats) -> Floats:
    cumulative = np.cumsum(rate / rate.sum(axis=0), axis=0).mean(axis=1)
    return np.asarray(np.interp(fractions, cumulative, radius_mm))


def _check(kind: str, radius_mm: Floats, values: Floats, total: Floats) -> None:
    culprit = f"{kind} target"
    if values.ndim != 2 or radius_mm.shape != values.shape[:1] or total.shape != values.shape[1:]:
        actual = f"got {radius_mm.shape}, {values.shape} and {total.shape}"
        refuse(culprit, "arrays of n, n x c and c numbers", actual, "Correct the arrays")
    if not (np.isfinite(radius_mm).all() and np.isfinite(values).all() and np.isfinite(total).all()):
        refuse(culprit, "finite numbers", "got NaN or infinity", "Correct the arrays")
    if len(radius_mm) < 2 or not (np.diff(radius_mm) > 0.0).all():
        refuse(culprit, "two or more increasing radii", "they do not increase", "Sort them")
    dark = [i for i in range(values.shape[1]) if not (values[:, i].any() and total[i] > 0.0)]
    if dark:
        peak, sum_ = values[:, dark[0]].max(), total[dark[0]]
        actual = f"channel {dark[0]} has a maximum of {peak:.3g} and a sum of {sum_:.3g}"
        advice = "Leave it out, or use another model, another skin or more photons"
        refuse(culprit, "light in every channel", actual, advice)
