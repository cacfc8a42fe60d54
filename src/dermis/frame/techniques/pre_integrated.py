"""Pre-integrated skin shading: tables of scattered light on spheres and across shadow edges [Penner2011]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.frame.features.shape import curvature
from dermis.frame.inputs import FrameInputs
from dermis.frame.technique import TechniqueResources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import ComputeProgram, Device, Graph, Memo, Texture, UniformRecord
from dermis.gpu.textures import texture_from_array
from dermis.optics.fits.separable import preintegrated_kernel
from dermis.optics.gaussians import Floats, GaussianSum
from dermis.scene.settings import Settings

MAX_CURVATURE_PER_MM = 0.5
"""Curvature of the last row of the sphere table [1/mm], a radius of 2 mm."""

_COSINE_COUNT = 257  # odd, so that one column is N.L = 0, where incident light begins
_CURVATURE_ROWS, _SHADOW_EDGE_ROWS = 33, 9  # as in pre_integrated.wgsl
_QUADRATURE_NODE_COUNT = 48
_INTEGRATION_SIGMAS = 7.0  # standard deviations over which a Gaussian is integrated
_SHADOW_TAIL_FRACTION = (
    0.01  # fraction of the light that scatters farther across a shadow edge than the table covers
)
_MAX_PENUMBRA_MM = 8.0


@dataclass(frozen=True, eq=False)
class PreIntegratedTables(TechniqueResources):
    """Tables of scattered light for a profile, which the shading pass reads.

    table : texture with the rows of `sphere_irradiance_table`, followed by one row of `shadow_edge_row` for
        each of several widths of the shadow filter
    penumbra_width_mm : distance over which light scatters across the edge of a shadow [mm]
    relief_mm : (3,) standard deviations of the Gaussians that smooth the relief for red, green and blue [mm]
    """

    table: Texture
    penumbra_width_mm: float
    relief_mm: Floats


class PreIntegratedSkin(Technique):
    """Technique that reads scattered light from tables: one for curved surfaces, and one for shadow edges."""

    sources = ("Penner2011",)
    needs_curvature = True
    shade_constants = (("PRE_INTEGRATED", 1),)

    def make_resources(
        self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum
    ) -> PreIntegratedTables:
        """Return the tables of scattered light for the profile."""
        return memo.get(make_pre_integrated_tables, device, profile)

    def write_view_record(
        self, view: UniformRecord, shade: ComputeProgram, resources: TechniqueResources | None
    ) -> None:
        """Write the members of the shading record that only this technique reads.

        These are the largest curvature in the tables, the penumbra width, and the widths of the Gaussians
        that smooth the relief.

        view : uniform record of the shading pass
        shade : program of the shading pass
        resources : result of `make_resources`
        """
        assert isinstance(resources, PreIntegratedTables)
        scales = {
            "max_curvature": MAX_CURVATURE_PER_MM,
            "penumbra": resources.penumbra_width_mm,
            "relief": resources.relief_mm,
        }
        view["pre"] = shade.make_record("PreIntegrated", **scales)

    def scatter(self, graph: Graph, inputs: FrameInputs) -> Texture:
        """Declare the passes that compute curvature, and return the texture of the tables.

        This texture, `PreIntegratedTables.table`, takes the place of the scattered light on an atlas, which
        this technique does not compute.
        """
        resources, tables = inputs.resources, inputs.resources.technique
        assert resources.shape.curvature is not None and isinstance(tables, PreIntegratedTables)
        graph.add_replayable(curvature.draw, resources.head, resources.shape.curvature)
        return tables.table


TECHNIQUE = PreIntegratedSkin()


def make_pre_integrated_tables(device: Device, profile: GaussianSum) -> PreIntegratedTables:
    """Compute the tables of scattered light for a profile, and upload them."""
    penumbra = penumbra_width_mm(profile)
    edges = [
        shadow_edge_row(profile, penumbra, width) for width in np.linspace(0.0, penumbra, _SHADOW_EDGE_ROWS)
    ]
    rows = np.concatenate([sphere_irradiance_table(profile), np.stack(edges)])
    table = np.concatenate([rows, np.zeros((*rows.shape[:2], 1))], axis=-1)
    return PreIntegratedTables(
        texture_from_array(device, table, "rgba32float"), penumbra, half_light_sigma_mm(profile)
    )


def sphere_irradiance_table(profile: GaussianSum) -> Floats:
    """Return a table (n, m, c) of the irradiance max(N.L, 0) after scattering on spheres [-].

    N is the normal and L the direction to the light. The n rows are for curvatures from 0 to
    `MAX_CURVATURE_PER_MM`, the m columns for N.L from -1 to 1, and c is the number of colour channels.

    The profile is integrated over the sphere and normalised there. [Penner2011] integrates around a ring
    instead, which does not conserve energy.
    """
    cosines = np.linspace(-1.0, 1.0, _COSINE_COUNT)
    rows = [np.repeat(np.maximum(cosines, 0.0)[:, None], len(profile.albedo), axis=1)]
    fractions = profile.weight / profile.albedo
    for curvature_per_mm in np.linspace(0.0, MAX_CURVATURE_PER_MM, _CURVATURE_ROWS)[1:]:
        concentration = 1.0 / (curvature_per_mm**2 * profile.variance_mm2)
        rows.append(np.stack([scattered_cosine(cosines, k) for k in concentration], axis=1) @ fractions)
    return np.stack(rows)


def scattered_cosine(cosines: ArrayLike, concentration: float) -> Floats:
    """Return max(N.L, 0) convolved on the sphere with the normalised kernel exp(k cos a) [-].

    The angle a is the angle between two points of the sphere, as seen from its centre. The kernel is close to
    a Gaussian of the distance between the points.

    cosines : values of N.L at which the result is evaluated [-]
    concentration : k, the squared radius of the sphere divided by the variance of this Gaussian [-]
    """
    from scipy.special import i0e

    theta = np.arccos(np.asarray(cosines, dtype=np.float64))
    extent = _INTEGRATION_SIGMAS / np.sqrt(concentration)
    low, high = np.clip(theta - extent, 0.0, 0.5 * np.pi), np.clip(theta + extent, 0.0, 0.5 * np.pi)
    x, w = np.polynomial.legendre.leggauss(_QUADRATURE_NODE_COUNT)
    half = 0.5 * (high - low)[..., None]
    lit, theta = low[..., None] + half * (1.0 + x), theta[..., None]
    ring = i0e(concentration * np.sin(theta) * np.sin(lit))  # the kernel over all azimuths
    bell = np.exp(concentration * (np.cos(theta - lit) - 1.0)) * ring
    scale = concentration / -np.expm1(-2.0 * concentration)
    return np.asarray(scale * (half * w * np.cos(lit) * np.sin(lit) * bell).sum(axis=-1))


def shadow_edge_row(profile: GaussianSum, radius_mm: float, half_width_mm: float = 0.0) -> Floats:
    """Return the (m, c) light near a straight shadow edge after scattering [-].

    The m points are evenly spaced from the dark to the lit side, and c is the number of colour channels.

    radius_mm : distance of the first point and of the last point from the edge [mm]
    half_width_mm : half width of the tent filter that already softens the edge [mm]
    """
    kernel = preintegrated_kernel(profile)
    distance = radius_mm * np.linspace(-1.0, 1.0, _COSINE_COUNT)
    x, w = np.polynomial.legendre.leggauss(_QUADRATURE_NODE_COUNT)
    x, w = 0.5 + 0.5 * x, w * (0.5 - 0.5 * x)  # one half of the tent, normalised
    ends = half_width_mm * np.concatenate([x, -x])
    lit = np.concatenate([0.5 * w, 0.5 * w]) @ kernel.half_line_integral(distance[:, None] - ends)
    return np.asarray(np.clip(0.5 + 0.5 * lit / lit[-1], 0.0, 1.0))


def penumbra_width_mm(profile: GaussianSum) -> float:
    """Return the distance from a shadow edge beyond which scattering changes light by at most 1 % [mm]."""
    distance = np.geomspace(0.05, _MAX_PENUMBRA_MM, 512)
    beyond = (0.5 - preintegrated_kernel(profile).half_line_integral(distance)).max(
        axis=1
    ) > _SHADOW_TAIL_FRACTION
    return float(distance[min(int(beyond.sum()), len(distance) - 1)])


def half_light_sigma_mm(profile: GaussianSum) -> Floats:
    """Return (c,) standard deviations, one for each colour channel of a profile [mm].

    A Gaussian with this standard deviation has the same half-light radius as the profile. The half-light
    radius is the radius within which half of the light emerges.
    """
    radius = np.geomspace(1e-3, 100.0, 2048)
    within = profile.energy_within(radius) / profile.albedo
    half = [np.interp(0.5, channel, radius) for channel in within.T]
    return np.array(half, dtype=np.float64) / float(np.sqrt(2.0 * np.log(2.0)))
