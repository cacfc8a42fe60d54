"""Random walks of photons through a stack of layers, compiled by numba.

Importing this module loads numba, which takes time, so callers import it inside the function that needs it.

Layers are numbered from 1, topmost first; layer 0 and the layer after the last are air. Face k lies below
layer k.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.compiled import compiled

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
RandomState = NDArray[np.uint64]

MAX_PHOTON_EVENTS = 100_000
"""Scatterings and face crossings after which a photon is dropped; without absorption some never end."""


class LayerStack(NamedTuple):
    """Optical properties of each layer and of the air on both sides, and the depths of the layers' faces.

    The properties are arrays of the shape (layers + 2,), and the depths have the shape (layers + 1,).
    """

    eta: Floats
    sigma_t: Floats
    albedo: Floats
    g: Floats
    face_mm: Floats


class PhotonTally(NamedTuple):
    """Numbers of photons, by how their walks ended.

    reflected : (rings + 1,) photons that left through the top after scattering: one number for each ring
        around the beam, and the last for the area outside all rings
    transmitted : (rings + 1,) photons that left through the bottom after scattering, counted in the same way
    unscattered : (2,) photons that left through the top and the bottom without scattering
    absorbed : (layers,) photons that were absorbed in each layer
    unfinished : (1,) photons that were dropped after `MAX_PHOTON_EVENTS` events
    """

    reflected: Counts
    transmitted: Counts
    unscattered: Counts
    absorbed: Counts
    unfinished: Counts


@compiled
def next_uint64(rng: RandomState) -> np.uint64:
    """Return 64 random bits by xoshiro256++ and advance the state `rng` (4,).

    Source: [BlackmanVigna2021].
    """
    total = rng[0] + rng[3]
    word = ((total << np.uint64(23)) | (total >> np.uint64(41))) + rng[0]
    shifted = rng[1] << np.uint64(17)
    rng[2] ^= rng[0]
    rng[3] ^= rng[1]
    rng[1] ^= rng[2]
    rng[0] ^= rng[3]
    rng[2] ^= shifted
    rng[3] = (rng[3] << np.uint64(45)) | (rng[3] >> np.uint64(19))
    return np.uint64(word)


@compiled
def random_uniform(rng: RandomState) -> float:
    """Return a random number strictly between 0 and 1, so that its logarithm is finite and below 0."""
    return ((next_uint64(rng) >> np.uint64(12)) + 0.5) * 2.0**-52


@compiled
def refract(cosine: float, eta: float) -> tuple[float, float]:
    """Return the Fresnel reflectance of unpolarised light and the cosine of the refracted ray [-].

    For total reflection, the cosine of the refracted ray is returned as 0.

    eta : index of refraction on the near side divided by that on the far side

    Source: [Born1999] section 1.5.
    """
    if eta == 1.0:
        return 0.0, cosine
    sine2 = eta**2 * (1.0 - cosine**2)
    if sine2 >= 1.0:
        return 1.0, 0.0
    beyond = math.sqrt(1.0 - sine2)
    across = (eta * cosine - beyond) / (eta * cosine + beyond)
    along = (cosine - eta * beyond) / (cosine + eta * beyond)
    return 0.5 * (across**2 + along**2), beyond


@compiled
def scatter_direction(x: float, y: float, z: float, g: float, rng: RandomState) -> tuple[float, float, float]:
    """Return a direction sampled from Henyey and Greenstein's phase function about the unit vector (x, y, z).

    g : mean cosine of the scattering angle [-]

    Source: [HenyeyGreenstein1941]; [Marsaglia1972] for the azimuth, [Duff2017] for the coordinate frame.
    """
    while True:
        a, b = 2.0 * random_uniform(rng) - 1.0, 2.0 * random_uniform(rng) - 1.0
        s = a * a + b * b
        if 0.0 < s < 1.0:
            break
    # In the disc s is uniform and independent of the azimuth. This form of the cosine is valid for g = 0 too.
    v = 1.0 - 2.0 * s
    cosine = (v + 0.5 * g * (v * v + 3.0) + g * g * v + 0.5 * g**3 * (v * v - 1.0)) / (1.0 + g * v) ** 2
    sine = math.sqrt(max(1.0 - cosine * cosine, 0.0) / s)
    a, b = a * sine, b * sine
    sign = math.copysign(1.0, z)
    h = -1.0 / (sign + z)
    return (
        a * (1.0 + sign * x * x * h) + b * x * y * h + cosine * x,
        a * sign * x * y * h + b * (sign + y * y * h) + cosine * y,
        -a * sign * x - b * y + cosine * z,
    )


@compiled
def _ring_index(x: float, y: float, squared_ring_edges: Floats) -> int:
    """Return the index of the ring around the axis that contains a point (x, y), or n beyond the last ring.

    squared_ring_edges : (n + 1,) squared radii of the ring edges
    """
    return int(np.searchsorted(squared_ring_edges, x * x + y * y, side="right")) - 1


@compiled
def _tally_exit(
    x: float, y: float, is_upward: bool, scattering_count: int, squared_ring_edges: Floats, tally: PhotonTally
) -> None:
    if scattering_count == 0:
        tally.unscattered[0 if is_upward else 1] += 1
    elif is_upward:
        tally.reflected[_ring_index(x, y, squared_ring_edges)] += 1
    else:
        tally.transmitted[_ring_index(x, y, squared_ring_edges)] += 1


@compiled
def _trace_photon(
    layer_stack: LayerStack, squared_ring_edges: Floats, rng: RandomState, tally: PhotonTally
) -> None:
    """Trace one photon that enters on the axis at normal incidence, and count in the tally how its walk ends.

    squared_ring_edges : (n + 1,) squared radii of the ring edges
    """
    x = y = z = ux = uy = 0.0
    uz = 1.0
    layer, bottom = 1, len(layer_stack.eta) - 2
    scattering_count = 0
    depth = -math.log(random_uniform(rng))  # optical depth to the next scattering
    for _ in range(MAX_PHOTON_EVENTS):
        is_upward = uz < 0.0
        path = depth / layer_stack.sigma_t[layer]
        to_face = (layer_stack.face_mm[layer - 1 if is_upward else layer] - z) / uz
        if path < to_face:
            x, y, z = x + path * ux, y + path * uy, z + path * uz
            if random_uniform(rng) > layer_stack.albedo[layer]:
                tally.absorbed[layer - 1] += 1
                return
            ux, uy, uz = scatter_direction(ux, uy, uz, layer_stack.g[layer], rng)
            depth = -math.log(random_uniform(rng))
            scattering_count += 1
            continue
        x, y = x + to_face * ux, y + to_face * uy
        z = layer_stack.face_mm[layer - 1 if is_upward else layer]
        depth -= to_face * layer_stack.sigma_t[layer]
        beyond = layer - 1 if is_upward else layer + 1
        eta = layer_stack.eta[layer] / layer_stack.eta[beyond]
        F, cosine = refract(abs(uz), eta)
        if F > 0.0 and random_uniform(rng) < F:
            uz = -uz
            continue
        if beyond == 0 or beyond > bottom:
            _tally_exit(x, y, is_upward, scattering_count, squared_ring_edges, tally)
            return
        ux, uy, uz = eta * ux, eta * uy, math.copysign(cosine, uz)
        layer = beyond
    tally.unfinished[0] += 1


@compiled
def trace_photons(
    photon_count: int,
    layer_stack: LayerStack,
    squared_ring_edges: Floats,
    rng: RandomState,
    tally: PhotonTally,
) -> None:
    """Trace a number of photons, and count in the tally how their walks end.

    squared_ring_edges : (n + 1,) squared radii of the ring edges

    Source: [Wang1995]. Unlike there, absorption removes a photon completely or not at all.
    """
    # Weights that shrink at each scattering, as in the source, hardly reduce the variance of R(r) in equal
    # time for skin. Whole photons are integer counts: they conserve energy exactly, their sums do not depend
    # on the order, and their errors are binomial.
    for _ in range(photon_count):
        _trace_photon(layer_stack, squared_ring_edges, rng, tally)
