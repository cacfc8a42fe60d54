"""Homogeneous media that spread light as a curve does, under a matched or a refracting surface.

The table has walks of isotropic scattering and unit extinction, as Mitsuba walks them: how much light comes
back of what entered straight down, and the radii within which shares of it leave (tools/mitsuba_walks.py).
Under a matched surface light that arrives at a slant comes back more often, by a fifth on the mean: there the
energy is that of light from everywhere, as it falls on a head. Refraction makes the two nearly alike.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.tables import numbers, read_rows

Floats = NDArray[np.float64]
TABLE = "mitsuba_walks.csv"
ETAS = (1.0, 1.4)
SHARES = (0.005, 0.01, 0.02, 0.04, *np.round(np.arange(0.07, 0.95, 0.03), 2), 0.955, 0.97, 0.98, 0.99, 0.995)
_LEAST, _MOST, _STEPS = 1e-4, 1e3, 80
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


class Walks(NamedTuple):
    """Of one index of refraction.

    root : (k,) of 1 minus the albedo of single scattering, increasing
    albedo : (k,) share of the light that comes back, decreasing
    log_radius : (k, shares) logarithms of the radii of `SHARES` [mean free paths]
    """

    root: Floats
    albedo: Floats
    log_radius: Floats


class Homogeneous(NamedTuple):
    """A medium of isotropic scattering, for one channel.

    sigma_t : extinction [1/mm]
    albedo : of single scattering
    """

    sigma_t: float
    albedo: float


@cache
def walks(eta: float) -> Walks:
    """The table of an index of refraction of `ETAS`."""
    rows = [row for row in read_rows("dermis.export.targets", TABLE.removesuffix(".csv")) if float(row["eta"]) == eta]
    radii = numbers(rows, " ".join(f"{share:g}" for share in SHARES))
    root, albedo = numbers(rows, "root uniform").T
    return Walks(root, albedo, np.log(radii))


def matching(radii_mm: Floats, share: Floats, energy: float, eta: float) -> Homogeneous:
    """The medium with this energy whose curve is nearest, by squares of the cumulative shares.

    share : (n,) of the light that leaves within radii (n,) [mm], rising to 1
    energy : share of the light that comes back, kept within what the table has
    """
    table = walks(eta)
    root = _root(table, energy)
    spread = _log_radii(table, root)
    at, wanted = np.log(np.maximum(radii_mm, 1e-9)), np.asarray(share, np.float64)
    kept = (wanted > 0.01) & (wanted < 0.99)
    low, high = np.log(_LEAST), np.log(_MOST)

    def fault(shift: float) -> float:
        found = np.interp(at[kept] + shift, spread, SHARES, left=0.0, right=1.0)
        weight = np.gradient(wanted[kept])
        return float((weight * (found - wanted[kept]) ** 2).sum())

    grid = np.linspace(low, high, 200)
    best = int(np.argmin([fault(shift) for shift in grid]))
    shift = _least(fault, grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    return Homogeneous(float(np.exp(shift)), 1.0 - root**2)


def curve_of(medium: Homogeneous, eta: float) -> tuple[Floats, Floats, float]:
    """Radii [mm], shares of the light within them, and the energy that comes back, of a medium."""
    table, root = walks(eta), float(np.sqrt(1.0 - medium.albedo))
    radii = np.exp(_log_radii(table, root)) / medium.sigma_t
    shares = np.concatenate([[0.0], SHARES, [1.0]])
    ends = np.concatenate([[0.0], radii, [radii[-1] ** 2 / radii[-4]]])
    return ends, shares, float(np.interp(root, table.root, table.albedo))


def _root(table: Walks, energy: float) -> float:
    return float(np.interp(energy, table.albedo[::-1], table.root[::-1]))


def _log_radii(table: Walks, root: float) -> Floats:
    return np.array([np.interp(root, table.root, column) for column in table.log_radius.T])


def _least(fault, low: float, high: float) -> float:  # type: ignore[no-untyped-def]
    """Where a function is least between two bounds, by golden sections."""
    for _ in range(_STEPS):
        a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        low, high = (low, b) if fault(a) < fault(b) else (a, high)
        if high - low < 1e-6:
            break
    return 0.5 * (low + high)
