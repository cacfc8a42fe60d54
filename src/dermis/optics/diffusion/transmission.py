"""Colour of light that comes through a thickness of skin."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.errors import refuse
from dermis.optics.diffusion import hankel, layered_diffusion, multipole
from dermis.optics.diffusion.boundary import mismatch, normal_reflectance
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats, Medium


def through_gaussians(profile: GaussianSum, thickness_mm: ArrayLike) -> Floats:
    """What the profile itself lets through from an evenly lit far side, (n, 3) [-].

    A Gaussian at a distance of sqrt(r^2 + d^2) is exp(-d^2 / 2v) G(v, r), v being the variance: each weight
    falls by that factor.

    Source: [dEonLuebke2007] section 14.5.
    """
    d = np.asarray(thickness_mm, dtype=np.float64)[..., None]
    return np.asarray(np.exp(-(d**2) / (2.0 * profile.variance_mm2)) @ profile.weight)


def through_slab(
    medium: Medium, thickness_mm: ArrayLike, model: Literal["layered", "multipole"] = "layered"
) -> Floats:
    """Transmittance of the medium cut at each thickness, per power that enters, (n, c) [-].

    model : layered diffusion lets what meets no event pass, by the reduced extinction; the multipole
        scatters all light at one depth, and errs where a cut leaves a layer thinner than a mean free path

    Source: [DonnerJensen2005] eq. 7, 8 for the multipole.
    """
    found = []
    for thickness in np.atleast_1d(np.asarray(thickness_mm, dtype=np.float64)):
        slab = cut(medium, float(thickness))
        if model == "layered":
            depth = sum(layer.sigma_t_prime * layer.thickness_mm for layer in slab.layers)
            straight = (1.0 - normal_reflectance(medium.eta)) * np.exp(-depth)
            diffuse = layered_diffusion.respond(hankel.STILL, slab, mismatch(medium.eta, "exact"))[1][0]
            found.append(diffuse + straight)
        else:
            found.append(multipole.respond(hankel.STILL, slab, mismatch(medium.eta)).T_down[0])
    return np.stack(found)


def cut(medium: Medium, thickness_mm: float) -> Medium:
    """The medium's upper part, or all of it if it is thinner, with air below [mm]."""
    if not 0.0 < thickness_mm < np.inf:
        refuse("thickness", "a length above 0 mm", f"{thickness_mm:g} came", "Correct it")
    kept, left = [], thickness_mm
    for layer in medium.layers:
        kept.append(replace(layer, thickness_mm=min(layer.thickness_mm, left)))
        left -= layer.thickness_mm
        if left <= 0.0:
            break
    return replace(medium, layers=tuple(kept))
