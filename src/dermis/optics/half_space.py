"""Diffusion profiles of homogeneous half-spaces, from tables of Monte Carlo results.

For each of several radii, the tables hold the fraction of simulated photons that leave the half-space
within this radius.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.tables import read_rows
from dermis.optics.cumulative_profile import CumulativeProfile, interpolate_cumulative
from dermis.optics.media import SKIN_ETA, Floats, Medium
from dermis.optics.radial import RadialProfile, missing_light_warnings, radius_grid, ring_edges

HalfSpaceKind = Literal["skin", "matched", "walk"]
"""Name of a tabulated half-space, which states its surface and illumination.

"skin" has a smooth surface and an index of refraction of 1.4, and is lit perpendicularly. "matched" has an
index-matched surface and is also lit perpendicularly. "walk" has an index-matched surface and is lit
uniformly from all directions.
"""

PHOTON_TABLE_SOURCES = ("Wang1995",)
TABULATED_ALBEDO_RANGE = 0.02, 0.99999
"""Smallest and largest single-scattering albedo of the tables [-]."""
_HALF_SPACE_COLUMNS = ("kind", "albedo", "total")
PhotonTableModel = Literal["counted"]
PHOTON_TABLE_MODEL: PhotonTableModel = "counted"
"""Name of the profile model that uses the Monte Carlo tables of this module."""
_MIN_LOG_RADIUS_STEP, _MAX_LOG_RADIUS_STEP = (
    0.05,
    0.4,
)  # step of log r for derivatives: larger where few photons leave
_RELATIVE_LOG_RADIUS_STEP = 0.02  # step of log r, divided by the square root of mean free path / r


class _PhotonTable(NamedTuple):
    """Monte Carlo results for half-spaces as functions of a = sqrt(1 - albedo), interpolated by splines.

    sqrt_absorbed_fraction : (m,) values of a in the table, increasing [-]
    edges : (k,) radii of the ring edges [mean free path]
    fraction : function from a to the fraction of the emerging light within each edge
    totals : function from a to the total reflectance
    """

    sqrt_absorbed_fraction: Floats
    edges: Floats
    fraction: Callable[[Floats], Floats]
    totals: Callable[[Floats], Floats]


def half_space_kind_for_eta(eta: float) -> HalfSpaceKind | None:
    """Return the name of the Monte Carlo table for an index of refraction, or None if there is none.

    Only tables of half-spaces that are lit at normal incidence are considered.

    eta : index of refraction relative to air [-]
    """
    return "skin" if eta == SKIN_ETA else "matched" if eta == 1.0 else None


def half_space(
    half_space_kind: HalfSpaceKind, albedo: ArrayLike, mean_free_path_mm: ArrayLike
) -> CumulativeProfile:
    """Return the cumulative profile of a half-space in three channels from a Monte Carlo table.

    half_space_kind : surface and illumination of the half-space
    albedo : (3,) single-scattering albedo, clamped to the range of the table [-]
    mean_free_path_mm : (3,) mean free path [mm]

    Source: [Wang1995].
    """
    table = _photon_table(half_space_kind)
    return CumulativeProfile.from_function(
        fractions_within(half_space_kind, albedo, mean_free_path_mm),
        table.totals(_table_position(table, albedo)),
    )


def fractions_within(
    half_space_kind: HalfSpaceKind, albedo: ArrayLike, mean_free_path_mm: ArrayLike
) -> Callable[[Floats], Floats]:
    """Return a function from radii (n,) [mm] to tabulated fractions (n, 3) of light within them [-].

    half_space_kind : surface and illumination of the half-space
    albedo : (3,) single-scattering albedo, clamped to the range of the table [-]
    mean_free_path_mm : (3,) mean free path [mm]
    """
    table = _photon_table(half_space_kind)
    fraction = table.fraction(_table_position(table, albedo))
    mean_free_path = np.asarray(mean_free_path_mm, np.float64)

    def fraction_within_radius(radius_mm: Floats) -> Floats:
        columns = [
            interpolate_cumulative(radius_mm / mean_free_path[i], table.edges, fraction[i, :, None])[:, 0]
            for i in range(3)
        ]
        return np.stack(columns, axis=-1)

    return fraction_within_radius


def tabulated_albedo(half_space_kind: HalfSpaceKind, total_reflectance: ArrayLike) -> Floats:
    """Return the single-scattering albedos of half-spaces with given reflectances, from a table [-].

    half_space_kind : surface and illumination of the half-spaces
    """
    table = _photon_table(half_space_kind)
    fine = np.linspace(table.sqrt_absorbed_fraction[0], table.sqrt_absorbed_fraction[-1], 2000)
    root = np.interp(np.asarray(total_reflectance, np.float64), table.totals(fine)[::-1], fine[::-1])
    return np.asarray(1.0 - root**2)


def _table_position(photon_table: _PhotonTable, albedo: ArrayLike) -> Floats:
    return np.clip(
        _sqrt_absorbed_fraction(albedo),
        photon_table.sqrt_absorbed_fraction[0],
        photon_table.sqrt_absorbed_fraction[-1],
    )


def _sqrt_absorbed_fraction(albedo: ArrayLike) -> Floats:
    """Return sqrt(1 - albedo); reflectances and profiles are smooth functions of it, up to an albedo of 1."""
    return np.sqrt(np.maximum(1.0 - np.asarray(albedo, np.float64), 0.0))


@cache
def _photon_table(half_space_kind: HalfSpaceKind) -> _PhotonTable:
    from scipy.interpolate import PchipInterpolator

    rows = [row for row in read_rows("dermis.optics", "data/half_space") if row["kind"] == half_space_kind]
    columns = [name for name in rows[0] if name not in _HALF_SPACE_COLUMNS]
    scale = _sqrt_absorbed_fraction([float(row["albedo"]) for row in rows])
    total = np.array([float(row["total"]) for row in rows])
    fraction = np.array([[float(row[name]) for name in columns] for row in rows])
    order = np.argsort(scale)
    splines: Any = [PchipInterpolator(scale[order], values[order], axis=0) for values in (fraction, total)]
    edges = np.array([0.0, *map(float, columns)])
    fraction_at = lambda position: np.pad(splines[0](position), ((0, 0), (1, 0)))  # noqa: E731
    return _PhotonTable(scale[order], edges, fraction_at, splines[1])


def has_photon_table(medium: Medium) -> bool:
    """Return whether a Monte Carlo table covers a medium.

    The medium must be a half-space with three channels. There must be a table for its index of refraction,
    and its reduced albedos must be in the range of the table.
    """
    layer = medium.layers[0]
    single = len(medium.layers) == 1 and medium.is_semi_infinite and medium.channels == 3
    low, high = TABULATED_ALBEDO_RANGE
    inside = (layer.alpha_prime >= low) & (layer.alpha_prime <= high)
    return single and half_space_kind_for_eta(medium.eta) is not None and bool(inside.all())


def tabulated_cumulative(medium: Medium) -> CumulativeProfile | None:
    """Return the cumulative profile of a medium from a Monte Carlo table, or None if no table covers it.

    The medium is taken to scatter isotropically, with its reduced coefficients.
    """
    kind, layer = half_space_kind_for_eta(medium.eta), medium.layers[0]
    if kind is None or not has_photon_table(medium):
        return None
    return half_space(kind, layer.alpha_prime, layer.mean_free_path_mm)


def tabulated_profile(medium: Medium) -> RadialProfile | None:
    """Return the radial profile of a medium from a Monte Carlo table, or None if no table covers it.

    The medium is taken to scatter isotropically, with its reduced coefficients.
    """
    cumulative, kind, layer = (
        tabulated_cumulative(medium),
        half_space_kind_for_eta(medium.eta),
        medium.layers[0],
    )
    if cumulative is None or kind is None:
        return None
    mean_free_path, edges, radius = layer.mean_free_path_mm, ring_edges(), radius_grid()
    within = fractions_within(kind, layer.alpha_prime, mean_free_path)
    rings = np.diff(within(edges), axis=0) * cumulative.energy
    step = np.clip(
        _RELATIVE_LOG_RADIUS_STEP * np.sqrt(mean_free_path.min() / radius),
        _MIN_LOG_RADIUS_STEP,
        _MAX_LOG_RADIUS_STEP,
    )
    rate = (within(radius * np.exp(step)) - within(radius * np.exp(-step))) / (2.0 * step)[:, None]
    return RadialProfile(
        name=medium.name,
        model=PHOTON_TABLE_MODEL,
        radius_mm=radius,
        reflectance=cumulative.energy * rate / (2.0 * np.pi * radius[:, None] ** 2),
        total=cumulative.energy,
        edges_mm=edges,
        ring_energy=rings,
        warnings=tuple(missing_light_warnings(cumulative.energy, rings)),
        sources=(*medium.sources, *PHOTON_TABLE_SOURCES),
    )
