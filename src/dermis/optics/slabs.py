"""Light that slabs of a medium return and let through, between two faces that may refract."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.directions import critical_cosine, gaussian_nodes, internal_reflectance

Floats = NDArray[np.float64]
NODES = 16
"""Cosines of those directions that leave a slab, and as many of those that are held back."""
_THINNEST = 1e-6  # optical thickness in which light scatters once at most


@dataclass(frozen=True, eq=False)
class Slabs:
    """What becomes of the power that enters slabs of several thicknesses, from each of m directions.

    cosine : (m,) of entry, below the surface, that light from the air has [-]
    flux : (m,) share of uniform light from the air that enters there; they sum to 1
    back, through : (n, m) share that leaves after it scattered, on the side of entry and on the far one [-]
    """

    cosine: Floats
    flux: Floats
    back: Floats
    through: Floats


def slabs(albedo: float, optical_depth: ArrayLike, eta: float, nodes: int = NODES) -> Slabs:
    """Slabs that scatter isotropically, by adding and doubling; exact but for the number of directions.

    albedo : of single scattering [-]
    optical_depth : (n,) thickness in mean free paths, above 0 [-]
    eta : index of refraction against the air on both sides, at least 1 [-]
    nodes : as `NODES`

    Source: [Chandrasekhar1960] section 50 for what layers do together.
    """
    tau = np.atleast_1d(np.asarray(optical_depth, np.float64))
    times = int(np.ceil(np.log2(max(float(tau.max()) / _THINNEST, 1.0))))
    mu, weight = _cosines(eta, nodes)
    *_, (R, T, straight) = _doubled(albedo, tau / 2.0**times, times, mu, 2.0 * weight * mu)
    return _cut(eta, mu, weight, R, T, straight)


def doubled_slabs(albedo: float, least: ArrayLike, times: int, eta: float, nodes: int = NODES) -> Slabs:
    """`slabs` of the least depths, of twice those and so on: each is on the way to the next.

    least : (n,) optical depths, of about the same size [-]
    times : that they are doubled; there are n (times + 1) slabs, ordered by times, then by `least`
    """
    before = int(np.ceil(np.log2(max(float(np.max(least)) / _THINNEST, 1.0))))
    mu, weight = _cosines(eta, nodes)
    start = np.asarray(least, np.float64) / 2.0**before
    made = list(_doubled(albedo, start, before + times, mu, 2.0 * weight * mu))[before:]
    R, T, straight = (np.concatenate(part) for part in zip(*made, strict=True))
    return _cut(eta, mu, weight, R, T, straight)


def _cut(eta: float, mu: Floats, weight: Floats, R: Floats, T: Floats, straight: Floats) -> Slabs:
    """What slabs between two faces make of light from the air."""
    flux, escapes = 2.0 * weight * mu, mu > critical_cosine(eta)
    back, through = _between_faces(R * flux, T * flux, straight, internal_reflectance(mu, eta), R, T)
    leaving = flux * (1.0 - internal_reflectance(mu, eta))
    entering = leaving[escapes] / leaving[escapes].sum()
    up, down = (np.einsum("k,nkm->nm", leaving, part[..., escapes]) for part in (back, through))
    return Slabs(mu[escapes], entering, up, down)


def _cosines(eta: float, nodes: int) -> tuple[Floats, Floats]:
    """Gaussian nodes and weights below the surface: those that escape, and those that it holds back."""
    critical = critical_cosine(eta)
    spans = [(critical, 1.0), (0.0, critical)] if critical > 0.0 else [(0.0, 1.0)]
    parts = [gaussian_nodes(low, high, nodes) for low, high in spans]
    mu, weight = (np.concatenate(both) for both in zip(*parts, strict=True))
    return mu, weight


def _doubled(
    albedo: float, tau: Floats, times: int, mu: Floats, flux: Floats
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Of slabs so thin, then of ones twice as thick each time: (n, m, m) radiance over pi, back and through,
    per power from each direction; (n, m) unscattered."""
    t = tau[:, None, None]
    a, b = mu[:, None], mu[None, :]
    R = -0.25 * albedo / (a + b) * np.expm1(-t * (1.0 / a + 1.0 / b))
    T = 0.25 * albedo * t / (a * b) * np.exp(-0.5 * t * (1.0 / a + 1.0 / b))
    straight = np.exp(-t[..., 0] / mu)
    yield R, T, straight
    for _ in range(times):
        up, down = R * flux, T * flux + straight[:, :, None] * np.eye(len(mu))
        entering = R * straight[:, None, :]
        between = np.linalg.solve(np.eye(len(mu)) - up @ up, T + up @ entering)
        R, T = R + down @ (up @ between + entering), down @ between + T * straight[:, None, :]
        straight = straight**2
        yield R, T, straight


def _between_faces(
    up: Floats, down: Floats, straight: Floats, held: Floats, R: Floats, T: Floats
) -> tuple[Floats, Floats]:
    """Scattered radiance over pi below the upper and above the lower face, per power that enters.

    up, down : (n, m, m) what the slab makes of radiance: it reflects and scatters it through
    held : (m,) share that a face reflects back into the slab
    """
    if not held.any():
        return R, T
    unit, count = np.eye(len(held)), len(held)
    passing = (down + straight[:, :, None] * unit) * held
    around = np.block([[unit - up * held, -passing], [-passing, unit - up * held]])
    # What has not scattered goes to and fro between the faces by itself.
    once = 1.0 / (1.0 - (straight * held) ** 2)
    below = held * straight * once
    top = R * (once[:, None, :]) + T * below[:, None, :]
    bottom = T * once[:, None, :] + R * below[:, None, :]
    solved = np.linalg.solve(around, np.concatenate([top, bottom], axis=1))
    return solved[:, :count], solved[:, count:]
