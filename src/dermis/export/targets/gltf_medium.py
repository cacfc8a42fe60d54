"""What glTF's volume means for light: a random walk under a refracting surface, by the draft's own inversion."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.export.curve import Curve
from dermis.tables import numbers, read_rows

Floats = NDArray[np.float64]

_LEAST, _MOST, _NODES = 1e-2, 60.0, 400  # radii that a fit is judged at, by the true median
_DARKEST = 1e-4  # a colour from which some light still comes back
_RANGE = 8.0  # of mean free paths that are tried, by the first guess: times and through it


class Volume(NamedTuple):
    """The numbers of KHR_materials_volume and KHR_materials_scatter that say how light spreads.

    distance_m, colour : attenuationDistance [m] and attenuationColor (3,)
    multiscatter : multiscatterColorFactor (3,) [-]
    """

    distance_m: float
    colour: Floats
    multiscatter: Floats

    @property
    def mean_free_path_mm(self) -> Floats:
        """(3,) between two events [mm]."""
        clear = -np.log(np.clip(self.colour, 1e-300, 1.0 - 1e-12))
        return np.asarray(1e3 * self.distance_m / clear)


def volume_of(mean_free_path_mm: ArrayLike, multiscatter: ArrayLike) -> Volume:
    """The numbers for mean free paths (3,): the longest is the distance, so that no colour underflows."""
    path = np.asarray(mean_free_path_mm, np.float64)
    longest = float(path.max())
    return Volume(1e-3 * longest, np.exp(-longest / path), np.asarray(multiscatter, np.float64))


def single_scattering(multiscatter: ArrayLike, anisotropy: float = 0.0) -> Floats:
    """Albedo of single scattering by the draft's inversion of a colour [-].

    Source: [dEon2016] equation 53.7, van de Hulst's, as KHR_materials_scatter prints it.
    """
    C = np.asarray(multiscatter, np.float64)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    return np.asarray((1.0 - s**2) / (1.0 - anisotropy * s**2))


def multiscatter_of(albedo: ArrayLike) -> Floats:
    """The colour whose inversion is an albedo of isotropic single scattering [-]."""
    s = np.sqrt(np.clip(1.0 - np.asarray(albedo, np.float64), 0.0, 1.0))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))


def shown_energy(multiscatter: ArrayLike) -> Floats:
    """Share of the light that enters and comes back, by the colour (...,) [-]."""
    walk = _walk()
    root = np.sqrt(1.0 - single_scattering(multiscatter))
    return np.asarray(np.interp(root, walk.root, walk.energy))


def colour_for(energy: ArrayLike) -> Floats:
    """The colour with which a share (...,) of the light that enters comes back [-]."""
    walk = _walk()
    root = np.interp(np.maximum(energy, _DARKEST), walk.energy[::-1], walk.root[::-1])
    return multiscatter_of(1.0 - root**2)


def walked(volume: Volume) -> Curve:
    """The curve of light that walks through such a volume."""
    path, root = volume.mean_free_path_mm, np.sqrt(1.0 - single_scattering(volume.multiscatter))

    def within(radius_mm: Floats) -> Floats:
        return np.stack([_share(float(root[c]), radius_mm / path[c]) for c in range(3)], axis=-1)

    return Curve.of(within, shown_energy(volume.multiscatter))


def fitted(curve: Curve) -> Volume:
    """The volume whose walk gives back a curve's energy, and is nearest to it cumulatively."""
    colour = colour_for(curve.energy)
    root = np.sqrt(1.0 - single_scattering(colour))
    return volume_of([_path(curve, c, float(root[c])) for c in range(3)], colour)


def _path(curve: Curve, channel: int, root: float) -> float:
    """The mean free path of a channel, by least squares over log r [mm]."""
    from scipy.optimize import minimize_scalar

    median = float(curve.radius_of(0.5)[channel])
    r = median * np.geomspace(_LEAST, _MOST, _NODES)
    true = curve.within(r)[:, channel]
    walk = _walk()
    half = float(np.interp(0.5, _share(root, walk.radius), walk.radius))

    def error(log_path: float) -> float:
        return float(((_share(root, r * np.exp(-log_path)) - true) ** 2).sum())

    guess, wide = np.log(median / half), np.log(_RANGE)
    return float(np.exp(minimize_scalar(error, bounds=(guess - wide, guess + wide), method="bounded").x))


class _Walk(NamedTuple):
    """root (n,), radius (m,) [mean free paths], energy (n,), within (n, m) of what leaves."""

    root: Floats
    radius: Floats
    energy: Floats
    within: Floats


@cache
def _walk() -> _Walk:
    """The table, with light that is never scattered back at its end."""
    rows = numbers(read_rows("dermis.export.data", "refracted_walk"), "root radius within")
    root, radius = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    within = rows[:, 2].reshape(len(root), len(radius))
    share = within / within[:, -1:]
    ends = np.concatenate([[0.0], root, [1.0]]), np.concatenate([[1.0], within[:, -1], [0.0]])
    return _Walk(ends[0], radius, ends[1], np.concatenate([share[:1], share, share[-1:]]))


def _share(root: float, radius: Floats) -> Floats:
    """Share of what leaves that does so within radii (k,) [mean free paths]."""
    walk = _walk()
    at = float(np.interp(root, walk.root, np.arange(len(walk.root))))
    low = min(int(at), len(walk.root) - 2)
    row = walk.within[low] + (at - low) * (walk.within[low + 1] - walk.within[low])
    inside = np.interp(np.log(np.maximum(radius, walk.radius[1])), np.log(walk.radius[1:]), row[1:])
    return np.asarray(inside * np.minimum(radius / walk.radius[1], 1.0))
