"""Diffusion profiles counted photon by photon, in the form in which the models give theirs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.media import Floats, Medium
from dermis.optics.radial import RadialProfile, light_beyond, ring_edges
from dermis.reference.slab_mc import SlabResult, trace_medium

_NOTABLE_LOSS = 1e-3


def counted_profile(
    medium: Medium,
    rgb: Floats | None = None,
    photons: int = 1_000_000,
    seed: int = 0,
    g: float = 0.0,
    report: Callable[[int, int], None] | None = None,
) -> RadialProfile:
    """R(r) of a medium by Monte Carlo, mean of each ring, with standard errors.

    rgb : (3, c) weights from wavelengths to linear Rec. 709; the result is then per incident power
    photons : traced for each channel or wavelength
    g : mean cosine of the deflection; scattering is raised so that the reduced one stays [-]

    Source: [Wang1995].
    """
    edges = ring_edges()
    runs = trace_medium(medium, photons, seed, g, edges, report)
    entered = 1.0 - normal_reflectance(medium.eta)
    weights = np.eye(medium.channels) / entered if rgb is None else np.asarray(rgb)
    R, error, totals, total_error = (
        np.stack([getattr(run, name) for run in runs])
        for name in ("reflectance", "reflectance_se", "total_reflectance", "total_reflectance_se")
    )
    reflectance = (weights @ R).T
    ring_energy = reflectance * np.pi * np.diff(edges**2)[:, None]
    return RadialProfile(
        name=medium.name,
        model="montecarlo",
        radius_mm=np.concatenate([[2.0 / 3.0 * edges[1]], np.sqrt(edges[1:-1] * edges[2:])]),
        reflectance=reflectance,
        total=weights @ totals,
        edges_mm=edges,
        ring_energy=ring_energy,
        standard_error=np.sqrt(weights**2 @ error**2).T,
        total_error=np.sqrt(weights**2 @ total_error**2),
        incident=rgb is not None,
        warnings=(*light_beyond(weights @ totals, ring_energy), *_losses(runs)),
        sources=(*medium.sources, "Wang1995"),
    )


def _losses(runs: Sequence[SlabResult]) -> list[str]:
    lost = max(run.per_entering.unfinished for run in runs)
    if lost < _NOTABLE_LOSS:
        return []
    return [f"{lost:.1%} of the light was given up after very many scatterings: the total lacks it"]
