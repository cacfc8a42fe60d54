"""A medium's diffusion profile under each of the diffusion models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from dermis.errors import refuse
from dermis.optics.diffusion import better_dipole, dipole, hankel, layered_diffusion, layers, multipole
from dermis.optics.diffusion.boundary import mismatch, normal_reflectance
from dermis.optics.diffusion.multipole import Clamp
from dermis.optics.media import Floats, Medium
from dermis.optics.radial import RadialProfile, enclosed, radius_grid, resample, ring_edges

Model = Literal["dipole", "better-dipole", "multipole", "layered", "layered-point"]

SOURCES: dict[Model, tuple[str, ...]] = {
    "dipole": ("Jensen2001", "JensenBuhler2002"),
    "better-dipole": ("dEonIrving2011", "Habel2013", "Pharr2023"),
    "multipole": ("DonnerJensen2005", "Contini1997"),
    "layered": ("Kienle1998", "Farrell1992", "Haskell1994"),
    "layered-point": ("Kienle1998", "Haskell1994"),
}
_ABSORBING = 0.9  # reduced albedo under which diffusion is off by more than a tenth


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
    if model in ("dipole", "better-dipole"):
        _need_half_space(medium, model)
    closed = rgb is None and len(medium.layers) == 1 and model in ("dipole", "multipole")
    if closed or model == "better-dipole":
        grid = np.geomspace(1e-6, 1e3, 1500)
        values = _pointwise(medium, model, clamp, grid)
        total = (
            enclosed(grid[-1:], grid, values)[0] if model == "better-dipole" else _total(medium, model, clamp)
        )
    else:
        grid = hankel.radii()
        values = hankel.to_radius(transform(medium, model, clamp, hankel.frequencies()))
        total = _total(medium, model, clamp)
    near = (grid > 1e-7) & (grid < 1e3)  # beyond, the numbers are noise
    return _assemble(medium, model, clamp, grid[near], values[near], total, rgb)


def transform(medium: Medium, model: Model, clamp: Clamp, frequency: Floats) -> Floats:
    """Hankel transform of R(r) by frequency s > 0 [1/mm], (n, c) [-]."""
    if model in ("layered", "layered-point"):
        A = mismatch(medium.eta, "exact")
        source: layered_diffusion.Source = "beam" if model == "layered" else "point"
        return layered_diffusion.respond(frequency, medium, A, source)[0]
    return layers.respond(frequency, medium, mismatch(medium.eta), clamp).R_above


def _total(medium: Medium, model: Model, clamp: Clamp) -> Floats:
    total: Floats = transform(medium, model, clamp, hankel.STILL)[0]
    return total


def _need_half_space(medium: Medium, model: Model) -> None:
    if len(medium.layers) > 1 or not medium.semi_infinite:
        last = f"the last {medium.layers[-1].thickness_mm:g} mm thick"
        came = f"{medium.name} has {len(medium.layers)} layers, {last}"
        refuse(f"model {model}", "one layer without a bottom", came, "Take the model multipole or layered")


def _pointwise(medium: Medium, model: Model, clamp: Clamp, radius_mm: Floats) -> Floats:
    layer = medium.layers[0]
    if model == "better-dipole":
        return better_dipole.reflectance(radius_mm, layer, medium.eta)
    if model == "dipole":
        return dipole.reflectance(radius_mm, layer, mismatch(medium.eta))
    return multipole.reflectance(radius_mm, layers.slabs_of(medium, mismatch(medium.eta), clamp)[0])


def _assemble(
    medium: Medium,
    model: Model,
    clamp: Clamp,
    grid: Floats,
    values: Floats,
    total: Floats,
    rgb: Floats | None,
) -> RadialProfile:
    if rgb is not None:
        entering = 1.0 - normal_reflectance(medium.eta)
        values, total = entering * values @ rgb.T, entering * total @ rgb.T
    edges, radius = ring_edges(), radius_grid()
    within = enclosed(edges, grid, values)
    return RadialProfile(
        name=medium.name,
        model=model,
        radius_mm=radius,
        reflectance=resample(radius, grid, values),
        total=total,
        edges_mm=edges,
        ring_energy=np.diff(within, axis=0),
        incident=rgb is not None,
        warnings=(*_doubts(medium, model, clamp), *_flaws(total, within[-1])),
        sources=(*medium.sources, *SOURCES[model]),
    )


def _doubts(medium: Medium, model: Model, clamp: Clamp) -> list[str]:
    """What of the medium the model takes badly."""
    found = []
    for number, layer in enumerate(medium.layers, 1):
        thin = layer.thickness_mm < layer.mean_free_path_mm
        if model == "multipole" and thin.any():
            what = (
                "its source lies below it, light is lost"
                if clamp == "none"
                else "its source is moved into it"
            )
            found.append(f"layer {number} ({layer.name}) is thinner than a reduced mean free path: {what}")
    worst = float(medium.layers[0].alpha_prime.min())
    if worst < _ABSORBING:
        found.append(
            f"the top layer absorbs (reduced albedo down to {worst:.2f}): diffusion is off by 10 % at 0.9 "
            "and by 40 % at 0.5"
        )
    return found


def _flaws(total: Floats, within: Floats) -> Sequence[str]:
    found = []
    if (total < 0.0).any():
        found.append(f"a total reflectance is negative: {np.round(total, 4).tolist()}")
    if (np.abs(total - within) > 0.01 * np.abs(total)).any():
        share = float(np.max(1.0 - within / total))
        found.append(f"{share:.0%} of the light leaves beyond the widest radius and is in the total only")
    return found
