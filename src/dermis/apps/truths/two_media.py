"""Monte Carlo: light across the border of two half-spaces side by side, with no diffusion approximation."""

from __future__ import annotations

import numpy as np

from dermis.optics.media import Floats


def exchange(
    sigma_a: Floats, sigma_s_prime: Floats, edges_mm: Floats, photons: int, seed: int = 0, eta: float = 1.4
) -> Floats:
    """(n, n) share of the light entering each strip, straight down, that leaves from each other strip [-].

    The border runs between strips along x = 0; what leaves beyond the outer edges is left out.

    sigma_a, sigma_s_prime : (2,) of the media left and right [1/mm]
    edges_mm : (n + 1,) of the strips, evenly spaced [mm]
    photons : into each strip

    Source: [Wang1995], with a second medium.
    """
    from dermis.apps.truths.half_planes import count_crossings

    sigma_t = np.asarray(sigma_a, np.float64) + sigma_s_prime
    tally = np.zeros((len(edges_mm) - 1,) * 2, np.int64)
    rng = np.random.SeedSequence(seed).generate_state(4, np.uint64).astype(np.uint64)
    count_crossings(photons, sigma_t, sigma_s_prime / sigma_t, eta, edges_mm, rng, tally)
    return np.asarray(tally / photons)
