"""Errors of the albedo tables of surface reflection, and white furnace tests."""

from __future__ import annotations

import timeit
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from dermis.apps.validation.pages import print_tables
from dermis.specular.albedo import TABLE_COSINES, TABLE_ROUGHNESSES, albedo_table, directional_albedo
from dermis.specular.beckmann import beckmann, beckmann_table
from dermis.specular.fresnel import (
    ENERGY_SCHEMES,
    EnergyConservationScheme,
    hemispherical_reflectance,
    schlick,
)
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
VIEW_COSINES = (np.arange(200) + 0.5) / 200
ENERGY_MODELS = {
    "none": ENERGY_SCHEMES["none"],
    "published": ENERGY_SCHEMES["published"],
    "divided by π, internally reflected light lost": EnergyConservationScheme(
        1.0, returns_internal_light=False
    ),
    "full": ENERGY_SCHEMES["full"],
}
ROUGHNESS_AND_STRENGTH = ((0.1, 0.18), (0.3, 0.18), (0.5, 0.18), (0.3, 1.0))
REFERENCE_QUADRATURE_NODE_COUNTS = (96, 96)


def print_specular_errors() -> None:
    """Print tables with errors of directional albedos, and with results of white furnace tests."""
    print_tables(specular_error_tables())


def read_albedo(lobe_model: str, cosine: Floats, roughness_m: Floats) -> Floats:
    """Return directional and mean albedo (..., 2) of a lobe, interpolated in its table as in the shader."""
    axes = np.sqrt(TABLE_ROUGHNESSES), np.sqrt(TABLE_COSINES)
    coordinates = np.stack(np.broadcast_arrays(np.sqrt(roughness_m), np.sqrt(cosine)), axis=-1)
    return np.asarray(RegularGridInterpolator(axes, albedo_table(lobe_model).astype(float))(coordinates))


def albedo_rows() -> str:
    """Return Markdown rows with errors of each lobe's directional albedo, and the time to tabulate it [ms].

    Each row has the error of the quadrature, then the error of the table that is computed by this quadrature.
    """
    m, c = np.linspace(0.1, 0.5, 17)[:, None], np.linspace(0.05, 1.0, 39)
    rows = []
    for name, model in MODELS.items():
        if name == "kelemen-direct":
            continue
        dense = directional_albedo(c, m, model.lobe, node_counts=REFERENCE_QUADRATURE_NODE_COUNTS)
        ms = 1e3 * min(timeit.repeat(partial(albedo_table.__wrapped__, name), number=1, repeat=5))
        errors = (directional_albedo(c, m, model.lobe), read_albedo(name, c, m)[..., 0])
        cells = [f"{100 * np.abs(one / dense - 1).max():.1g} %" for one in errors]
        rows.append(f"| {name} | {' | '.join(cells)} | {ms:.0f} ms |")
    return "\n".join(rows)


def beckmann_table_error() -> float:
    """Return the largest relative error of the Beckmann distribution when it is interpolated in its table.

    Values of the distribution below 0.001 are not compared.
    """
    m, c = np.meshgrid(np.linspace(0.1, 0.5, 23), np.linspace(0.05, 1.0, 61), indexing="ij")
    rows, columns = beckmann_table().shape
    axes = [(np.arange(rows) + 0.5) / rows, np.arange(columns) / (columns - 1)]
    peak = (2 * RegularGridInterpolator(axes, beckmann_table())(np.stack([m, c], axis=-1))) ** 10
    exact = beckmann(c, m)
    visible = exact > 1e-3  # smaller values of the lobe are not visible
    return float(np.abs(peak[visible] / exact[visible] - 1).max())


def furnace_cell(energy_scheme: EnergyConservationScheme, roughness_m: float, rho_s: float) -> str:
    """Return a table cell with results of a white furnace test: a white sphere in uniform light.

    The results are the minimum, the mean and the maximum ratio of outgoing to incoming light.

    energy_scheme : scheme by which the skin conserves energy
    roughness_m : roughness of the surface
    rho_s : specular strength of the surface
    """
    albedo, mean = (read_albedo("kelemen", VIEW_COSINES, np.array(roughness_m))[..., k] for k in (0, 1))
    exact = directional_albedo(VIEW_COSINES, roughness_m)
    entered = energy_scheme.entering_fraction(mean, rho_s)
    out = rho_s * exact + entered * energy_scheme.exitance_factor(albedo, mean, rho_s)
    return f"{out.min():.3f} {(out * VIEW_COSINES).sum() / VIEW_COSINES.sum():.3f} {out.max():.3f}"


def furnace_rows() -> str:
    """Return Markdown rows with results of white furnace tests, one for each energy conservation scheme."""
    return "\n".join(
        f"| {name} | {' | '.join(furnace_cell(model, m, rho_s) for m, rho_s in ROUGHNESS_AND_STRENGTH)} |"
        for name, model in ENERGY_MODELS.items()
    )


def specular_error_tables() -> dict[str, str]:
    """Return texts on errors of surface reflection, keyed by placeholder of docs/templates/accuracy.md."""
    below = (np.arange(4000) + 0.5) / 4000
    kelemen = float((directional_albedo(below, 0.3) * below).sum() / below.sum())
    return {
        "albedos": albedo_rows(),
        "peak": f"{100 * beckmann_table_error():.1f} %",
        "furnace": furnace_rows(),
        "smooth": f"{hemispherical_reflectance():.1%}",
        "smooth_schlick": f"{hemispherical_reflectance(schlick):.1%}",
        "rough": f"{kelemen:.1%}",
        "rough_in_use": f"{0.18 * kelemen:.1%}",
    }
