"""Photon simulation of a half-space below a smooth surface, with oblique incidence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_LEAST_WEIGHT = 0.01


def returned(
    cosine: float, albedo: float, eta: float, photons: int, rings: int = 4, seed: int = 1, g: float = 0.0
) -> tuple[float, float, Floats]:
    """Return the reflectance at an incident cosine, its standard error, and radiance by exit angle.

    The last is (rings,) by the squared exit cosine, in which a diffuse surface is uniform.

    g : mean cosine of scattering
    """
    rng = np.random.default_rng(seed)
    depth, weight = np.zeros(photons), np.ones(photons)
    down = np.full(photons, np.sqrt(1.0 - (1.0 - cosine**2) / eta**2))
    born, given, square = np.arange(photons), np.zeros(photons), np.zeros(rings)
    while len(depth):
        depth = depth - np.log(rng.random(len(depth))) * down
        above = depth < 0.0
        through = above & (rng.random(len(depth)) > fresnel(np.abs(down), eta))
        given[born[through]] += weight[through]
        outside = np.clip(1.0 - eta**2 * (1.0 - down[through] ** 2), 0.0, 1.0)
        square += np.histogram(outside, rings, (0.0, 1.0), weights=weight[through])[0]
        down = np.where(above, -down, down)
        depth = np.abs(depth)  # thrown back inside, the way goes on below
        weight = albedo * weight
        lucky = (weight > _LEAST_WEIGHT) | (rng.random(len(depth)) < 0.1)
        weight = np.where(weight > _LEAST_WEIGHT, weight, 10.0 * weight)
        keep = lucky & ~through
        depth, weight, born = depth[keep], weight[keep], born[keep]
        down = deflected(down[keep], g, rng)
    return float(given.mean()), float(given.std() / np.sqrt(photons)), square / photons


def deflected(down: Floats, g: float, rng: np.random.Generator) -> Floats:
    """Return the cosines after scattering, by the phase function of [HenyeyGreenstein1941]."""
    chance = rng.random(len(down))
    if g == 0.0:
        return np.asarray(2.0 * chance - 1.0)
    cosine = (1.0 + g**2 - ((1.0 - g**2) / (1.0 - g + 2.0 * g * chance)) ** 2) / (2.0 * g)
    sines = np.sqrt(np.maximum((1.0 - cosine**2) * (1.0 - down**2), 0.0))
    turned = down * cosine + sines * np.cos(2.0 * np.pi * rng.random(len(down)))
    return np.asarray(np.clip(turned, -1.0, 1.0))


def fresnel(cosine: Floats, eta: float) -> Floats:
    """Return the reflectance of unpolarised light from inside, 1 for total reflection."""
    sine2 = eta**2 * (1.0 - cosine**2)
    outside = np.sqrt(np.clip(1.0 - sine2, 0.0, None))
    across = (eta * cosine - outside) / (eta * cosine + outside)
    along = (cosine - eta * outside) / (cosine + eta * outside)
    return np.where(sine2 >= 1.0, 1.0, 0.5 * (across**2 + along**2))
