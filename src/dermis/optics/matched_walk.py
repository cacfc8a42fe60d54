"""The random walk of renderers whose medium has the index of the air: its curve, and its albedo from a colour.

Each scatters alike in all directions. Where scattering is not isotropic, nothing here holds.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.tables import numbers, read_rows


def albedo_of_colour(colour: ArrayLike) -> Floats:
    """Albedo of single scattering of the walk that returns a colour, of any shape [-].

    Source: van de Hulst's formula inverted, [dEon2022] eq. 53.7.
    """
    return 1.0 - _root_of_colour(np.asarray(colour, np.float64)) ** 2


def colour_of_albedo(albedo: ArrayLike) -> Floats:
    """Share of diffuse light that a half-space returns by van de Hulst's formula, of any shape [-]."""
    root = np.sqrt(1.0 - np.asarray(albedo, np.float64))
    return np.asarray((1.0 - root) * (1.0 - 0.139 * root) / (1.0 + 1.17 * root))


def walk_within(radius: ArrayLike, colour: float) -> Floats:
    """Share of diffuse light that a walk returns within radii [mean free paths], of their shape [-].

    colour : from which a renderer finds the albedo, 0 to 1 [-]
    """
    radii, within = _curve(round(float(colour), 6))
    at = np.log(np.maximum(np.asarray(radius, np.float64), 1e-9))
    return np.asarray(np.interp(at, radii, within) * np.minimum(1.0, np.exp(at - radii[0])))


def walk_radii() -> Floats:
    """Radii of the table [mean free paths]."""
    return np.asarray(_table()[1])


@cache
def _curve(colour: float) -> tuple[Floats, Floats]:
    """Logarithms of radii, finely, and the share within them."""
    from scipy.interpolate import PchipInterpolator

    roots, radii, within = _table()
    root = float(_root_of_colour(np.asarray(colour)))
    known = np.concatenate([within, np.zeros_like(within[:1])])  # with no scattering nothing returns
    share = np.asarray(PchipInterpolator([*roots, 1.0], known, axis=0)(max(root, roots[0])))
    fine = np.linspace(np.log(radii[0]), np.log(radii[-1]), 8 * len(radii))
    return fine, np.asarray(PchipInterpolator(np.log(radii), share)(fine))


def _root_of_colour(colour: Floats) -> Floats:
    """sqrt(1 - albedo) [-]."""
    C = np.clip(colour, 0.0, 1.0)
    root = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    return np.asarray(np.clip(root, 0.0, 1.0))


@cache
def _table() -> tuple[Floats, Floats, Floats]:
    """Roots (n,), radii (m,) [mean free paths], and shares (n, m)."""
    rows = numbers(read_rows("dermis.optics.data", "matched_walk"), "root radius within")
    roots, radii = np.unique(rows[:, 0]), np.unique(rows[:, 1])
    return roots, radii, rows[:, 2].reshape(len(roots), len(radii))
