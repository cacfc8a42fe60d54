"""Monte Carlo simulation of a pencil beam through a stack of scattering layers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from threading import Event
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.base.quantities import checked_integer
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium
from dermis.optics.radial import RadialProfile, missing_light_warnings, ring_edges

if TYPE_CHECKING:
    from dermis.apps.truths.photon import Counts, LayerStack, PhotonTally


ProgressCallback = Callable[[int, int], None]

PHOTON_BATCH_COUNT = 64
"""Number of batches with their own random numbers, so the result does not depend on the number of threads."""

MAX_PHOTONS = 10**10

_MAX_SEED = 2**63 - 1
_PHOTONS_PER_CALL = 20_000  # between two checks for Ctrl-C
_MIN_REPORTED_UNFINISHED_FRACTION = 1e-3  # fraction of dropped photons from which on a warning reports it


def default_ring_edges() -> Floats:
    """Return the default radii of ring edges: 0, and a geometric series from 0.001 mm to 40 mm [mm]."""
    return np.concatenate([[0.0], np.geomspace(1e-3, 40.0, 93)])


def trace_slab(
    layers: Sequence[ScatteringLayer],
    photons: int = 1_000_000,
    seed: int = 0,
    edges_mm: Floats | None = None,
    progress: ProgressCallback | None = None,
) -> SlabResult:
    """Trace a pencil beam at normal incidence through a stack of layers in air.

    layers : layers, topmost first; interfaces between unequal indices of refraction reflect and refract
    photons : number of photons; standard errors are proportional to 1 / sqrt(photons)
    seed : random seed; the results do not depend on the number of processors
    edges_mm : (n + 1,) radii of the ring edges, from 0; None for `default_ring_edges` [mm]
    progress : function called with the number of finished batches and the number of all batches

    Source: [Wang1995].
    """
    photons = _checked_photon_count(layers, photons, seed)
    edges = default_ring_edges() if edges_mm is None else _checked_edges(edges_mm)
    tally = _trace_batches(_layer_stack(layers), photons, seed, edges, progress)
    return _slab_result(tally, photons, edges, layers[0].eta)


def trace_medium(
    medium: Medium,
    photons: int = 1_000_000,
    seed: int = 0,
    g: float = 0.0,
    edges_mm: Floats | None = None,
    progress: ProgressCallback | None = None,
) -> list[SlabResult]:
    """Run `trace_slab` for each channel of a medium, with independent random numbers.

    g : mean cosine of the scattering angle in all layers; the scattering coefficient is the reduced
        scattering coefficient divided by 1 - g [-]
    """
    check_anisotropy(g)
    results: list[SlabResult] = []

    def report_channel(traced_photons: int, channel_photons: int) -> None:
        if progress is not None:
            progress(len(results) * channel_photons + traced_photons, medium.channels * channel_photons)

    for i in range(medium.channels):
        layers = [_scattering_layer(layer, i, g, medium.eta) for layer in medium.layers]
        results.append(trace_slab(layers, photons, seed + i, edges_mm, report_channel))
    return results


def monte_carlo_profile(
    medium: Medium,
    rgb: Floats | None = None,
    photons: int = 1_000_000,
    seed: int = 0,
    g: float = 0.0,
    progress: Callable[[int, int], None] | None = None,
) -> RadialProfile:
    """Return the diffusion profile of a medium by Monte Carlo, averaged over rings, with standard errors.

    rgb : (3, c) weights that convert wavelengths to linear Rec. 709; the profile is then relative to the
        incident power. None for a profile of the medium's channels, relative to the power that enters
    photons : number of photons per channel or wavelength
    g : mean cosine of the scattering angle; the reduced scattering coefficient does not depend on it [-]

    Source: [Wang1995].
    """
    edges = ring_edges()
    runs = trace_medium(medium, photons, seed, g, edges, progress)
    entering_fraction = 1.0 - normal_reflectance(medium.eta)
    weights = np.eye(medium.channels) / entering_fraction if rgb is None else np.asarray(rgb)
    reflectance_mean, error, total_mean, total_error = (
        np.stack([getattr(run, name) for run in runs])
        for name in ("reflectance", "reflectance_se", "total_reflectance", "total_reflectance_se")
    )
    reflectance = (weights @ reflectance_mean).T
    ring_energy = reflectance * np.pi * np.diff(edges**2)[:, None]
    return RadialProfile(
        name=medium.name,
        model="montecarlo",
        radius_mm=np.concatenate([[2.0 / 3.0 * edges[1]], np.sqrt(edges[1:-1] * edges[2:])]),
        reflectance=reflectance,
        total=weights @ total_mean,
        edges_mm=edges,
        ring_energy=ring_energy,
        standard_error=np.sqrt(weights**2 @ error**2).T,
        total_error=np.sqrt(weights**2 @ total_error**2),
        incident=rgb is not None,
        warnings=(*missing_light_warnings(weights @ total_mean, ring_energy), *_unfinished_warnings(runs)),
        sources=(*medium.sources, "Wang1995"),
    )


def _unfinished_warnings(channel_results: Sequence[SlabResult]) -> list[str]:
    lost = max(run.relative_to_entering.unfinished for run in channel_results)
    if lost < _MIN_REPORTED_UNFINISHED_FRACTION:
        return []
    return [f"{lost:.1%} of the light was dropped after very many scatterings and is missing from the total"]


def _scattering_layer(layer: Layer, channel_index: int, g: float, eta: float) -> ScatteringLayer:
    sigma_s = float(layer.sigma_s_prime[channel_index]) / (1.0 - g)
    return ScatteringLayer(float(layer.sigma_a[channel_index]), sigma_s, layer.thickness_mm, g, eta)


def _checked_photon_count(layers: Sequence[ScatteringLayer], photons: int, seed: int) -> int:
    if not layers:
        refuse("slab", "at least one layer", "got none", "Add one")
    if np.isinf([layer.thickness_mm for layer in layers[:-1]]).any():
        refuse("slab", "an infinite last layer only", "another layer is infinite", "Correct it")
    checked_integer("seed", seed, 0, _MAX_SEED)
    return checked_integer("photons", photons, 1, int(MAX_PHOTONS))


def _checked_edges(edges_mm: ArrayLike) -> Floats:
    edges = np.asarray(edges_mm, dtype=np.float64)
    one_row = edges.ndim == 1 and len(edges) > 1
    if not (one_row and edges[0] == 0.0 and np.isfinite(edges).all() and (np.diff(edges) > 0.0).all()):
        expected = "increasing edges of rings from 0 on [mm]"
        refuse("edges_mm", expected, f"got {np.array2string(edges, threshold=8)}", "Correct them")
    return edges


def _layer_stack(layers: Sequence[ScatteringLayer]) -> LayerStack:
    from dermis.apps.truths.photon import LayerStack

    def padded_with_air(air_value: float, layer_values: list[float]) -> Floats:
        return np.array([air_value, *layer_values, air_value])

    return LayerStack(
        eta=padded_with_air(1.0, [layer.eta for layer in layers]),
        sigma_t=padded_with_air(0.0, [layer.sigma_t for layer in layers]),
        albedo=padded_with_air(0.0, [layer.albedo for layer in layers]),
        g=padded_with_air(0.0, [layer.g for layer in layers]),
        face_mm=np.cumsum([0.0, *(layer.thickness_mm for layer in layers)]),
    )


def _trace_batches(
    layer_stack: LayerStack, photons: int, seed: int, ring_edges_mm: Floats, progress: ProgressCallback | None
) -> PhotonTally:
    from numba import config

    from dermis.apps.truths.photon import PhotonTally, trace_photons

    stop = Event()

    def trace_batch(photon_count: int, seeds: np.random.SeedSequence) -> PhotonTally:
        lengths = (len(ring_edges_mm), len(ring_edges_mm), 2, len(layer_stack.eta) - 2, 1)
        tally = PhotonTally(*(np.zeros(length, np.int64) for length in lengths))
        rng = seeds.generate_state(4, np.uint64).astype(np.uint64)
        for done in range(0, photon_count, _PHOTONS_PER_CALL):
            if stop.is_set():
                break
            trace_photons(
                min(_PHOTONS_PER_CALL, photon_count - done), layer_stack, ring_edges_mm**2, rng, tally
            )
        return tally

    sizes = [
        photons * (i + 1) // PHOTON_BATCH_COUNT - photons * i // PHOTON_BATCH_COUNT
        for i in range(PHOTON_BATCH_COUNT)
    ]
    tallies = []
    # The compiled function releases the GIL, so threads run in parallel.
    with ThreadPoolExecutor(config.NUMBA_NUM_THREADS) as pool:
        try:
            for tally in pool.map(trace_batch, sizes, np.random.SeedSequence(seed).spawn(PHOTON_BATCH_COUNT)):
                tallies.append(tally)
                if progress is not None:
                    progress(len(tallies), PHOTON_BATCH_COUNT)
        finally:
            stop.set()  # otherwise the pool would wait for the remaining batches
    return PhotonTally(*(np.sum(parts, axis=0) for parts in zip(*tallies, strict=True)))


def _slab_result(tally: PhotonTally, photons: int, ring_edges_mm: Floats, eta: float) -> SlabResult:
    from dermis.apps.truths.photon import refract

    specular = refract(1.0, 1.0 / eta)[0]
    ring_areas = np.pi * np.diff(ring_edges_mm**2)

    def power_fraction(photon_counts: Counts) -> Floats:
        return (1.0 - specular) * photon_counts / photons

    def standard_error(photon_counts: Counts) -> Floats:
        p = photon_counts / photons
        return (1.0 - specular) * np.sqrt(p * (1.0 - p) / photons)

    reflected, transmitted = tally.reflected, tally.transmitted
    return SlabResult(
        photons=photons,
        edges_mm=ring_edges_mm,
        specular=specular,
        reflectance=power_fraction(reflected[:-1]) / ring_areas,
        reflectance_se=standard_error(reflected[:-1]) / ring_areas,
        transmittance=power_fraction(transmitted[:-1]) / ring_areas,
        transmittance_se=standard_error(transmitted[:-1]) / ring_areas,
        total_reflectance=float(power_fraction(reflected.sum())),
        total_reflectance_se=float(standard_error(reflected.sum())),
        total_transmittance=float(power_fraction(transmitted.sum())),
        total_transmittance_se=float(standard_error(transmitted.sum())),
        overflow_reflectance=float(power_fraction(reflected[-1])),
        overflow_transmittance=float(power_fraction(transmitted[-1])),
        unscattered_reflectance=float(power_fraction(tally.unscattered[0])),
        unscattered_transmittance=float(power_fraction(tally.unscattered[1])),
        absorbed=power_fraction(tally.absorbed),
        absorbed_se=standard_error(tally.absorbed),
        unfinished=float(power_fraction(tally.unfinished[0])),
    )


def check_anisotropy(g: float) -> None:
    """Raise DermisError unless the mean cosine g of the scattering angle lies between -1 and 1."""
    if not -1.0 < g < 1.0:
        refuse("scattering", "a mean cosine between -1 and 1", f"got {g:g}", "Correct it")


@dataclass(frozen=True)
class ScatteringLayer:
    """Homogeneous layer at one wavelength, with the phase function of Henyey and Greenstein.

    sigma_a : absorption coefficient, 0 or more [1/mm]
    sigma_s : scattering coefficient, not reduced, 0 or more [1/mm]
    thickness_mm : thickness; infinite for a half-space [mm]
    g : mean cosine of the scattering angle [-]
    eta : index of refraction relative to air [-]
    """

    sigma_a: float
    sigma_s: float
    thickness_mm: float = float("inf")
    g: float = 0.0
    eta: float = SKIN_ETA

    def __post_init__(self) -> None:
        """Raise DermisError for properties outside their range."""
        error_subject = "scattering layer"
        if not (0.0 <= self.sigma_a < np.inf and 0.0 <= self.sigma_s < np.inf):
            actual = f"got absorption {self.sigma_a:g} and scattering {self.sigma_s:g}"
            refuse(error_subject, "coefficients of 0 or more [1/mm]", actual, "Correct them")
        if not self.thickness_mm > 0.0:
            refuse(error_subject, "a thickness above 0 mm", f"got {self.thickness_mm:g}", "Correct it")
        if np.isinf(self.thickness_mm) and self.sigma_t == 0.0:
            actual = "it neither absorbs nor scatters"
            refuse(error_subject, "an infinite layer with extinction", actual, "Give it a thickness")
        check_anisotropy(self.g)
        if not 1.0 <= self.eta <= 2.5:
            refuse(error_subject, "an index of refraction from 1 to 2.5", f"got {self.eta:g}", "Correct it")

    @property
    def sigma_t(self) -> float:
        """Return the extinction coefficient [1/mm]."""
        return self.sigma_a + self.sigma_s

    @property
    def albedo(self) -> float:
        """Return the single-scattering albedo, or 0 if the extinction is 0 [-]."""
        return self.sigma_s / self.sigma_t if self.sigma_t > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class SlabResult:
    """Reflected, transmitted and absorbed fractions of the beam's power, with standard errors [-].

    The specular, total, unscattered, absorbed and unfinished fractions sum to 1. Names that end in `_se` are
    standard errors. They are computed from binomial distributions, and are 0 where no photon was counted.

    photons : number of photons traced, all of which entered the stack
    edges_mm : (n + 1,) radii of the ring edges, from 0 [mm]
    specular : fraction that the top face reflects
    reflectance, transmittance : (n,) R(r) and T(r) of scattered light, averaged over each ring [1/mm2]
    total_reflectance, total_transmittance : fractions that leave through the top and the bottom after
        scattering, at any radius
    overflow_reflectance, overflow_transmittance : the part of each total that leaves outside all rings
    unscattered_reflectance, unscattered_transmittance : fractions that leave through the top and the bottom
        without scattering
    absorbed : (layers,) fraction absorbed in each layer
    unfinished : fraction dropped after `MAX_PHOTON_EVENTS` events; above 0 only where almost nothing absorbs
    """

    photons: int
    edges_mm: Floats
    specular: float
    reflectance: Floats
    reflectance_se: Floats
    transmittance: Floats
    transmittance_se: Floats
    total_reflectance: float
    total_reflectance_se: float
    total_transmittance: float
    total_transmittance_se: float
    overflow_reflectance: float
    overflow_transmittance: float
    unscattered_reflectance: float
    unscattered_transmittance: float
    absorbed: Floats
    absorbed_se: Floats
    unfinished: float

    @property
    def relative_to_entering(self) -> SlabResult:
        """Return all fractions relative to the power that enters the stack, as in diffusion profiles."""
        names = [field.name for field in fields(self)][3:]
        entering_fraction = 1.0 - self.specular
        scaled = {name: getattr(self, name) / entering_fraction for name in names}
        return replace(self, specular=0.0, **scaled)
