"""Several profiles on one set of Gaussians, so that a place may mix them at no further cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.fits.targets import Rings
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

SHARED_TERMS = 6
"""Gaussians of profiles that share them: as many as one profile alone has."""
_EDGES_MM = np.concatenate([[0.0], np.geomspace(1e-3, 60.0, 93)])
_KEPT = 8
_Table = tuple[str, bytes, bytes, int]


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
