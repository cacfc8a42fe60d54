"""Errors of the reflectance and transmittance of rendered slabs, by direction of incidence.

The reference is computed by the adding-doubling method, which the tests check against Monte Carlo.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.apps.validation.accuracy.thin import scattered_light
from dermis.apps.validation.pages import print_tables
from dermis.mesh.primitives import wedge
from dermis.optics import slabs as adding_doubling
from dermis.optics.angular_response import (
    DIRECTION_ROWS,
    directional_reflectance,
    mean_single_scattering_kernel,
    refracted_cosine,
)
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.media import Medium, published_media
from dermis.optics.profiles import GAUSSIAN_TERMS, write_profile
from dermis.optics.slabs import anisotropic_response
from dermis.scene import Skin

Array = NDArray[np.float64]
THICKNESSES_MM = (0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
INCIDENT_DEGREES = (0.0, 40.0, 60.0, 80.0)
PHOTON_COUNT = 100_000
FORWARD_G = 0.8  # mean cosine of scattering in real skin
SLAB_MEDIA = (("skin1", 1.0), ("skin2", 1.0), ("skin1", 1.4), ("skin2", 1.4))


def print_slab_errors(adapter: str = "auto") -> None:
    """Print tables with errors of the reflectance and transmittance of rendered slabs."""
    print_tables(slab_error_tables(adapter))


def exact_slab_response(medium: Medium, thickness_mm: float, mean_cosine: float = 0.0) -> Array:
    """Return reflectance and transmittance (2, n, 3) of a slab by the adding-doubling method, for n angles.

    The angles of incidence are `INCIDENT_DEGREES`.

    thickness_mm : thickness of the slab [mm]
    mean_cosine : mean cosine of the scattering angle [-]; `medium` contains the reduced scattering
    """
    layer, response = medium.layers[0], np.empty((2, len(INCIDENT_DEGREES), 3))
    inner_cosine = refracted_cosine(np.cos(np.radians(INCIDENT_DEGREES)), medium.eta)
    for c in range(3):
        albedo, depth = float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c]) * thickness_mm
        slab = adding_doubling.solve_slabs(albedo, depth, medium.eta, g=mean_cosine)
        sides = slab.reflected[0], slab.transmitted[0]
        response[..., c] = [np.interp(inner_cosine, slab.cosine, side) for side in sides]
    return response


def rendered_slab_response(renderer: dermis.Renderer, skin: Skin, thickness_mm: float) -> Array:
    """Return reflectance and transmittance (2, n, 3) of a slab rendered by dermis, for n angles of incidence.

    They are measured far from the rim of the slab.

    thickness_mm : thickness of the slab [mm]
    """
    mesh, response = wedge(60.0, thickness_mm, thickness_mm), np.empty((2, len(INCIDENT_DEGREES), 3))
    for k, angle in enumerate(np.radians(INCIDENT_DEGREES)):
        beam = np.array([np.sin(angle), 0.0, np.cos(angle)])
        positions, normals, exitance = scattered_light(renderer, mesh, beam, skin, 256)
        central = np.abs(positions[:, :2]).max(axis=1) < 8.0
        for side in (0, 1):
            facing = central & ((2 * side - 1) * normals[:, 2] > 0.9)
            response[side, k] = exitance[facing].mean(axis=0) / np.cos(angle)
    return response


def skins_by_direction(medium: Medium, folder: str) -> dict[str, Skin]:
    """Return two skins that have the diffusion profile of a medium, keyed by their value of `Skin.direction`.

    Light leaves the skin "lambertian" with equal radiance in all directions. Light leaves the skin
    "half-space" with the angular distribution of a half-space.

    folder : folder in which the file of the profile is written
    """
    file = Path(folder) / f"{medium.name}_{medium.eta:g}.toml"
    fit = fit_gaussians(diffusion_profile(medium).ring_target(), GAUSSIAN_TERMS, profile_name=medium.name)
    write_profile(file, fit.profile, {})
    values = {"profile": str(file), "albedo": "profile", "energy": "none", "rho_s": 0.0}
    values |= {"specular": "none"} if medium.eta == 1.0 else {}
    return {name: Skin.model_validate(values | {"direction": name}) for name in ("lambertian", "half-space")}


def slab_error_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with errors of rendered slabs, by medium, `Skin.direction` and thickness."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, eta in SLAB_MEDIA:
            medium = published_media()[name].with_eta(eta)
            for direction, skin in skins_by_direction(medium, folder).items():
                for thickness in THICKNESSES_MM:
                    rendered = rendered_slab_response(renderer, skin, thickness)
                    cells = _error_cells(rendered, exact_slab_response(medium, thickness))
                    rows.append(f"| {name}, index {eta:g} | {direction} | {thickness:g} mm | {cells} |")
    return "\n".join(rows)


def forward_scattering_error_rows(renderer: dermis.Renderer) -> str:
    """Return Markdown rows with errors of rendered slabs against references with forward scattering.

    `Skin.direction` is "half-space" in all rows: the rendered skin reflects light with the angular
    distribution of a half-space. `Skin.anisotropy` is 0 in half of the rows, and the mean cosine of the
    reference in the others.
    """
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, eta in SLAB_MEDIA:
            medium = published_media()[name].with_eta(eta)
            half_space = skins_by_direction(medium, folder)["half-space"]
            for g in (0.0, FORWARD_G):
                skin = half_space.model_copy(update={"anisotropy": g})
                for thickness in THICKNESSES_MM:
                    rendered = rendered_slab_response(renderer, skin, thickness)
                    cells = _error_cells(rendered, exact_slab_response(medium, thickness, FORWARD_G))
                    rows.append(f"| {name}, index {eta:g} | {g:g} | {thickness:g} mm | {cells} |")
    return "\n".join(rows)


def forward_scattering_direction_rows() -> str:
    """Return Markdown rows with errors of the reflection of skin, over all directions of light and view.

    The errors are those of the model that `Skin.direction` "half-space" selects, relative to a half-space of
    the medium "skin1" with forward scattering. Each row belongs to one value of `Skin.anisotropy`, each
    column to one index of refraction. A cell has the errors in red, green and blue.
    """
    rows = []
    for g in (0.0, FORWARD_G):
        cells = []
        for eta in (1.0, 1.4):
            albedos = published_media()["skin1"].layers[0].alpha_prime
            cells.append(" ".join(f"{_direction_pairs_error(float(one), eta, g):.3f}" for one in albedos))
        rows.append(f"| anisotropy {g:g} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _direction_pairs_error(albedo: float, eta: float, skin_anisotropy: float) -> float:
    a, weights, exact = adding_doubling.half_space_radiance(
        albedo, eta, adding_doubling.DIRECTION_NODE_COUNT, FORWARD_G
    )
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    angular = anisotropic_response(float(directional_reflectance(1.0, albedo, eta)), eta, skin_anisotropy)
    table = np.interp(np.sqrt(air), np.linspace(0.0, 1.0, DIRECTION_ROWS), angular.relative_reflectance[:, 0])
    single = 1.0 / (a[:, None] + a) - mean_single_scattering_kernel(air, eta)
    response = table + angular.single_scattering[0] * single
    response *= (weights @ exact @ weights) / (table @ weights)
    weight = np.outer(weights, weights)
    return float(np.sqrt((weight * (response - exact) ** 2).sum() / (weight * exact**2).sum()))


def _error_cells(slab_response: Array, reference: Array) -> str:
    """Return two table cells with errors of transmittance, then two with errors of reflectance.

    The first cell of each pair has the relative RMS error. The second has, for each angle of incidence, the
    value in red divided by that of the reference.

    slab_response : (2, n, 3) reflectance, then transmittance, for n angles of incidence
    reference : exact values in the same form
    """
    flux, cells = np.sqrt(np.cos(np.radians(INCIDENT_DEGREES)))[:, None], []
    for side in (1, 0):
        ours, exact = slab_response[side], reference[side]
        error = np.linalg.norm(flux * (ours - exact)) / np.linalg.norm(flux * exact)
        red = ours[:, 0] / exact[:, 0]
        cells.append(f"{error:.3f} | {' '.join(f'{one:.2f}' for one in red)}")
    return " | ".join(cells)


def forward_scattering_rows() -> str:
    """Return Markdown rows with transmittance and reflectance of slabs in red light, by Monte Carlo.

    Each row has the values for isotropic scattering, then those for forward scattering. The reduced
    scattering coefficient is the same for both.
    """
    rows = []
    for eta in (1.0, 1.4):
        layer = published_media()["skin1"].layers[0]
        absorbed, scattered = float(layer.sigma_a[0]), float(layer.sigma_s_prime[0])
        for thickness in THICKNESSES_MM:
            cells = []
            for g in (0.0, FORWARD_G):
                slab = ScatteringLayer(absorbed, scattered / (1.0 - g), thickness, g, eta)
                run = trace_slab([slab], PHOTON_COUNT).relative_to_entering
                cells += [f"{run.total_transmittance:.3f}", f"{run.unscattered_transmittance:.3f}"]
                cells.append(f"{run.total_reflectance:.3f}")
            rows.append(f"| {eta:g} | {thickness:g} mm | {' | '.join(cells)} |")
    return "\n".join(rows)


def slab_error_tables(adapter: str = "auto") -> dict[str, str]:
    """Return Markdown rows with errors of slabs, keyed by placeholder of docs/templates/accuracy.md."""
    renderer = dermis.Renderer(adapter)
    return {
        "slab_errors": slab_error_rows(renderer),
        "slab_forward": forward_scattering_rows(),
        "slab_forward_errors": forward_scattering_error_rows(renderer),
        "forward_directions": forward_scattering_direction_rows(),
    }
