"""Profiles of homogeneous tissue that the package has counted photons for."""

from __future__ import annotations

from typing import Literal

import numpy as np

from dermis.optics.curve import Curve
from dermis.optics.half_space import ALBEDOS, SOURCES, half_space, kind_under, shares_within
from dermis.optics.media import Medium
from dermis.optics.radial import RadialProfile, light_beyond, radius_grid, ring_edges

Counted = Literal["counted"]
COUNTED: Counted = "counted"
"""Name of the model."""
_LEAST_STEP, _MOST_STEP = 0.05, 0.4  # of log r across which R(r) is told: more where few photons leave
_STEP = 0.02  # by the root of mean free paths over r


def is_counted(medium: Medium) -> bool:
    """Whether tables have a medium: one layer without end, in three channels, under a surface they know."""
    layer = medium.layers[0]
    plain = len(medium.layers) == 1 and medium.semi_infinite and medium.channels == 3
    least, most = ALBEDOS
    told = (layer.alpha_prime >= least) & (layer.alpha_prime <= most)
    return plain and kind_under(medium.eta) is not None and bool(told.all())


def counted_curve(medium: Medium) -> Curve | None:
    """The curve of a medium that tables have, scattering made isotropic; None for others."""
    kind, layer = kind_under(medium.eta), medium.layers[0]
    if kind is None or not is_counted(medium):
        return None
    return half_space(kind, layer.alpha_prime, layer.mean_free_path_mm)


def tabulated_profile(medium: Medium) -> RadialProfile | None:
    """R(r) of a medium that tables have, scattering made isotropic; None for others."""
    curve, kind, layer = counted_curve(medium), kind_under(medium.eta), medium.layers[0]
    if curve is None or kind is None:
        return None
    path, edges, radius = layer.mean_free_path_mm, ring_edges(), radius_grid()
    within = shares_within(kind, layer.alpha_prime, path)
    rings = np.diff(within(edges), axis=0) * curve.energy
    step = np.clip(_STEP * np.sqrt(path.min() / radius), _LEAST_STEP, _MOST_STEP)
    rate = (within(radius * np.exp(step)) - within(radius * np.exp(-step))) / (2.0 * step)[:, None]
    return RadialProfile(
        name=medium.name,
        model=COUNTED,
        radius_mm=radius,
        reflectance=curve.energy * rate / (2.0 * np.pi * radius[:, None] ** 2),
        total=curve.energy,
        edges_mm=edges,
        ring_energy=rings,
        warnings=tuple(light_beyond(curve.energy, rings)),
        sources=(*medium.sources, *SOURCES),
    )
