"""What Cycles' subsurface methods make of a colour and a radius: their formulas, and the curves they show.

Read in the kernel's source of Blender 4.5, 5.0 and 5.2, which each release brings with it.
"""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.tables import read_rows

Floats = NDArray[np.float64]
Entry = Literal["straight", "skin"]

BURLEY_END, BURLEY_KEPT = 16.0, 0.9963790093708328
"""Where the profile is cut [d], and the share of light within, by which it is divided."""
LEAST_ALBEDO, MOST_ALBEDO = 0.2, 0.999999
"""Of single scattering in walks; below the least the walk's light is dimmed instead."""
_HALVINGS = 12
_LEAST_COLOUR, _MOST_COLOUR = 1e-4, 0.995  # between which the dipole is inverted


def burley_within(radius: ArrayLike) -> Floats:
    """Share of light within radii [d] of Burley's profile as Cycles cuts it, of their shape [-].

    Source: [ChristensenBurley2015].
    """
    r = np.minimum(np.asarray(radius, np.float64), BURLEY_END)
    return np.asarray((1.0 - 0.25 * np.exp(-r) - 0.75 * np.exp(-r / 3.0)) / BURLEY_KEPT)


def burley_stretch(colour: ArrayLike) -> Floats:
    """s(A) by which EEVEE divides the radius, of the colour over its brightest channel (3,) [-].

    Source: [ChristensenBurley2015].
    """
    A = np.asarray(colour, np.float64)
    A = A / max(float(A.max()), 1e-5)
    return np.asarray(1.9 - A + 3.5 * (A - 0.8) ** 2)


def legacy_albedo(colour: ArrayLike) -> Floats:
    """Albedo of an isotropic walk for a colour, by the polynomials of Cycles before 5.2 [-]."""
    A = np.asarray(colour, np.float64)
    blend = A**0.25
    dim = 1.8260523782 * np.arctan(5.112467903288 * A) ** 1.09686102424
    bright = 0.496310210422 * np.arctan(4.2350090365 * A) ** 2.40602999408
    return np.asarray(np.clip((1.0 - blend) * dim + blend * bright, 0.0, MOST_ALBEDO))


def albedo(colour: ArrayLike) -> Floats:
    """Albedo of an isotropic walk for a colour, by van de Hulst's formula, as Cycles has it from 5.2 [-]."""
    C = np.asarray(colour, np.float64)
    root = 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2) + 4.09712
    return np.asarray(np.clip(1.0 - root**2, 0.0, MOST_ALBEDO))


def skin_stretch(colour: ArrayLike, eta: float) -> Floats:
    """Mean free path of RANDOM_WALK_SKIN over its radius, of the colour's shape [-].

    The radius is a diffuse mean free path; the albedo is the one whose dipole returns the colour.

    eta : Subsurface IOR

    Source: [Jensen2001].
    """
    inverse = 1.0 / eta
    inside = inverse * (0.710 - 1.440 * inverse) + 0.668 + 0.0636 * eta
    A = (1.0 + inside) / (1.0 - inside)
    colours = np.asarray(colour, np.float64)
    low, high = np.zeros_like(colours), np.ones_like(colours)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        darker = _dipole_total(middle, A) < colours
        low, high = np.where(darker, middle, low), np.where(darker, high, middle)
    found = np.where(colours < _LEAST_COLOUR, 0.0, np.where(colours >= _MOST_COLOUR, MOST_ALBEDO, middle))
    return np.asarray(np.sqrt(3.0 * (1.0 - found)))


def _dipole_total(albedo: Floats, A: float) -> Floats:
    root = np.sqrt(3.0 * (1.0 - albedo))
    return np.asarray(0.5 * albedo * (1.0 + np.exp(-4.0 / 3.0 * A * root)) * np.exp(-root))


def walk_within(radius: ArrayLike, albedo: float, entry: Entry) -> Floats:
    """Share of light within radii [mean free paths] that a walk returns, of their shape [-].

    albedo : of single scattering
    entry : "straight" for RANDOM_WALK, "skin" for RANDOM_WALK_SKIN
    """
    walked = max(albedo, LEAST_ALBEDO)
    radii, within = _curve(round(walked, 7), entry)
    at = np.asarray(radius, np.float64)
    share = np.interp(np.log(np.maximum(at, 1e-12)), np.log(radii), within)
    near = np.minimum(at / radii[0], 1.0)  # as many in each step of the radius, where it is short
    return np.asarray(albedo / walked * share * near)


@cache
def _curve(albedo: float, entry: Entry) -> tuple[Floats, Floats]:
    """Radii, finely [mean free paths], and the share of light within them."""
    from scipy.interpolate import PchipInterpolator

    roots, radii, within = _table()[entry]
    share = PchipInterpolator(roots, within, axis=0)(np.clip(np.sqrt(1.0 - albedo), roots[0], roots[-1]))
    fine = np.geomspace(radii[0], radii[-1], 8 * len(radii))
    return fine, np.asarray(PchipInterpolator(np.log(radii), share)(np.log(fine)))


@cache
def _table() -> dict[Entry, tuple[Floats, Floats, Floats]]:
    """By the way to enter: roots (n,), radii (m,) [mean free paths], and shares (n, m)."""
    found: dict[str, list[list[float]]] = {}
    for row in read_rows(__package__, "cycles_walk"):
        found.setdefault(row["entry"], []).append([float(row[name]) for name in ("root", "radius", "within")])
    table = {}
    for entry, rows in found.items():
        columns = np.array(rows)
        roots, radii = np.unique(columns[:, 0]), np.unique(columns[:, 1])
        table[entry] = roots, radii, columns[:, 2].reshape(len(roots), len(radii))
    return table  # type: ignore[return-value]  # the table's own words
