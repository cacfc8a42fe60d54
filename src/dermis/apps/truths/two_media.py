"""Monte Carlo simulation of light across the border of two adjacent half-spaces, compiled by numba.

The left medium fills x < 0 and the right medium x > 0, both below the surface (z > 0). Both scatter
isotropically.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.photon import (
    MAX_PHOTON_EVENTS,
    RandomState,
    random_uniform,
    refract,
    scatter_direction,
)
from dermis.base.compiled import compiled

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]


@compiled
def _trace_photon(x: float, sigma_t: Floats, albedo: Floats, eta: float, rng: RandomState) -> float:
    """Return the x coordinate where a photon leaves through the surface, or NaN if it is absorbed [mm].

    x : x coordinate where the photon enters at normal incidence [mm]
    sigma_t, albedo : (2,) extinction coefficient and single-scattering albedo of the two media
    eta : index of refraction of both media
    """
    z = ux = uy = 0.0
    uz = 1.0
    medium = 0 if x < 0.0 else 1
    depth = -math.log(random_uniform(rng))  # optical depth to the next scattering
    for _ in range(MAX_PHOTON_EVENTS):
        path = depth / sigma_t[medium]
        to_face = -z / uz if uz < 0.0 else math.inf
        to_side = -x / ux if (ux > 0.0 if medium == 0 else ux < 0.0) else math.inf
        if to_side < min(path, to_face):
            x, z = 0.0, z + to_side * uz
            depth -= to_side * sigma_t[medium]
            medium = 1 - medium
        elif to_face < path:
            x, z = x + to_face * ux, 0.0
            depth -= to_face * sigma_t[medium]
            if random_uniform(rng) >= refract(-uz, eta)[0]:
                return x
            uz = -uz
        else:
            x, z = x + path * ux, z + path * uz
            if random_uniform(rng) > albedo[medium]:
                return math.nan
            ux, uy, uz = scatter_direction(ux, uy, uz, 0.0, rng)
            depth = -math.log(random_uniform(rng))
    return math.nan


@compiled
def tally_exits(
    photon_count: int,
    sigma_t: Floats,
    albedo: Floats,
    eta: float,
    edges_mm: Floats,
    rng: RandomState,
    tally: Counts,
) -> None:
    """Trace photons that enter each of n strips of the surface, and count the strips where they leave.

    photon_count : number of photons that enter each strip
    sigma_t, albedo : (2,) extinction coefficient and single-scattering albedo of the two media
    edges_mm : (n + 1,) x coordinates of the strips' edges, evenly spaced [mm]
    tally : (n, n) number of photons that entered strip i (row) and left from strip j (column)
    """
    strip_count = len(edges_mm) - 1
    width = (edges_mm[-1] - edges_mm[0]) / strip_count
    for start in range(strip_count):
        for _ in range(photon_count):
            end = _trace_photon(
                edges_mm[0] + (start + random_uniform(rng)) * width, sigma_t, albedo, eta, rng
            )
            if edges_mm[0] <= end < edges_mm[-1]:
                tally[start, int((end - edges_mm[0]) / width)] += 1


def strip_transfer(
    sigma_a: Floats,
    sigma_s_prime: Floats,
    edges_mm: Floats,
    photon_count: int,
    seed: int = 0,
    eta: float = 1.4,
) -> Floats:
    """Return the fraction (n, n) of the light entering strip i (row) that leaves from strip j (column) [-].

    The strips divide the surface along x, and the border between the media is at x = 0. Light enters at
    normal incidence. Light that leaves beyond the outermost edges is not counted.

    sigma_a, sigma_s_prime : (2,) absorption and reduced scattering coefficient of the two media [1/mm]
    edges_mm : (n + 1,) x coordinates of the strips' edges, evenly spaced [mm]
    photon_count : number of photons that enter each strip

    Source: [Wang1995], with a second medium.
    """
    sigma_t = np.asarray(sigma_a, np.float64) + sigma_s_prime
    tally = np.zeros((len(edges_mm) - 1,) * 2, np.int64)
    rng = np.random.SeedSequence(seed).generate_state(4, np.uint64).astype(np.uint64)
    tally_exits(photon_count, sigma_t, sigma_s_prime / sigma_t, eta, edges_mm, rng, tally)
    return np.asarray(tally / photon_count)
