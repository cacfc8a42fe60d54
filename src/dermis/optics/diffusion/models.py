"""A medium's diffusion profile under each diffusion model, and known errors of the models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.base.tables import numbers, read_rows
from dermis.optics.diffusion import dipole, hankel, layered_diffusion, multipole
from dermis.optics.diffusion.boundary import mismatch, normal_reflectance
from dermis.optics.diffusion.multipole import Clamp
from dermis.optics.fits.targets import Rings
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats, Medium
from dermis.optics.radial import (
    NOTABLE_SHARE,
    TINY,
    RadialProfile,
    enclosed,
    light_beyond,
    radius_grid,
    resample,
    ring_edges,
)

Model = Literal["dipole", "better-dipole", "multipole", "layered", "layered-point"]

SOURCES: dict[Model, tuple[str, ...]] = {
    "dipole": ("Jensen2001", "JensenBuhler2002"),
    "better-dipole": ("dEonIrving2011", "Habel2013", "Pharr2023"),
    "multipole": ("DonnerJensen2005", "Contini1997"),
    "layered": ("Kienle1998", "Farrell1992", "Haskell1994"),
    "layered-point": ("Kienle1998", "Haskell1994"),
}
_ABSORBING = 0.9  # reduced albedo under which the dipole is off by more than a tenth
_NOTABLE_NEGATIVE = 0.005  # of the total


def diffusion_profile(
    medium: Medium, model: Model = "layered", clamp: Clamp = "layer", rgb: Floats | None = None
) -> RadialProfile:
    """R(r) of a medium.

    medium : stack of layers
    model : "dipole" and "better-dipole" take one half-space; the others take any stack
    clamp : where the multipole puts the source of a thin layer
    rgb : (3, c) weights from wavelengths to linear Rec. 709; the result then has three channels, per
        incident power

    Raises DermisError when the model cannot take the medium.

    Source: see `SOURCES`.
    """
    grid, values, total = _spread(medium, model, clamp, rgb)
    edges, radius = ring_edges(), radius_grid()
    ring_energy = np.diff(enclosed(edges, grid, values), axis=0)
    return RadialProfile(
        name=medium.name,
        model=model,
        radius_mm=radius,
        reflectance=resample(radius, grid, values),
        total=total,
        edges_mm=edges,
        ring_energy=ring_energy,
        incident=rgb is not None,
        warnings=(*_doubts(medium, model, clamp), *_flaws(total, ring_energy)),
        sources=(*medium.sources, *SOURCES[model]),
    )


def diffusion_rings(
    medium: Medium, model: Model = "layered", clamp: Clamp = "layer", rgb: Floats | None = None
) -> Rings:
    """The rings of `diffusion_profile` alone, for fits of many media."""
    grid, values, total = _spread(medium, model, clamp, rgb)
    edges = ring_edges()
    return Rings(edges, np.diff(enclosed(edges, grid, values), axis=0), total)


def _spread(medium: Medium, model: Model, clamp: Clamp, rgb: Floats | None) -> tuple[Floats, Floats, Floats]:
    """Radii (n,) [mm], R(r) there (n, c) [1/mm2] and its total (c,) [-]."""
    if model in ("dipole", "better-dipole"):
        _need_half_space(medium, model)
    closed = rgb is None and len(medium.layers) == 1 and model in ("dipole", "multipole")
    if closed or model == "better-dipole":
        grid = np.geomspace(1e-6, 1e3, 1500)
        values = _pointwise(medium, model, clamp, grid)
        values = values if rgb is None else values @ rgb.T
    else:
        grid = hankel.radii()
        spread = transform(medium, model, clamp, hankel.frequencies())
        values = hankel.to_radius(spread if rgb is None else spread @ rgb.T)
    if model == "better-dipole":
        total = enclosed(grid[-1:], grid, values)[0]
    else:
        total = transform(medium, model, clamp, hankel.STILL)[0]
    if rgb is not None:
        entering = 1.0 - normal_reflectance(medium.eta)
        values, total = entering * values, entering * total @ rgb.T
    near = (grid > 1e-7) & (grid < 1e3)  # beyond, the numbers are noise
    return grid[near], values[near], total


def transform(medium: Medium, model: Model, clamp: Clamp, frequency: Floats) -> Floats:
    """Hankel transform of R(r) by frequency s > 0 [1/mm], (n, c) [-]."""
    if model in ("layered", "layered-point"):
        A = mismatch(medium.eta, "exact")
        source: layered_diffusion.Source = "beam" if model == "layered" else "point"
        return layered_diffusion.reflect(frequency, medium, A, source)
    return multipole.respond(frequency, medium, mismatch(medium.eta), clamp).R_above


def _need_half_space(medium: Medium, model: Model) -> None:
    if len(medium.layers) > 1 or not medium.semi_infinite:
        last = f"the last {medium.layers[-1].thickness_mm:g} mm thick"
        came = f"{medium.name} has {len(medium.layers)} layers, {last}"
        refuse(f"model {model}", "one semi-infinite layer", came, "Take the model multipole or layered")


def _pointwise(medium: Medium, model: Model, clamp: Clamp, radius_mm: Floats) -> Floats:
    layer = medium.layers[0]
    if model == "better-dipole":
        return dipole.better_reflectance(radius_mm, layer, medium.eta)
    if model == "dipole":
        return dipole.reflectance(radius_mm, layer, mismatch(medium.eta))
    return multipole.reflectance(radius_mm, multipole.slabs_of(medium, mismatch(medium.eta), clamp)[0])


def _doubts(medium: Medium, model: Model, clamp: Clamp) -> list[str]:
    """Warnings of what in the medium the model handles badly."""
    found = []
    for number, layer in enumerate(medium.layers, 1):
        thin = layer.thickness_mm < layer.mean_free_path_mm
        if model == "multipole" and thin.any():
            lost = "its source lies below it, light is lost"
            what = lost if clamp == "none" else "its source is moved into it"
            found.append(f"layer {number} ({layer.name}) is thinner than a reduced mean free path: {what}")
    worst = float(_early_albedo(medium).min())
    if worst < _ABSORBING:
        found.append(
            f"the first mean free path absorbs (reduced albedo down to {worst:.2f}): at 0.5 the total of "
            "layered diffusion is off by 14 %, the dipole's by 37 %"
        )
    return found


def _early_albedo(medium: Medium) -> Floats:
    """Share of the beam's first events within a mean free path that scatter it, (c,) [-]."""
    depth, scattered = np.zeros(medium.channels), np.zeros(medium.channels)
    for layer in medium.layers:
        events = np.minimum(layer.sigma_t_prime * layer.thickness_mm, 1.0 - depth)
        depth, scattered = depth + events, scattered + layer.alpha_prime * events
    return scattered / depth


def _flaws(total: Floats, ring_energy: Floats) -> Sequence[str]:
    """Warnings of what in the result is unphysical, or missing from the rings."""
    found = light_beyond(total, ring_energy)
    if (total < 0.0).any():
        found.append(f"a total reflectance is negative: {np.round(total, 4).tolist()}")
    size = np.maximum(np.abs(total), TINY)
    negative = float((-np.minimum(ring_energy, 0.0).sum(axis=0) / size).max())
    if negative > _NOTABLE_NEGATIVE:
        found.append(
            f"R(r) is negative at some radii, {negative:.1%} of a channel's total: layers too thin for the "
            "model, or colours outside Rec. 709. No Gaussian follows it there"
        )
    surplus = float(((ring_energy.sum(axis=0) - total) / size).max())
    if surplus > NOTABLE_SHARE:
        found.append(f"R(r) holds {surplus:.0%} more light than the total: it is finer than its numbers")
    return found


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


@dataclass(frozen=True)
class ModelError:
    """Error of a model in the light that leaves through rings, against photons [-].

    least, most : (3,) for red, green and blue; the same where it was measured on the tissue itself
    tissues : what it was measured on
    """

    least: Floats
    most: Floats
    tissues: tuple[str, ...]


def known_error(model: str, tissue: str = "") -> ModelError | None:
    """The error of a model on a tissue, or over all that it was measured on; None for one that never was.

    tissue : its name, empty for any
    """
    found = {name: error for (name, of), error in _table().items() if of == model}
    if tissue in found:
        found = {tissue: found[tissue]}
    if not found:
        return None
    errors = np.array(list(found.values()))
    return ModelError(errors.min(axis=0), errors.max(axis=0), tuple(found))


def counted_error(radial: RadialProfile, photons: RadialProfile) -> ModelError:
    """The error of a profile by photons counted for it."""
    miss = ((radial.ring_energy - photons.ring_energy) ** 2).sum(axis=0)
    error = np.sqrt(miss / (photons.ring_energy**2).sum(axis=0))
    return ModelError(error, error, (radial.name,))


@cache
def _table() -> dict[tuple[str, str], Floats]:
    rows = read_rows("dermis.optics.data", "model_errors")
    errors = numbers(rows, "red green blue")
    return {(row["tissue"], row["model"]): error for row, error in zip(rows, errors, strict=True)}
