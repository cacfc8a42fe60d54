"""Fits of sums of Gaussians to a diffusion profile, alone or shared by several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from dermis.base.errors import refuse
from dermis.optics.fits.targets import Points, Rings
from dermis.optics.fits.variable_projection import STILL, Design, Fit, descend
from dermis.optics.gaussians import WIDEST_MM2, GaussianSum
from dermis.optics.media import Floats

Target = Points | Rings
MOST_TERMS = 8
# Shares of the light within the narrowest and the widest Gaussian: from one of these every profile tried so
# far reached the least error that any start leads to.
_STARTS = ((0.02, 0.99), (0.1, 0.999), (0.02, 0.9), (0.1, 0.6), (0.001, 0.99))
# Of a fit that begins near: its rings are within 0.06 % of the brightest one of where it ends in the long
# run, and its error within 0.0001.
_STILL_NEAR = 3e-6
_STIFFNESS = 1e4  # of the energy's equation against the others'; squared, it bounds the energy's error
SHARED_TERMS = 6
"""Gaussians of profiles that share them: as many as one profile alone has."""
_EDGES_MM = np.concatenate([[0.0], np.geomspace(1e-3, 60.0, 93)])
_KEPT = 8
_Table = tuple[str, bytes, bytes, int]


@dataclass(frozen=True)
class GaussianFit:
    """A sum of Gaussians and how well it fits.

    profile : the sum
    error : (c,) relative root mean square error, pointwise E or E_b over rings [-]
    energy_error : (c,) total reflectance of the sum over the target's, less 1 [-]
    kind : which error it is
    shared : whether all channels use the same Gaussians
    """

    profile: GaussianSum
    error: Floats
    energy_error: Floats
    kind: Literal["pointwise", "annulus"]
    shared: bool


def fit_gaussians(
    target: Target,
    terms: int,
    *,
    shared: bool = True,
    keep_energy: bool = False,
    near: GaussianSum | None = None,
    name: str = "fit",
) -> GaussianFit:
    """The sum of Gaussians that fits a profile best.

    target : R(r) at points, or light through rings
    terms : Gaussians in each channel, 1 to 8
    shared : the same variances in all channels, chosen for the root mean square of their errors; else
        each channel has its own, and weights of 0 for the others'
    keep_energy : make the weights sum to the target's total
    near : the fit of a similar profile to start from: several times faster, but not always the best fit
    name : of the resulting profile

    Raises DermisError when the terms are too few or many, or when Gaussians cannot follow the profile.

    Source: [dEonLuebke2007] section 14.4 for the error that is minimised.
    """
    if not 1 <= terms <= MOST_TERMS:
        refuse("terms of a fit", f"1 to {MOST_TERMS} Gaussians", f"{terms} came", "Choose another number")
    groups = [target] if shared else [target.channel(i) for i in range(len(target.total))]
    fits = [
        _fit_group(group, terms, keep_energy, _variances(near, None if shared else i, terms))
        for i, group in enumerate(groups)
    ]
    profile = _union(fits, name)
    return GaussianFit(
        profile=profile,
        error=target.error(profile.variance_mm2, profile.weight),
        energy_error=profile.albedo / target.total - 1.0,
        kind=target.kind,
        shared=shared,
    )


def _fit_group(target: Target, terms: int, keep_energy: bool, near: Floats | None) -> tuple[Floats, Floats]:
    """Variances (k,) and weights (k, c) that all channels of the target share."""
    norm = np.linalg.norm(target.samples, axis=0)
    design, samples = _conserve(target) if keep_energy else (target.design, target.samples)
    bounds = _bounds(target)

    def run(start: Floats, still: float = STILL) -> Fit:
        return descend(design, samples / norm, np.clip(start, *bounds), bounds, still)

    best = None if near is None else run(np.log(near), _STILL_NEAR)
    if best is None or not best.weight.any(axis=1).all():  # a Gaussian that died may live from elsewhere
        best = min((run(start) for start in _starts(target, terms)), key=lambda fit: fit.cost)
    weight = best.weight * norm
    if not weight.any(axis=0).all():
        came = "no weights of 0 or more come near it"
        refuse(f"{target.kind} target", "a profile that Gaussians can follow", came, "Look at its numbers")
    if keep_energy:
        weight *= target.total / weight.sum(axis=0)
    alive = weight.any(axis=1)
    return np.exp(best.log_variance[alive]), weight[alive]


def _starts(target: Target, terms: int) -> list[Floats]:
    ends = [np.log(target.radius_of(shares) ** 2 / 2.0) for shares in _STARTS]
    return [np.linspace(low, high, terms) for low, high in ends]


def _bounds(target: Target) -> tuple[float, float]:
    """Of log variances: half the first radius, to the last."""
    radius = target.radius_mm if isinstance(target, Points) else target.edges_mm[1:]
    return float(2.0 * np.log(radius[0] / 2.0)), float(np.log(min(radius[-1] ** 2, WIDEST_MM2)))


def _conserve(target: Target) -> tuple[Design, Floats]:
    """The design and samples with one more equation, a stiff one: the weights sum to the total."""
    width = target.radius_of([0.5]) ** 2 / 2.0
    stiffness = _STIFFNESS * float(np.linalg.norm(target.design(width)[0]))

    def design(variance_mm2: Floats) -> tuple[Floats, Floats]:
        columns, slopes = target.design(variance_mm2)
        row = np.ones((1, len(variance_mm2)))
        return np.vstack([stiffness * row, columns]), np.vstack([0.0 * row, slopes])

    return design, np.vstack([stiffness * target.total, target.samples])


def _variances(near: GaussianSum | None, channel: int | None, terms: int) -> Floats | None:
    """The variances to start from, when they are as many as wanted."""
    if near is None:
        return None
    used = near.weight.any(axis=1) if channel is None else near.weight[:, channel] > 0.0
    return near.variance_mm2[used] if used.sum() == terms else None


def _union(fits: list[tuple[Floats, Floats]], name: str) -> GaussianSum:
    """One sum of all the groups' Gaussians, equal variances merged."""
    variance, place = np.unique(np.concatenate([v for v, _ in fits]), return_inverse=True)
    channels = sum(w.shape[1] for _, w in fits)
    weight = np.zeros((len(variance), channels))
    row = channel = 0
    for v, w in fits:
        rows = place[row : row + len(v)]
        np.add.at(weight[:, channel : channel + w.shape[1]], rows, w)
        row, channel = row + len(v), channel + w.shape[1]
    return GaussianSum(name, variance, weight)


def single_gaussian(profile: GaussianSum) -> GaussianSum:
    """One Gaussian for all channels with each channel's total, of least squares over the plane.

    Its width follows light maps that were blurred once [Borshukov2003; Green2004].
    """
    from scipy.optimize import minimize_scalar

    def at(log_variance: float) -> GaussianSum:
        return GaussianSum(
            f"{profile.name}, one blur", np.exp([log_variance]), profile.albedo[None], profile.counted
        )

    def misfit(log_variance: float) -> float:
        one = at(log_variance)
        return float((one.inner(one) - 2 * one.inner(profile)).sum())

    ends = np.log(profile.variance_mm2[[0, -1]])
    return at(minimize_scalar(misfit, bounds=(ends[0] - 1e-6, ends[1] + 1e-6), method="bounded").x)


def shared_gaussians(profiles: Sequence[GaussianSum], terms: int = SHARED_TERMS) -> tuple[GaussianSum, ...]:
    """The profiles as sums of the same Gaussians; those that share theirs already are taken as they are.

    Each keeps its total. Relative root mean square errors over rings: `shared_errors`.
    """
    first = profiles[0].variance_mm2
    if all(np.array_equal(first, one.variance_mm2) for one in profiles):
        return tuple(profiles)
    fitted = _fitted(tuple(map(_table, profiles)), terms)
    return tuple(replace(one, counted=own.counted) for one, own in zip(fitted, profiles, strict=True))


def shared_errors(profiles: Sequence[GaussianSum], shared: Sequence[GaussianSum]) -> Floats:
    """(p, 3) E_b of each profile and channel: how far the shared sums are from what they stand for [-]."""
    pairs = zip(profiles, shared, strict=True)
    return np.array([_rings([one]).error(other.variance_mm2, other.weight) for one, other in pairs])


@lru_cache(_KEPT)
def _fitted(tables: tuple[_Table, ...], terms: int) -> tuple[GaussianSum, ...]:
    profiles = [
        GaussianSum(name, np.frombuffer(variance), np.frombuffer(weight).reshape(-1, channels))
        for name, variance, weight, channels in tables
    ]
    fit = fit_gaussians(_rings(profiles), terms, keep_energy=True, name="shared profiles").profile
    ends = np.cumsum([one.weight.shape[1] for one in profiles])[:-1]
    parts = np.split(fit.weight, ends, axis=1)
    return tuple(
        GaussianSum(one.name, fit.variance_mm2, part) for one, part in zip(profiles, parts, strict=True)
    )


def _table(profile: GaussianSum) -> _Table:
    return profile.name, profile.variance_mm2.tobytes(), profile.weight.tobytes(), profile.weight.shape[1]


def _rings(profiles: Sequence[GaussianSum]) -> Rings:
    """Light through rings, channels of all profiles side by side."""
    within = np.hstack([one.within(_EDGES_MM) for one in profiles])
    return Rings(_EDGES_MM, np.diff(within, axis=0), np.hstack([one.albedo for one in profiles]))
