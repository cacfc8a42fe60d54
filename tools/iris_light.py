"""Make src/dermis/mesh/iris_light.csv: light that an iris receives through the cornea.

Takes about 20 s. Parallel light from 18 directions is refracted at the cornea by Snell's law and counted on
the plane of the iris. Polynomials of position and direction are fitted to the irradiance.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.atomic_write import atomic_file
from dermis.base.command_line import run_script
from dermis.mesh.eyeball import CORNEA_MM, IRIS_MM, LIMBUS_MM, cornea_centre_mm, iris_plane_mm
from dermis.mesh.iris_light import direct_terms
from dermis.specular.fresnel import dielectric

Doubles = NDArray[np.float64]
OUT = Path(__file__).parent.parent / "src" / "dermis" / "mesh" / "iris_light.csv"
ETA = 1.336
RAYS_ACROSS = 1500
BINS_ACROSS = 24
FITTED_RADIUS_MM = 5.45  # up to the rim of the iris, where bins are only partly lit
ANGLES_DEGREES = np.arange(2.5, 90.0, 5.0)
SKY_DEGREES = 75.0  # from the axis; the lids hide the rest
RARE_DEGREES = 75.0  # from here on, directions have half the weight
MIN_IRRADIANCE = 0.02
ROUNDS = 20
HEAD = """\
# quantity: coefficients of polynomials for the irradiance of the iris through the cornea
#   direct: by parallel light, relative to the irradiance of a surface that faces the light, without
#     reflection; the terms are those of dermis.mesh.iris_light
#   sky: by a uniform sky up to 75 degrees from the axis, relative to that of a flat surface below a whole
#     sky; powers of the squared distance from the axis
# unit: dimensionless, for positions relative to the radius of the iris
# source: tools/iris_light.py, least squares over refracted rays
# licence: Apache-2.0
"""


def main() -> None:
    """Trace rays, fit the polynomials and write the table."""
    middle = (np.arange(BINS_ACROSS) + 0.5) * 2 * IRIS_MM / BINS_ACROSS - IRIS_MM
    x, y = np.meshgrid(middle, middle, indexing="ij")
    square = (x**2 + y**2) / IRIS_MM**2
    inside = square < (FITTED_RADIUS_MM / IRIS_MM) ** 2
    terms, irradiance, weights, sky = list[Doubles](), list[Doubles](), list[Doubles](), np.zeros_like(square)
    for degrees in ANGLES_DEGREES:
        sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        direct, transmitted = traced_irradiance(np.array([sine, 0.0, cosine]))
        terms.append(direct_terms(square[inside], x[inside] * sine / IRIS_MM, np.full(inside.sum(), cosine)))
        irradiance.append(direct[inside])
        weights.append(np.full(inside.sum(), np.sqrt(sine * (1.0 if degrees < RARE_DEGREES else 0.5))))
        sky += transmitted * 2.0 * sine * np.radians(5.0) * (degrees < SKY_DEGREES)
    coefficients = fit_positive(np.concatenate(terms), np.concatenate(irradiance), np.concatenate(weights))
    angles = np.radians(ANGLES_DEGREES)
    flat = (transmittance(np.cos(angles)) * np.cos(angles) * 2.0 * np.sin(angles)).sum() * np.radians(5.0)
    powers = np.polyfit(square[inside], sky[inside] / flat, 3)[::-1]
    lines = [f"direct,{k},{value:.4f}" for k, value in enumerate(coefficients)]
    lines += [f"sky,{k},{value:.4f}" for k, value in enumerate(powers)]
    with atomic_file(OUT) as trial:
        trial.write_text(HEAD + "\n".join(["light,term,coefficient", *lines, ""]), encoding="utf-8")


def transmittance(cosine: Doubles) -> Doubles:
    """Return the fraction of unpolarised light that the cornea transmits."""
    return np.asarray(1.0 - dielectric(cosine, ETA))


def traced_irradiance(to_light: Doubles) -> tuple[Doubles, Doubles]:
    """Return the irradiance (b, b) on the iris by parallel light, without and with reflection at the cornea.

    to_light : (3,) unit direction to the light, z along the axis of the eye
    """
    step = 2.0 * LIMBUS_MM / RAYS_ACROSS
    grid = (np.arange(RAYS_ACROSS) + 0.5) * step - LIMBUS_MM
    entry = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    entry = entry[(entry**2).sum(axis=1) < LIMBUS_MM**2]
    height = np.sqrt(CORNEA_MM**2 - (entry**2).sum(axis=1))
    normal = np.column_stack([entry, height]) / CORNEA_MM
    cosine = normal @ to_light
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / ETA**2)
    direction = -to_light / ETA + (cosine / ETA - inside)[:, None] * normal
    z = cornea_centre_mm() + height
    at = entry + ((iris_plane_mm() - z) / direction[:, 2])[:, None] * direction[:, :2]
    area = step**2 * CORNEA_MM / height
    edges = np.linspace(-IRIS_MM, IRIS_MM, BINS_ACROSS + 1)
    lit = cosine > 0.0
    flux = np.where(lit, cosine * area, 0.0)
    passed = flux * np.where(lit, transmittance(np.where(lit, cosine, 1.0)), 0.0)
    bin_mm2 = (2.0 * IRIS_MM / BINS_ACROSS) ** 2
    bins = (edges, edges)
    direct, transmitted = (
        np.histogram2d(at[:, 0], at[:, 1], bins=bins, weights=one)[0] for one in (flux, passed)
    )
    return direct / bin_mm2, transmitted / bin_mm2


def fit_positive(terms: Doubles, values: Doubles, weights: Doubles) -> Doubles:
    """Return coefficients (k,) of a fit that is clamped at 0, where points do not count."""
    used = values > MIN_IRRADIANCE
    for _ in range(ROUNDS):
        root = weights[used]
        found = np.linalg.lstsq(terms[used] * root[:, None], values[used] * root, rcond=None)[0]
        used = (values > MIN_IRRADIANCE) | (terms @ found > 0.0)
    return np.asarray(found)


if __name__ == "__main__":
    run_script(main)
