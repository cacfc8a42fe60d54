"""Diffusion profiles of media by one of several diffusion models, and the measured errors of these models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.base.tables import float_columns, read_rows
from dermis.optics.diffusion import dipole, hankel, layered_diffusion, multipole
from dermis.optics.diffusion.boundary import boundary_mismatch, normal_reflectance
from dermis.optics.diffusion.multipole import SourceDepthClamp
from dermis.optics.fits.targets import RingTarget
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats, Medium
from dermis.optics.radial import (
    NOTABLE_MISSING_LIGHT_RATIO,
    SMALLEST_FLOAT,
    RadialProfile,
    enclosed_energy,
    missing_light_warnings,
    radius_grid,
    resample_profile,
    ring_edges,
)

DiffusionModel = Literal["dipole", "better-dipole", "multipole", "layered", "layered-point"]

MODEL_SOURCES: dict[DiffusionModel, tuple[str, ...]] = {
    "dipole": ("Jensen2001", "JensenBuhler2002"),
    "better-dipole": ("dEonIrving2011", "Habel2013", "Pharr2023"),
    "multipole": ("DonnerJensen2005", "Contini1997"),
    "layered": ("Kienle1998", "Farrell1992", "Haskell1994"),
    "layered-point": ("Kienle1998", "Haskell1994"),
}
_MIN_ACCURATE_DIPOLE_ALBEDO = 0.9  # reduced albedo below which the error of the dipole exceeds 10 %
_MIN_REPORTED_NEGATIVE_LIGHT_RATIO = (
    0.005  # ratio of negative light to total reflectance above which a warning is given
)


def diffusion_profile(
    medium: Medium,
    model: DiffusionModel = "layered",
    clamp: SourceDepthClamp = "layer",
    rgb_weights: Floats | None = None,
) -> RadialProfile:
    """Return the diffusion profile R(r) of a medium, computed by a diffusion model.

    medium : stack of layers
    model : "dipole" and "better-dipole" require one half-space; the other models accept any stack
    clamp : whether the multipole's source is kept inside thin layers ("layer") or not ("none"), see `Slab`
    rgb_weights : (3, c) weights that convert wavelengths to linear Rec. 709; the result then has three
        channels and is relative to the incident power. By default, the result has the medium's channels and
        is relative to the power that enters

    Raises DermisError when the model is not valid for the medium.

    Source: the works listed in `MODEL_SOURCES`.
    """
    grid, values, total = _sampled_profile(medium, model, clamp, rgb_weights)
    edges, radius = ring_edges(), radius_grid()
    ring_energy = np.diff(enclosed_energy(edges, grid, values), axis=0)
    return RadialProfile(
        name=medium.name,
        model=model,
        radius_mm=radius,
        reflectance=resample_profile(radius, grid, values),
        total=total,
        edges_mm=edges,
        ring_energy=ring_energy,
        incident=rgb_weights is not None,
        warnings=(*_medium_warnings(medium, model, clamp), *_profile_warnings(total, ring_energy)),
        sources=(*medium.sources, *MODEL_SOURCES[model]),
    )


def diffusion_rings(
    medium: Medium,
    model: DiffusionModel = "layered",
    clamp: SourceDepthClamp = "layer",
    rgb_weights: Floats | None = None,
) -> RingTarget:
    """Return the light of a narrow beam that emerges through concentric rings around the beam.

    The result is a target for fits. It holds the field `ring_energy` of the profile that `diffusion_profile`
    returns for the same arguments, but not the profile R(r) itself, and is computed faster.
    """
    grid, values, total = _sampled_profile(medium, model, clamp, rgb_weights)
    edges = ring_edges()
    return RingTarget(edges, np.diff(enclosed_energy(edges, grid, values), axis=0), total)


def _sampled_profile(
    medium: Medium, model: DiffusionModel, clamp: SourceDepthClamp, rgb_weights: Floats | None
) -> tuple[Floats, Floats, Floats]:
    """Return radii r (n,) [mm], the profile R(r) (n, c) [1/mm2] and the total reflectance (c,) [-].

    The parameters are those of `diffusion_profile`.
    """
    if model in ("dipole", "better-dipole"):
        _check_half_space(medium, model)
    closed_form = rgb_weights is None and len(medium.layers) == 1 and model in ("dipole", "multipole")
    if closed_form or model == "better-dipole":
        grid = np.geomspace(1e-6, 1e3, 1500)
        values = _closed_form_profile(medium, model, clamp, grid)
        values = values if rgb_weights is None else values @ rgb_weights.T
    else:
        grid = hankel.transform_radii()
        transform = hankel_transform(medium, model, clamp, hankel.transform_frequencies())
        values = hankel.inverse_transform(transform if rgb_weights is None else transform @ rgb_weights.T)
    if model == "better-dipole":
        total = enclosed_energy(grid[-1:], grid, values)[0]
    else:
        total = hankel_transform(medium, model, clamp, hankel.NEAR_ZERO_FREQUENCY)[0]
    if rgb_weights is not None:
        entering = 1.0 - normal_reflectance(medium.eta)
        values, total = entering * values, entering * total @ rgb_weights.T
    inside = (grid > 1e-7) & (grid < 1e3)  # the rest is numerical noise
    return grid[inside], values[inside], total


def hankel_transform(
    medium: Medium, model: DiffusionModel, clamp: SourceDepthClamp, frequency: Floats
) -> Floats:
    """Return the Hankel transform (n, c) of a model's R(r) [-].

    clamp : whether the multipole's source is kept inside thin layers ("layer") or not ("none"), see `Slab`
    frequency : (n,) frequencies s > 0 [1/mm]
    """
    if model in ("layered", "layered-point"):
        A = boundary_mismatch(medium.eta, "exact")
        source: layered_diffusion.SourceKind = "beam" if model == "layered" else "point"
        return layered_diffusion.solve_reflectance(frequency, medium, A, source)
    return multipole.stack_response(frequency, medium, boundary_mismatch(medium.eta), clamp).R_above


def _check_half_space(medium: Medium, model: DiffusionModel) -> None:
    if len(medium.layers) > 1 or not medium.is_semi_infinite:
        last = f"the last {medium.layers[-1].thickness_mm:g} mm thick"
        actual = f"{medium.name} has {len(medium.layers)} layers, {last}"
        refuse(f"model {model}", "one semi-infinite layer", actual, "Use the model multipole or layered")


def _closed_form_profile(
    medium: Medium, model: DiffusionModel, clamp: SourceDepthClamp, radius_mm: Floats
) -> Floats:
    layer = medium.layers[0]
    if model == "better-dipole":
        return dipole.better_dipole_reflectance(radius_mm, layer, medium.eta)
    if model == "dipole":
        return dipole.reflectance(radius_mm, layer, boundary_mismatch(medium.eta))
    slab = multipole.layer_slabs(medium, boundary_mismatch(medium.eta), clamp)[0]
    return multipole.reflectance(radius_mm, slab)


def _medium_warnings(medium: Medium, model: DiffusionModel, clamp: SourceDepthClamp) -> list[str]:
    """Return a warning for each property of the medium that makes the model inaccurate."""
    warnings = []
    for number, layer in enumerate(medium.layers, 1):
        thin = layer.thickness_mm < layer.mean_free_path_mm
        if model == "multipole" and thin.any():
            lost = "its source is below it and light is lost"
            effect = lost if clamp == "none" else "its source is moved into it"
            warnings.append(f"layer {number} ({layer.name}) is thinner than a mean free path: {effect}")
    worst = float(_first_event_albedo(medium).min())
    if worst < _MIN_ACCURATE_DIPOLE_ALBEDO:
        warnings.append(
            f"the first mean free path absorbs (reduced albedo down to {worst:.2f}): at 0.5 the total of "
            "layered diffusion has an error of 14 %, that of the dipole 37 %"
        )
    return warnings


def _first_event_albedo(medium: Medium) -> Floats:
    """Return the probability (c,) that the first interaction of light with a medium is scattering [-].

    If it is not scattering, it is absorption. The probability is averaged over the first mean free path
    below the surface.
    """
    depth, scattered = np.zeros(medium.channels), np.zeros(medium.channels)
    for layer in medium.layers:
        events = np.minimum(layer.sigma_t_prime * layer.thickness_mm, 1.0 - depth)
        depth, scattered = depth + events, scattered + layer.alpha_prime * events
    return scattered / depth


def _profile_warnings(total_reflectance: Floats, ring_energy: Floats) -> Sequence[str]:
    """Return warnings about negative reflectances, and about rings whose light does not sum to the total.

    total_reflectance : (c,) total reflectance [-]
    ring_energy : (k, c) light that emerges through each ring around a narrow beam [-]
    """
    warnings = missing_light_warnings(total_reflectance, ring_energy)
    if (total_reflectance < 0.0).any():
        warnings.append(f"a total reflectance is negative: {np.round(total_reflectance, 4).tolist()}")
    size = np.maximum(np.abs(total_reflectance), SMALLEST_FLOAT)
    negative = float((-np.minimum(ring_energy, 0.0).sum(axis=0) / size).max())
    if negative > _MIN_REPORTED_NEGATIVE_LIGHT_RATIO:
        warnings.append(
            f"R(r) is negative at some radii, {negative:.1%} of a channel's total: layers too thin for the "
            "model, or colours outside Rec. 709. No sum of Gaussians fits it there"
        )
    surplus = float(((ring_energy.sum(axis=0) - total_reflectance) / size).max())
    if surplus > NOTABLE_MISSING_LIGHT_RATIO:
        warnings.append(f"R(r) has {surplus:.0%} more light than the total: its radii are too coarse")
    return warnings


def gaussian_transmittance(profile: GaussianSum, thickness_mm: ArrayLike) -> Floats:
    """Return an approximate transmittance (n, 3) of slabs that are lit uniformly from behind [-].

    profile : profile R(r) as a sum of Gaussians
    thickness_mm : (n,) thicknesses d of the slabs [mm]

    For the transmitted light, R is evaluated at the distance sqrt(r^2 + d^2). A Gaussian G(v, r) of variance
    v then becomes exp(-d^2 / 2v) G(v, r), so each weight is multiplied by exp(-d^2 / 2v).

    Source: [dEonLuebke2007] section 14.5.
    """
    d = np.asarray(thickness_mm, dtype=np.float64)[..., None]
    return np.asarray(np.exp(-(d**2) / (2.0 * profile.variance_mm2)) @ profile.weight)


def slab_transmittance(
    medium: Medium, thickness_mm: ArrayLike, model: Literal["layered", "multipole"] = "layered"
) -> Floats:
    """Return the transmittance (n, c) of a medium that is cut off at each of n thicknesses [-].

    The transmittance is relative to the power that enters the medium.

    thickness_mm : (n,) thicknesses at which the medium is cut off [mm]
    model : "layered" includes unscattered light, attenuated by the reduced extinction; "multipole" assumes
        that all light scatters at one depth, which is inaccurate for layers thinner than a mean free path

    Source: [DonnerJensen2005] eq. 7, 8 for the multipole.
    """
    transmittances = []
    for thickness in np.atleast_1d(np.asarray(thickness_mm, dtype=np.float64)):
        slab = truncated_medium(medium, float(thickness))
        if model == "layered":
            depth = sum(layer.sigma_t_prime * layer.thickness_mm for layer in slab.layers)
            unscattered = (1.0 - normal_reflectance(medium.eta)) * np.exp(-depth)
            A = boundary_mismatch(medium.eta, "exact")
            diffuse = layered_diffusion.solve_layers(hankel.NEAR_ZERO_FREQUENCY, slab, A)[1][0]
            transmittances.append(diffuse + unscattered)
        else:
            A = boundary_mismatch(medium.eta)
            transmittances.append(multipole.stack_response(hankel.NEAR_ZERO_FREQUENCY, slab, A).T_down[0])
    return np.stack(transmittances)


def truncated_medium(medium: Medium, thickness_mm: float) -> Medium:
    """Return the part of a medium above a depth, with air below it; a thinner medium is returned whole.

    thickness_mm : depth at which the medium is cut off [mm]
    """
    if not 0.0 < thickness_mm < np.inf:
        refuse("thickness", "a length above 0 mm", f"got {thickness_mm:g}", "Correct it")
    layers, remaining_mm = [], thickness_mm
    for layer in medium.layers:
        layers.append(replace(layer, thickness_mm=min(layer.thickness_mm, remaining_mm)))
        remaining_mm -= layer.thickness_mm
        if remaining_mm <= 0.0:
            break
    return replace(medium, layers=tuple(layers))


@dataclass(frozen=True)
class ModelDeviation:
    """Relative error of a diffusion model, with Monte Carlo simulation as the reference.

    The compared values are the amounts of light that emerge through concentric rings around a narrow beam.
    The error is the root-mean-square difference over the rings, relative to the root mean square of the
    reference.

    smallest, largest : (3,) smallest and largest error among `tissues`, in red, green and blue [-]
    tissues : names of the tissues for which the error was measured
    """

    smallest: Floats
    largest: Floats
    tissues: tuple[str, ...]


def measured_model_error(model_name: str, tissue_name: str = "") -> ModelDeviation | None:
    """Return the measured error of a diffusion model, or None if the model was never measured.

    model_name : name of the diffusion model, such as "dipole"
    tissue_name : name of a tissue; if the name is empty or the tissue was not measured, the result covers all
        measured tissues
    """
    by_tissue = {name: error for (name, key), error in _measured_errors().items() if key == model_name}
    if tissue_name in by_tissue:
        by_tissue = {tissue_name: by_tissue[tissue_name]}
    if not by_tissue:
        return None
    errors = np.array(list(by_tissue.values()))
    return ModelDeviation(errors.min(axis=0), errors.max(axis=0), tuple(by_tissue))


def error_against_monte_carlo(
    model_profile: RadialProfile, monte_carlo_profile: RadialProfile
) -> ModelDeviation:
    """Return the error of a model's profile, relative to a Monte Carlo profile of the same tissue."""
    squares = ((model_profile.ring_energy - monte_carlo_profile.ring_energy) ** 2).sum(axis=0)
    error = np.sqrt(squares / (monte_carlo_profile.ring_energy**2).sum(axis=0))
    return ModelDeviation(error, error, (model_profile.name,))


@cache
def _measured_errors() -> dict[tuple[str, str], Floats]:
    rows = read_rows("dermis.optics.data", "model_errors")
    errors = float_columns(rows, "red green blue")
    return {(row["tissue"], row["model"]): error for row, error in zip(rows, errors, strict=True)}
