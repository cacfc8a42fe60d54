"""Errors of diffusion models against Monte Carlo, and of sums of Gaussians fitted to their profiles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.slab_mc import monte_carlo_profile, trace_medium
from dermis.apps.validation.pages import print_tables
from dermis.optics.diffusion.models import (
    DiffusionModel,
    gaussian_transmittance,
    slab_transmittance,
    truncated_medium,
)
from dermis.optics.diffusion.multipole import SourceDepthClamp
from dermis.optics.fits.burley import fit_burley
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.fits.separable import fit_separable
from dermis.optics.fits.targets import ring_error
from dermis.optics.media import SKIN_ETA, published_media
from dermis.optics.profiles import load_profile
from dermis.optics.radial import RadialProfile
from dermis.optics.tissue import Tissue, load_tissue

Floats = NDArray[np.float64]
PHOTON_COUNT, SPECTRAL_PHOTON_COUNT = 4_000_000, 400_000
COMPARED_TISSUES = ("skin1", "skin2", "dj3", "light", "medium", "dark")
COMPARED_MODELS: tuple[tuple[DiffusionModel, SourceDepthClamp], ...] = (
    ("dipole", "layer"),
    ("better-dipole", "layer"),
    ("multipole", "none"),
    ("multipole", "layer"),
    ("layered", "layer"),
    ("layered-point", "layer"),
)
THICKNESSES_MM = (0.5, 1.0, 2.0, 4.0)


def print_optics_errors() -> None:
    """Print tables with errors of diffusion models, of fitted profiles and of the transmittance of slabs."""
    print_tables(optics_error_tables())


def tissue_by_name(tissue_name: str) -> Tissue:
    """Return a tissue by name; "skin1" and "skin2" have the index of refraction assumed by [Jensen2001]."""
    tissue = load_tissue(tissue_name)
    return Tissue(published_media()[tissue_name].with_eta(1.3)) if tissue_name.startswith("skin") else tissue


def diffusion_models_table() -> str:
    """Return Markdown rows with errors of diffusion models against Monte Carlo, by tissue.

    Errors are given for the total energy, and for the energies in rings around the point of entry.
    """
    return "\n".join(row for name in COMPARED_TISSUES for row in _model_rows(name, tissue_by_name(name)))


def _model_rows(tissue_name: str, tissue: Tissue) -> Iterator[str]:
    photons = PHOTON_COUNT if tissue.rgb is None else SPECTRAL_PHOTON_COUNT
    reference = monte_carlo_profile(tissue.medium, tissue.rgb, photons, seed=1)
    assert reference.total_error is not None
    totals = " ".join(f"{value:.4f}" for value in reference.total)
    relative_error = float((reference.total_error / reference.total).max())
    yield f"| **{tissue_name}** | Monte Carlo | {totals} | ± {relative_error:.2%} |"
    layers = tissue.medium.layers
    thin = any(np.any(layer.thickness_mm < layer.mean_free_path_mm) for layer in layers)
    for model, clamp in COMPARED_MODELS:
        one_layer = len(layers) == 1
        if (model.endswith("dipole") and not one_layer) or (model == "multipole" and one_layer):
            continue
        if model == "multipole" and clamp == "none" and not thin:
            continue
        profile = tissue.profile(model, clamp)
        source = {"none": ", source as printed", "layer": ", source clamped"}[clamp]
        label = model + (source if model == "multipole" else "")
        total = _percentages_text(profile.total / reference.total - 1.0)
        rings = _percentages_text(ring_error(reference.ring_target(), profile.ring_energy), with_sign=False)
        yield f"| | {label} | {total} | {rings} |"


def photon_counts_table() -> str:
    """Return Markdown rows with errors of the diffusion models "counted" and "layered", by medium.

    The reference is Monte Carlo. The model "counted" interpolates in tables made by Monte Carlo; the model
    "layered" solves the diffusion equation for layers.
    """
    rows = []
    for name in ("skin1", "skin2"):
        for eta in (1.0, SKIN_ETA):
            tissue = Tissue(published_media()[name].with_eta(eta))
            reference = monte_carlo_profile(tissue.medium, photons=PHOTON_COUNT, seed=1)
            for model in ("counted", "layered"):
                profile = tissue.profile(model)
                total = " ".join(f"{100 * one:+.2f}" for one in profile.total / reference.total - 1.0)
                rings = _percentages_text(
                    ring_error(reference.ring_target(), profile.ring_energy), with_sign=False
                )
                rows.append(f"| {name}, index {eta:g} | {model} | {total} % | {rings} |")
    return "\n".join(rows)


def fitted_profiles_table() -> str:
    """Return Markdown rows with errors of fitted Gaussians and fitted Burley profiles, by tissue.

    They are fitted to the energies of a layered-diffusion profile in rings around its centre.
    """
    rows = []
    for name in COMPARED_TISSUES:
        profile = tissue_by_name(name).profile()
        rings = profile.ring_target()
        cells = [_percentages_text(fit_gaussians(rings, n).error, with_sign=False) for n in (2, 4, 6, 8)]
        cells += [_percentages_text(fit(rings).error, with_sign=False) for fit in (fit_burley, fit_separable)]
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(rows)


def gaussian_point_fits_table() -> str:
    """Return Markdown rows with errors of six Gaussians fitted to the radial values of diffusion profiles.

    Each profile is fitted twice: without a constraint, and with its total energy conserved.
    """
    rows = []
    for name, model, clamp in (
        ("skin1", "dipole", "layer"),
        ("marble", "dipole", "layer"),
        ("dj3", "multipole", "none"),
        ("dj3", "multipole", "layer"),
        ("dj3", "layered-point", "layer"),
    ):
        profile = tissue_by_name(name).profile(model, clamp)  # type: ignore[arg-type]
        points = profile.point_target()
        free, conserved = (fit_gaussians(points, 6, keep_energy=keep) for keep in (False, True))
        label = f"{name}, {model}" + (", source as printed" if clamp == "none" else "")
        cells = [_percentages_text(one.error, with_sign=False) for one in (free, conserved)]
        cells.insert(1, _percentages_text(free.energy_error))
        rows.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(rows)


def transmission_table() -> str:
    """Return Markdown rows with the transmittance of slabs, by Monte Carlo and by three approximations."""
    rows = []
    for name in ("skin1", "dj3"):
        tissue = tissue_by_name(name)
        gaussian_sum = fit_gaussians(tissue.profile().ring_target(), 6).profile
        for thickness in THICKNESSES_MM:
            slab = truncated_medium(tissue.medium, thickness)
            runs = trace_medium(slab, PHOTON_COUNT // 4, seed=2)
            reference = np.array([run.total_transmittance + run.unscattered_transmittance for run in runs])
            reference = reference / (1.0 - runs[0].specular)
            variants = [
                reference,
                slab_transmittance(tissue.medium, [thickness])[0],
                slab_transmittance(tissue.medium, [thickness], "multipole")[0],
                gaussian_transmittance(gaussian_sum, [thickness])[0],
            ]
            rows.append(f"| {name} | {thickness:g} mm | {' | '.join(map(_fractions_text, variants))} |")
    return "\n".join(rows)


def error_against_published_sum(profile: RadialProfile) -> Floats:
    """Return the relative RMS difference (3,) between a profile and the sum published in GPU Gems 3 [-].

    The sum of Gaussians and the profile are compared in each of the three channels.

    The profile is first scaled to a total energy of 1 in each channel.
    """
    r, log_r = profile.radius_mm[:, None], np.log(profile.radius_mm)
    table = load_profile("gpu-gems-3").radiant_exitance(profile.radius_mm)
    squared_error = np.trapezoid((r * (profile.reflectance / profile.total - table)) ** 2, log_r, axis=0)
    return np.sqrt(squared_error / np.trapezoid((r * table) ** 2, log_r, axis=0))


def published_profile_errors_text() -> str:
    """Return text with `error_against_published_sum` of three diffusion profiles of the tissue "dj3"."""
    variants: tuple[tuple[str, DiffusionModel, SourceDepthClamp], ...] = (
        ("multipole as printed", "multipole", "none"),
        ("multipole", "multipole", "layer"),
        ("layered diffusion of a point source", "layered-point", "layer"),
    )
    cells = []
    for label, model, clamp in variants:
        error = error_against_published_sum(load_tissue("dj3").profile(model, clamp))
        cells.append(f"{label} {_percentages_text(error, with_sign=False)}")
    return ", ".join(cells)


def optics_error_tables() -> dict[str, str]:
    """Return texts on errors of diffusion models, keyed by placeholder of docs/templates/accuracy.md."""
    return {
        "models": diffusion_models_table(),
        "counted": photon_counts_table(),
        "fits": fitted_profiles_table(),
        "pointwise": gaussian_point_fits_table(),
        "transmission": transmission_table(),
        "published": published_profile_errors_text(),
        "photons": f"{PHOTON_COUNT:,}",
        "spectral_photons": f"{SPECTRAL_PHOTON_COUNT:,}",
    }


def _percentages_text(fractions: Floats, with_sign: bool = True) -> str:
    return (
        " ".join(f"{100 * value:+.1f}" if with_sign else f"{100 * value:.1f}" for value in fractions) + " %"
    )


def _fractions_text(fractions: Floats) -> str:
    return " ".join(f"{value:.3f}" for value in fractions)
