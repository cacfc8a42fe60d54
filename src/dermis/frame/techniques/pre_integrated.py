"""Tables of scattered light on spheres and across the edges of shadows [Penner2011]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.frame.features.shape import curvature
from dermis.frame.inputs import Inputs
from dermis.frame.technique import TechniqueResources
from dermis.frame.techniques.technique import Technique
from dermis.gpu import ComputeProgram, Device, Graph, Memo, Record, Texture
from dermis.gpu.textures import texture_from
from dermis.optics.fits.separable import preintegrate
from dermis.optics.gaussians import Floats, GaussianSum
from dermis.scene.settings import Settings

MOST_CURVED = 0.5
"""Curvature of the last row of spheres [1/mm]: a radius of 2 mm."""

_COSINES = 257  # odd: N.L = 0, where unspread light begins, has a column of its own
_CURVATURES, _EDGES = 33, 9  # as in pre_integrated.wgsl
_NODES = 48
_SIGMAS = 7.0  # standard deviations over which a Gaussian is integrated
_SHADOW_TAIL = 0.01  # of the light that scatters across a shadow's edge: share beyond the table
_MOST_PENUMBRA_MM = 8.0


@dataclass(frozen=True, eq=False)
class PreIntegrated(TechniqueResources):
    """What the shading pass reads in place of light on an atlas.

    table : texture of `tables`
    penumbra_mm : distance over which light spreads across a shadow's edge
    relief_mm : (3,) standard deviations of the Gaussians that smooth the relief for red, green and blue
    """

    table: Texture
    penumbra_mm: float
    relief_mm: Floats


class PreIntegratedSkin(Technique):
    """Light by tables over curvature, and across the edges of shadows."""

    sources = ("Penner2011",)
    curved = True
    shade_constants = (("PRE_INTEGRATED", 1),)

    def make(self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum) -> PreIntegrated:
        """The profile's tables."""
        return memo.keep(pre_integrate, device, profile)

    def describe(self, view: Record, shade: ComputeProgram, own: TechniqueResources | None) -> None:
        """Write the tables' scales."""
        assert isinstance(own, PreIntegrated)
        scales = {"most_curved": MOST_CURVED, "penumbra": own.penumbra_mm, "relief": own.relief_mm}
        view["pre"] = shade.record("PreIntegrated", **scales)

    def scatter(self, graph: Graph, inputs: Inputs) -> Texture:
        """Return the tables in place of light on the atlas."""
        made, own = inputs.resources, inputs.resources.technique
        assert made.shape.curvature is not None and isinstance(own, PreIntegrated)
        graph.repeat(curvature.draw, made.head, made.shape.curvature)
        return own.table


TECHNIQUE = PreIntegratedSkin()


def pre_integrate(device: Device, profile: GaussianSum) -> PreIntegrated:
    """The tables of a profile, on the device."""
    penumbra = penumbra_mm(profile)
    edges = [shadow_edge(profile, penumbra, width) for width in np.linspace(0.0, penumbra, _EDGES)]
    rows = np.concatenate([lit_spheres(profile), np.stack(edges)])
    table = np.concatenate([rows, np.zeros((*rows.shape[:2], 1))], axis=-1)
    return PreIntegrated(texture_from(device, table, "rgba32float"), penumbra, half_light_sigma(profile))


def lit_spheres(profile: GaussianSum) -> Floats:
    """Scattered max(N.L, 0) on spheres, (n, m, c): rows by curvature to `MOST_CURVED`, columns by N.L [-].

    Light spreads by straight distance: on a sphere of radius r a Gaussian of variance v is
    exp(r^2/v (cos a - 1)), normalised over the sphere. [Penner2011] integrates around a ring instead, which
    does not conserve light.
    """
    cosines = np.linspace(-1.0, 1.0, _COSINES)
    rows = [np.repeat(np.maximum(cosines, 0.0)[:, None], len(profile.albedo), axis=1)]
    share = profile.weight / profile.albedo
    for bent in np.linspace(0.0, MOST_CURVED, _CURVATURES)[1:]:
        concentration = 1.0 / (bent**2 * profile.variance_mm2)
        rows.append(np.stack([spread_cosine(cosines, k) for k in concentration], axis=1) @ share)
    return np.stack(rows)


def spread_cosine(cosines: ArrayLike, concentration: float) -> Floats:
    """The clamped cosine convolved on the sphere with exp(k cos a) at unit integral, at N.L = cosines [-].

    concentration : k, the radius squared over the variance [-]
    """
    from scipy.special import i0e

    theta = np.arccos(np.asarray(cosines, dtype=np.float64))
    reach = _SIGMAS / np.sqrt(concentration)
    low, high = np.clip(theta - reach, 0.0, 0.5 * np.pi), np.clip(theta + reach, 0.0, 0.5 * np.pi)
    x, w = np.polynomial.legendre.leggauss(_NODES)
    half = 0.5 * (high - low)[..., None]
    lit, theta = low[..., None] + half * (1.0 + x), theta[..., None]
    ring = i0e(concentration * np.sin(theta) * np.sin(lit))  # the kernel over all azimuths
    bell = np.exp(concentration * (np.cos(theta - lit) - 1.0)) * ring
    scale = concentration / -np.expm1(-2.0 * concentration)
    return np.asarray(scale * (half * w * np.cos(lit) * np.sin(lit) * bell).sum(axis=-1))


def shadow_edge(profile: GaussianSum, radius_mm: float, half_width_mm: float = 0.0) -> Floats:
    """Scattered light across a shadow's straight edge, (m, c), from -radius (dark) to the radius (lit) [-].

    half_width_mm : of the tent filter that already softens the edge
    """
    kernel = preintegrate(profile)
    distance = radius_mm * np.linspace(-1.0, 1.0, _COSINES)
    x, w = np.polynomial.legendre.leggauss(_NODES)
    x, w = 0.5 + 0.5 * x, w * (0.5 - 0.5 * x)  # one half of the tent, whose light is 1
    ends = half_width_mm * np.concatenate([x, -x])
    lit = np.concatenate([0.5 * w, 0.5 * w]) @ kernel.one_side(distance[:, None] - ends)
    return np.asarray(np.clip(0.5 + 0.5 * lit / lit[-1], 0.0, 1.0))


def penumbra_mm(profile: GaussianSum) -> float:
    """Distance from a shadow's edge beyond which scattering changes the light by at most 1 % [mm]."""
    distance = np.geomspace(0.05, _MOST_PENUMBRA_MM, 512)
    beyond = (0.5 - preintegrate(profile).one_side(distance)).max(axis=1) > _SHADOW_TAIL
    return float(distance[min(int(beyond.sum()), len(distance) - 1)])


def half_light_sigma(profile: GaussianSum) -> Floats:
    """Standard deviation of the Gaussian with the profile's half-light radius, (c,) [mm]."""
    radius = np.geomspace(1e-3, 100.0, 2048)
    within = profile.within(radius) / profile.albedo
    half = [np.interp(0.5, channel, radius) for channel in within.T]
    return np.array(half, dtype=np.float64) / float(np.sqrt(2.0 * np.log(2.0)))
