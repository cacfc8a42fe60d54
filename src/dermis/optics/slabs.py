"""Slabs of anisotropic media by adding and doubling, and half-spaces that scatter forward."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.directions import (
    KEPT,
    ROWS,
    Directions,
    albedo_returning,
    critical_cosine,
    directions,
    gaussian_nodes,
    internal_reflectance,
    interpolated,
    mean_of_once,
    refracted,
)

Floats = NDArray[np.float64]
NODES = 16
"""Cosines of those directions that leave a slab, and as many of those that are held back."""
DEEP = 1e4
"""Mean free paths that are as good as a half-space."""
_THINNEST = 1e-6  # optical thickness in which light scatters once at most
_NEAR = 3  # cosines by which those beyond the last one are told
_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class Phase:
    """How a medium scatters, all azimuths together.

    What is scattered straight on counts as not: a medium that scatters less stands for the true one.

    albedo : of single scattering of that medium [-]
    extinction, whole_extinction : of that medium and of the true one, over the reduced extinction [-]
    backward, forward : (m, m) from cosines to cosines, to the other side of the horizon and to the same; 1
        where light scatters alike in all directions [-]
    """

    albedo: float
    extinction: float
    whole_extinction: float
    backward: Floats
    forward: Floats


def phase(albedo: float, g: float, cosine: Floats, terms: int) -> Phase:
    """The scattering of Henyey and Greenstein, by polynomials of Legendre.

    albedo : reduced [-]
    g : mean cosine, 0 or more, under 1 [-]
    cosine : (m,) of directions
    terms : of the series; the rest goes straight on

    Sources: [HenyeyGreenstein1941]; [Wiscombe1977] for what goes straight on.
    """
    whole = 1.0 + albedo * g / (1.0 - g)
    single, straight = albedo / ((1.0 - g) * whole), g**terms
    order = np.arange(terms)
    moment = (2.0 * order + 1.0) * (g**order - straight) / (1.0 - straight)
    P = np.polynomial.legendre.legvander(cosine, terms - 1)
    left = 1.0 - straight * single
    return Phase(
        albedo=(1.0 - straight) * single / left,
        extinction=left * whole,
        whole_extinction=whole,
        backward=(P * moment * (-1.0) ** order) @ P.T,
        forward=(P * moment) @ P.T,
    )


@dataclass(frozen=True, eq=False)
class Slabs:
    """What becomes of the power that enters slabs of several thicknesses, from each of m directions.

    cosine : (m,) of entry, below the surface, that light from the air has [-]
    flux : (m,) share of uniform light from the air that enters there; they sum to 1
    back, through : (n, m) share that leaves after it scattered, on the side of entry and on the far one [-]
    """

    cosine: Floats
    flux: Floats
    back: Floats
    through: Floats


def slabs(albedo: float, optical_depth: ArrayLike, eta: float, nodes: int = NODES, g: float = 0.0) -> Slabs:
    """Slabs by adding and doubling; exact but for the number of directions.

    albedo : of single scattering, reduced where that goes forward [-]
    optical_depth : (n,) thickness in mean free paths, reduced ones likewise, above 0 [-]
    eta : index of refraction against the air on both sides, at least 1 [-]
    nodes : as `NODES`
    g : mean cosine of scattering, 0 or more [-]

    Source: [Chandrasekhar1960] section 50 for what layers do together.
    """
    tau = np.atleast_1d(np.asarray(optical_depth, np.float64))
    way = _Way.of(albedo, eta, nodes, g)
    times = way.times(float(tau.max()))
    *_, (R, T, straight) = _doubled(way, tau / 2.0**times, times)
    return _cut(way, R, T, straight)


def doubled_slabs(
    albedo: float, least: ArrayLike, times: int, eta: float, nodes: int = NODES, g: float = 0.0
) -> Slabs:
    """`slabs` of the least depths, of twice those and so on: each is on the way to the next.

    least : (n,) optical depths, of about the same size [-]
    times : that they are doubled; there are n (times + 1) slabs, ordered by times, then by `least`
    """
    way = _Way.of(albedo, eta, nodes, g)
    before = way.times(float(np.max(least)))
    made = list(_doubled(way, np.asarray(least, np.float64) / 2.0**before, before + times))[before:]
    R, T, straight = (np.concatenate(part) for part in zip(*made, strict=True))
    return _cut(way, R, T, straight)


def leaving_deep(albedo: float, eta: float, nodes: int, g: float) -> tuple[Floats, Floats, Floats]:
    """What a half-space makes of light by its directions.

    Cosines (m,) below the surface, shares (m,) of uniform light that enters or leaves there, and (m, m) light
    that leaves by direction, of exit first, over what enters: its mean by the shares is all that leaves.
    """
    way = _Way.of(albedo, eta, nodes, g)
    times = way.times(DEEP)
    *_, (R, T, straight) = _doubled(way, np.array([DEEP / 2.0**times]), times)
    back, _ = _between_faces(R * way.flux, T * way.flux, straight, way.held, R, T)
    leaving = (way.flux * (1.0 - way.held))[way.escapes]
    radiance = back[0][np.ix_(way.escapes, way.escapes)] * leaving.sum()
    return way.mu[way.escapes], leaving / leaving.sum(), radiance


@dataclass(frozen=True, eq=False)
class _Way:
    """How light goes on in a medium: cosines (m,), their shares of uniform light inside, what faces hold
    back, which of them leave, and what scattering does."""

    mu: Floats
    flux: Floats
    held: Floats
    escapes: NDArray[np.bool_]
    phase: Phase

    @classmethod
    def of(cls, albedo: float, eta: float, nodes: int, g: float) -> _Way:
        mu, weight = _cosines(eta, nodes)
        held, escapes = internal_reflectance(mu, eta), mu > critical_cosine(eta)
        return cls(mu, 2.0 * weight * mu, held, escapes, phase(albedo, g, mu, nodes))

    def times(self, depth: float) -> int:
        """How often slabs are doubled that begin so thin that light scatters in them once at most."""
        return int(np.ceil(np.log2(max(depth * self.phase.extinction / _THINNEST, 1.0))))


def _cut(way: _Way, R: Floats, T: Floats, straight: Floats) -> Slabs:
    """What slabs between two faces make of light from the air."""
    flux, escapes = way.flux, way.escapes
    back, through = _between_faces(R * flux, T * flux, straight, way.held, R, T)
    leaving = flux * (1.0 - way.held)
    entering = leaving[escapes] / leaving[escapes].sum()
    up, down = (np.einsum("k,nkm->nm", leaving, part[..., escapes]) for part in (back, through))
    if way.phase.extinction < way.phase.whole_extinction:  # what scattered straight on has scattered too
        whole = straight ** (way.phase.whole_extinction / way.phase.extinction)
        (up_on, down_on), (up_off, down_off) = (_unscattered(one, way.held) for one in (straight, whole))
        up, down = up + (up_on - up_off)[:, escapes], down + (down_on - down_off)[:, escapes]
    return Slabs(way.mu[escapes], entering, up, down)


def _unscattered(straight: Floats, held: Floats) -> tuple[Floats, Floats]:
    """(n, m) light that leaves as it entered, on the side of entry and on the far one."""
    down = (1.0 - held) * straight / (1.0 - (straight * held) ** 2)
    return down * straight * held, down


def _cosines(eta: float, nodes: int) -> tuple[Floats, Floats]:
    """Gaussian nodes and weights below the surface: those that escape, and those that it holds back."""
    critical = critical_cosine(eta)
    spans = [(critical, 1.0), (0.0, critical)] if critical > 0.0 else [(0.0, 1.0)]
    parts = [gaussian_nodes(low, high, nodes) for low, high in spans]
    mu, weight = (np.concatenate(both) for both in zip(*parts, strict=True))
    return mu, weight


def _doubled(way: _Way, tau: Floats, times: int) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Of slabs so thin, then of ones twice as thick each time: (n, m, m) radiance over pi, back and through,
    per power from each direction; (n, m) unscattered.

    tau : (n,) in reduced mean free paths
    """
    mu, flux, albedo = way.mu, way.flux, way.phase.albedo
    t = way.phase.extinction * tau[:, None, None]
    a, b = mu[:, None], mu[None, :]
    R = -0.25 * albedo / (a + b) * np.expm1(-t * (1.0 / a + 1.0 / b)) * way.phase.backward
    T = 0.25 * albedo * t / (a * b) * np.exp(-0.5 * t * (1.0 / a + 1.0 / b)) * way.phase.forward
    straight = np.exp(-t[..., 0] / mu)
    yield R, T, straight
    for _ in range(times):
        up, down = R * flux, T * flux + straight[:, :, None] * np.eye(len(mu))
        entering = R * straight[:, None, :]
        between = np.linalg.solve(np.eye(len(mu)) - up @ up, T + up @ entering)
        R, T = R + down @ (up @ between + entering), down @ between + T * straight[:, None, :]
        straight = straight**2
        yield R, T, straight


def _between_faces(
    up: Floats, down: Floats, straight: Floats, held: Floats, R: Floats, T: Floats
) -> tuple[Floats, Floats]:
    """Scattered radiance over pi below the upper and above the lower face, per power that enters.

    up, down : (n, m, m) what the slab makes of radiance: it reflects and scatters it through
    held : (m,) share that a face reflects back into the slab
    """
    if not held.any():
        return R, T
    unit, count = np.eye(len(held)), len(held)
    passing = (down + straight[:, :, None] * unit) * held
    around = np.block([[unit - up * held, -passing], [-passing, unit - up * held]])
    # What has not scattered goes to and fro between the faces by itself.
    once = 1.0 / (1.0 - (straight * held) ** 2)
    below = held * straight * once
    top = R * (once[:, None, :]) + T * below[:, None, :]
    bottom = T * once[:, None, :] + R * below[:, None, :]
    solved = np.linalg.solve(around, np.concatenate([top, bottom], axis=1))
    return solved[:, :count], solved[:, count:]


def forward_directions(total: ArrayLike, eta: float, g: float) -> Directions:
    """`directions` of half-spaces of the same reduced coefficients whose scattering goes forward.

    To what leaves at a slant there comes what the best fits to all pairs of directions differ by.

    total : (c,) that half-spaces which scatter alike in all directions return [-]
    eta : index of refraction against the air, at least 1 [-]
    g : mean cosine of scattering, 0 or more [-]
    """
    even = directions(total, eta)
    if g == 0.0:
        return even
    shares = np.atleast_1d(np.asarray(total, np.float64))
    found, plain = (
        np.stack([interpolated(partial(_numbers, eta, one), float(share)) for share in shares], axis=-1)
        for one in (g, 0.0)
    )
    once = even.once + found[ROWS + 1] - plain[ROWS + 1]
    return Directions(eta, found[:ROWS], found[ROWS], once, even.mean_once)


@lru_cache(maxsize=KEPT)
def _numbers(eta: float, g: float, total: float) -> Floats:
    """(ROWS + 2,) as `directions` has them."""
    a, share, radiance = leaving_deep(albedo_returning(total, eta), eta, NODES, g)
    returned = share @ radiance
    above = float(_beyond(a, returned, np.ones(1))[0])
    if above <= _LEAST:
        return np.append(np.ones(ROWS + 1), 0.0)
    table = _beyond(a, returned, refracted(np.linspace(0.0, 1.0, ROWS) ** 2, eta))
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    slant, uneven = 1.0 / (a[:, None] + a) - mean_of_once(air, eta), radiance - returned
    weight = np.outer(share, share)
    once = (weight * slant * uneven).sum() / (weight * slant**2).sum()
    return np.concatenate([table, [share @ returned, once]]) / above


def _beyond(known: Floats, values: Floats, cosine: Floats) -> Floats:
    """Values at cosines, between those known and a little beyond."""
    order = np.argsort(known)
    x, y = known[order], values[order]
    found = np.interp(cosine, x, y)
    for end, outside in ((slice(_NEAR), cosine < x[0]), (slice(-_NEAR, None), cosine > x[-1])):
        found = np.where(outside, np.polyval(np.polyfit(x[end], y[end], _NEAR - 1), cosine), found)
    return np.asarray(found)
