"""Targets of a fit, by which it is also judged: R(r) at points, or the light through rings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from dermis.base.errors import refuse
from dermis.optics.media import Floats


@dataclass(frozen=True)
class Points:
    """R(r) at radii, for profiles that are finite at their centre.

    radius_mm : (n,) increasing, best log-spaced from 1e-4 to 60 [mm]
    reflectance : (n, c) R(r) in c channels [1/mm2]
    total : (c,) light that leaves at all radii together [-]
    """

    radius_mm: Floats
    reflectance: Floats
    total: Floats

    kind: ClassVar[Literal["pointwise"]] = "pointwise"

    def __post_init__(self) -> None:
        _check(self.kind, self.radius_mm, self.reflectance, self.total)
        if not self.radius_mm[0] > 0.0:
            refuse("radii of a profile", "numbers above 0", f"{self.radius_mm[0]:g} came", "Leave it out")

    @cached_property
    def _root(self) -> Floats:
        # The trapezoidal rule in log r converges fast here: r^2 R^2 dies out at both ends.
        steps = np.diff(np.log(self.radius_mm))
        dlog = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
        return np.asarray(self.radius_mm * np.sqrt(dlog))

    @cached_property
    def samples(self) -> Floats:
        """Values whose squares sum to the integral of r R^2, (n, c)."""
        return self._root[:, None] * self.reflectance

    def design(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """What a unit Gaussian adds to the samples, and its slope by the log of its variance, (n, k) each."""
        u = self.radius_mm[:, None] ** 2 / (2.0 * variance_mm2)
        bells = self._root[:, None] * np.exp(-u) / (2.0 * np.pi * variance_mm2)
        return bells, bells * (u - 1.0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """E = sqrt(integral of r (fit - R)^2 / integral of r R^2) of a sum of Gaussians, (c,) [-].

        Source: [dEonLuebke2007] section 14.4.
        """
        residual = self.design(variance_mm2)[0] @ weight - self.samples
        return np.asarray(np.sqrt((residual**2).sum(axis=0) / (self.samples**2).sum(axis=0)))

    def radius_of(self, share: Sequence[float]) -> Floats:
        """Radii within which the channels' mean share of the light leaves, increasing [mm]."""
        rate = self._root[:, None] ** 2 * np.abs(self.reflectance)
        return _quantiles(share, self.radius_mm, rate)

    def channel(self, index: int) -> Points:
        """One channel alone."""
        keep = slice(index, index + 1)
        return Points(self.radius_mm, self.reflectance[:, keep], self.total[keep])


@dataclass(frozen=True)
class Rings:
    """Light through a disc and the rings around it, for profiles that go to infinity at their centre too.

    edges_mm : (n + 1,) increasing, best 0 and then log-spaced [mm]
    energy : (n, c) light through each ring in c channels [-]
    total : (c,) light that leaves at all radii together [-]
    """

    edges_mm: Floats
    energy: Floats
    total: Floats

    kind: ClassVar[Literal["annulus"]] = "annulus"

    def __post_init__(self) -> None:
        _check(self.kind, self.edges_mm[1:], self.energy, self.total)
        if not 0.0 <= self.edges_mm[0] < self.edges_mm[1]:
            refuse("edges of rings", "numbers that increase from 0", f"{self.edges_mm[:2]} came", "Sort them")

    @property
    def samples(self) -> Floats:
        """Values whose squares the error sums, (n, c)."""
        return self.energy

    def design(self, variance_mm2: Floats) -> tuple[Floats, Floats]:
        """What a unit Gaussian adds to the samples, and its slope by the log of its variance, (n, k) each."""
        u = self.edges_mm[:, None] ** 2 / (2.0 * variance_mm2)
        fall = np.exp(-u)
        return -np.diff(fall, axis=0), -np.diff(u * fall, axis=0)

    def error(self, variance_mm2: Floats, weight: Floats) -> Floats:
        """`ring_error` of a sum of Gaussians, (c,) [-]."""
        return ring_error(self, self.design(variance_mm2)[0] @ weight)

    def radius_of(self, share: Sequence[float]) -> Floats:
        """Radii within which the channels' mean share of the light leaves, increasing [mm]."""
        return _quantiles(share, self.edges_mm[1:], np.abs(self.energy))

    def channel(self, index: int) -> Rings:
        """One channel alone."""
        keep = slice(index, index + 1)
        return Rings(self.edges_mm, self.energy[:, keep], self.total[keep])


def ring_error(target: Rings, energy: Floats) -> Floats:
    """E_b = sqrt(sum of (fit - energy)^2 / sum of energy^2), the number that all fits share, (c,) [-].

    energy : (n, c) of a round kernel through each ring, or (n, m, c) of any kernel through the m equal
        sectors of each ring
    """
    cells = energy if energy.ndim == 3 else energy[:, None]
    m = cells.shape[1]
    residual = cells - target.energy[:, None] / m
    return np.asarray(np.sqrt(m * (residual**2).sum(axis=(0, 1)) / (target.energy**2).sum(axis=0)))


def _quantiles(share: Sequence[float], radius_mm: Floats, rate: Floats) -> Floats:
    within = np.cumsum(rate / rate.sum(axis=0), axis=0).mean(axis=1)
    return np.asarray(np.interp(share, within, radius_mm))


def _check(kind: str, radius_mm: Floats, values: Floats, total: Floats) -> None:
    place = f"{kind} target"
    if values.ndim != 2 or radius_mm.shape != values.shape[:1] or total.shape != values.shape[1:]:
        came = f"{radius_mm.shape}, {values.shape} and {total.shape} came"
        refuse(place, "arrays of n, n x c and c numbers", came, "Correct the arrays")
    if not (np.isfinite(radius_mm).all() and np.isfinite(values).all() and np.isfinite(total).all()):
        refuse(place, "finite numbers", "NaN or infinity came", "Correct the arrays")
    if len(radius_mm) < 2 or not (np.diff(radius_mm) > 0.0).all():
        refuse(place, "two or more increasing radii", "they do not increase", "Sort them")
    dark = [i for i in range(values.shape[1]) if not (values[:, i].any() and total[i] > 0.0)]
    if dark:
        peak, sum_ = values[:, dark[0]].max(), total[dark[0]]
        came = f"channel {dark[0]} holds {peak:.3g} at most and {sum_:.3g} in all"
        remedy = "Leave it out, or take another model, another skin or more photons"
        refuse(place, "light in every channel", came, remedy)
