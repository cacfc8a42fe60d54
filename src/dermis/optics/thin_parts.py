"""What thin parts of a profile's medium let through, and what they therefore return less, by Gaussians."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.optics.diffusion import hankel
from dermis.optics.diffusion.boundary import mismatch
from dermis.optics.diffusion.layered_diffusion import respond_sheets
from dermis.optics.directions import KEPT, interpolated, refracted
from dermis.optics.directions import ROWS as DIRECTIONS
from dermis.optics.flesh import LEAST_ALBEDO, MOST_ALBEDO, albedo_of_total
from dermis.optics.media import Layer, Medium
from dermis.optics.slabs import DEEP, NODES, Slabs, doubled_slabs, slabs

Floats = NDArray[np.float64]
ROWS = 32
"""Thicknesses of the tables."""
_LAW_DEPTH = 10.0  # mean free paths from which on directions of entry count alike
_FEW = 8  # cosines for what uniform light does
_LEAST_DEPTHS, _DOUBLED = 1e-4 * np.array([1.0, 2.0**0.5]), 25  # of slabs that are cut [mean free path]
_DEPTHS = (_LEAST_DEPTHS * 2.0 ** np.arange(_DOUBLED + 1)[:, None]).ravel()
_LEAST = 1e-300  # share that passes black slabs as deep as the last
_FREQUENCIES = np.geomspace(0.02, 5.0, 24)  # at which shapes are compared [1/mean free path]


@dataclass(frozen=True, eq=False)
class ThinParts:
    """Tables by thickness, evenly spaced in its root, of weights of a profile's k Gaussians in 3 channels.

    Both are shares of what a half-space returns of the same light.

    reach_mm : thickness of the last row; that of the first is 0
    through : (ROWS, k, 3) that leave on the far side [-]
    lost : (ROWS, k, 3) share that no longer leaves on the near side, spread as what leaves on the far one [-]
    deep : (ROWS,) how far directions of entry count as in deep slabs, see `across` [-1, 1]
    """

    reach_mm: float
    through: Floats
    lost: Floats
    deep: Floats


def thin_parts(body: Medium, variance_mm2: Floats, reach_mm: float, g: float = 0.0) -> ThinParts:
    """The tables of slabs that are cut from a half-space of one layer.

    variance_mm2 : (k,) of the Gaussians that spread light
    reach_mm : largest thickness of use
    g : mean cosine of the body's scattering, whose coefficients are reduced [-]

    How much goes through is exact, for uniform light from all directions, as its change with direction nearly
    is; how wide it spreads is layered diffusion's, for light from above.

    Sources: [Chandrasekhar1960] for the amounts, [Kienle1998] for the widths.
    """
    depth = reach_mm * np.linspace(0.0, 1.0, ROWS) ** 2
    through, lost = np.zeros((2, ROWS, len(variance_mm2), body.channels))
    deep, weight = np.zeros((2, ROWS, body.channels))
    for c, share in enumerate(_shares(body.layers[0], depth[1:], body.eta, g)):
        shape = _shapes(body.channel(c), depth[1:], variance_mm2)
        through[1:, :, c], lost[1:, :, c] = share.passed[:, None] * shape, share.lost[:, None] * shape
        deep[1:, c], weight[1:, c] = share.deep, share.amount
        lost[0, :, c] = shape[0]
    deep[0], weight[0] = deep[1], weight[1]
    mean = (weight * deep).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-12)
    return ThinParts(reach_mm, through, lost, np.clip(mean, -1.0, 1.0))


def across(total: Floats, eta: float, counted: bool = False, g: float = 0.0) -> Floats:
    """(directions.ROWS, c) what passes deep slabs from a direction, over what does of uniform light.

    Both for light of which as much comes back; by evenly spaced roots of the cosine, as `directions` has it.

    total : (c,) that the half-space returns of what enters perpendicularly [-]
    counted : whether the profile is of photons, as of `GaussianSum`
    g : as of `thin_parts`
    """
    return np.stack([interpolated(partial(_across, eta, counted, g), float(one)) for one in total], axis=-1)


@lru_cache(maxsize=KEPT)
def _across(eta: float, counted: bool, g: float, total: float) -> Floats:
    cosine = refracted(np.linspace(0.0, 1.0, DIRECTIONS) ** 2, eta)
    whole, law = _law(albedo_of_total(total, eta, counted), eta, NODES, g)
    return np.interp(cosine, whole.cosine, law)


def _law(albedo: float, eta: float, nodes: int, g: float) -> tuple[Slabs, Floats]:
    """The half-space, and what passes deep slabs of it by its cosines of entry, as `across` has it."""
    whole = slabs(albedo, DEEP, eta, nodes, g)
    return whole, _slanted(slabs(albedo, _LAW_DEPTH, eta, nodes, g), whole)[0]


def _slanted(cut: Slabs, whole: Slabs) -> Floats:
    """(n, m) what passes of light from each direction, as `across` has it."""
    returned = whole.back[0] / _uniform(whole, whole.back)
    passing = np.maximum(_uniform(cut, cut.through), _LEAST)[:, None]
    return np.asarray(cut.through / passing / returned)


class _Shares(NamedTuple):
    """Of uniform light by thickness, (n,) each: what comes through; this and what returns no longer over what
    a half-space returns; and `ThinParts.deep`."""

    amount: Floats
    passed: Floats
    lost: Floats
    deep: Floats


def _shares(layer: Layer, depth_mm: Floats, eta: float, g: float) -> Iterator[_Shares]:
    """Of each channel, by cubics between depths for which an albedo's slabs are cut once."""
    from scipy.interpolate import CubicSpline

    roots = np.sqrt(1.0 - layer.alpha_prime).tolist()
    cut = [interpolated(partial(_by_depth, eta, g), root) for root in roots]
    spline = CubicSpline(np.log(_DEPTHS), np.stack(cut, axis=1))
    for c, extinction in enumerate(layer.sigma_t_prime.tolist()):
        depth = np.clip(extinction * depth_mm, _DEPTHS[0], _DEPTHS[-1])
        yield _Shares(*spline(np.log(depth))[:, c].T)


@lru_cache(maxsize=KEPT)
def _by_depth(eta: float, g: float, root: float) -> Floats:
    """(n, 4) what `_Shares` holds by `_DEPTHS`, for the root of what a scattering absorbs."""
    return np.stack(_cut(min(max(1.0 - root**2, LEAST_ALBEDO), MOST_ALBEDO), eta, g), axis=-1)


def _cut(albedo: float, eta: float, g: float) -> _Shares:
    """Of slabs of `_DEPTHS`."""
    cut = doubled_slabs(albedo, _LEAST_DEPTHS, _DOUBLED, eta, _FEW, g)
    whole, slanted = _law(albedo, eta, _FEW, g)
    returned, law = _uniform(whole, whole.back), slanted - 1.0
    weight = whole.flux * whole.back[0]
    deep = (_slanted(cut, whole) - 1.0) @ (weight * law) / (weight * law**2).sum()
    amount, lost = _uniform(cut, cut.through), np.maximum(1.0 - _uniform(cut, cut.back) / returned, 0.0)
    return _Shares(amount, amount / returned, lost, deep)


def _uniform(of: Slabs, share: Floats) -> Floats:
    return np.asarray(share @ of.flux)


def _shapes(body: Medium, depth_mm: Floats, variance_mm2: Floats) -> Floats:
    """(n, k) weights of Gaussians, which sum to 1, that spread as what comes through each thickness."""
    from scipy.optimize import nnls

    layer, A, sure = body.layers[0], mismatch(body.eta, "exact"), 100.0
    s = _FREQUENCIES * float(layer.sigma_t_prime[0])
    passed = respond_sheets(np.concatenate([hankel.STILL, s]), layer, depth_mm, A)[1][..., 0]
    bells = np.vstack([np.exp(-0.5 * variance_mm2 * s[:, None] ** 2), np.full((1, len(variance_mm2)), sure)])
    shape = passed[:, 1:] / np.maximum(passed[:, :1], _LEAST)  # deep in dark flesh nothing passes
    made = np.stack([nnls(bells, np.append(one, sure))[0] for one in shape])
    return np.asarray(made / made.sum(axis=1, keepdims=True))
