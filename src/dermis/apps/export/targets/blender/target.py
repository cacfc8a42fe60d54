"""What Cycles' subsurface methods make of a colour and a radius: their formulas, and the curves they show.

Read in the kernel's source of Blender 4.5, 5.0 and 5.2, which each release brings with it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.fitting import fit_length
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of
from dermis.apps.export.targets.blender.files import Versions, write_scene
from dermis.base.tables import read_rows
from dermis.optics.curve import Curve
from dermis.optics.media import SKIN_ETA

Floats = NDArray[np.float64]
Entry = Literal["straight", "skin"]

BURLEY_END, BURLEY_KEPT = 16.0, 0.9963790093708328
"""Where the profile is cut [d], and the share of light within, by which it is divided."""
LEAST_ALBEDO, MOST_ALBEDO = 0.2, 0.999999
"""Of single scattering in walks; below the least the walk's light is dimmed instead."""
_HALVINGS = 12
_LEAST_COLOUR, _MOST_COLOUR = 1e-4, 0.995  # between which the dipole is inverted
Within = Callable[[Floats], Floats]
_RADIUS, _SCALE = "Subsurface Radius", "Subsurface Scale"
_M = 1e-3
_PI4 = 4.0 * np.pi
JENSEN_MM = 3.67, 1.37, 0.68
"""Diffuse mean free paths of skin1 in [Jensen2001], which forums pass on as "the" radii of skin [mm]."""
_FIRST = 4, 5
_MFP = 5, 2  # from which version on the radius of a random walk is a mean free path
_FAR = 1e9


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


class Walk(NamedTuple):
    """A random walk of Cycles for one colour.

    albedo : of single scattering
    entry : how walks begin
    """

    albedo: float
    entry: Entry

    def within(self, radius: Floats) -> Floats:
        """Return the share of what it returns that returns within radii [mean free paths]."""
        return walk_within(radius, self.albedo, self.entry) / self.total

    @property
    def total(self) -> float:
        """Light that it returns along the normal."""
        return float(walk_within(np.array([_FAR]), self.albedo, self.entry)[0])


class Blender(Target):
    """Principled BSDF's subsurface scattering in Cycles, by each of its methods, and in EEVEE."""

    name = "blender"
    title = "Blender"
    suffixes = ("", ".py", ".blend")
    versions = ("4.5", "5.0", "5.1", "5.2")
    variants = ("random-walk-skin", "random-walk", "burley", "eevee")
    needs_maps = True
    wrong = (
        "Walks return less than the base colour to a camera before the skin, and more to one beside it;"
        " Burley's profile knows no thin parts. All scatter in one layer, which holds no layered red."
        " EEVEE was not run."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the radius whose curve is nearest to the true one, by the method's own use of it."""
        units = self._units(subject, version)
        fitted = np.array([fit_length(subject.curve, channel, unit) for channel, unit in enumerate(units)])
        radius = fitted / self._lengths(subject, version)
        return self._rows(tuple(round(float(x), 5) for x in radius), version)

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return published diffuse mean free paths of skin as the radius."""
        return self._rows(JENSEN_MM, version)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve by the formulas of Cycles' kernel and of EEVEE's shader."""
        radius = np.array(numbers_of(rows, _RADIUS)) * numbers_of(rows, _SCALE)[0] / _M
        length = np.maximum(radius * self._lengths(subject, version), 1e-9)
        units = self._units(subject, version)

        def within(r: Floats) -> Floats:
            return np.stack([unit(r / one) for unit, one in zip(units, length, strict=True)], axis=-1)

        return Curve.of(within, subject.curve.energy * self._returned(subject, version))

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write a script with the files beside it, or the .blend that it saves.

        Raises DermisError when a .blend is asked for and DERMIS_BLENDER_PYTHON names no Python with bpy.
        """
        method = self.variant.replace("-", "_").upper()
        return write_scene(subject, rows, place, method, self._valid_versions(version))

    def _valid_versions(self, version: str) -> Versions:
        """Return the versions that the numbers hold for."""
        if self.variant != "random-walk":
            return list(_FIRST), None
        return (list(_MFP), None) if _is_mfp(version) else (list(_FIRST), list(_MFP))

    def _rows(self, radius: tuple[float, ...], version: str) -> Rows:
        rows = [
            Row("Subsurface Method", self.variant.replace("-", "_").upper(), "-", "of the Principled BSDF"),
            Row("Subsurface Weight", 1.0, "-", "share of the skin that scatters"),
            Row(_RADIUS, radius, "mm, times the scale", self._meaning(version)),
            Row(_SCALE, _M, "m", "metres in a millimetre"),
            Row("IOR", SKIN_ETA, "-", "of the surface, where it reflects and where walks begin"),
        ]
        if self.variant.startswith("random"):
            rows.append(Row("Subsurface Anisotropy", 0.0, "-", "mean cosine of the deflection in a walk"))
        if self.variant == "random-walk-skin":
            rows.append(Row("Subsurface IOR", SKIN_ETA, "-", "from which the walk's mean free path follows"))
        return tuple(rows)

    def _meaning(self, version: str) -> str:
        walk = "the mean free path" if _is_mfp(version) else "4 pi mean free paths"
        return {
            "random-walk": walk,
            "random-walk-skin": "the diffuse mean free path",
            "burley": "4 pi d, whatever the colour",
            "eevee": "4 pi d s(A), A the colour over its brightest channel",
        }[self.variant]

    def _lengths(self, subject: Subject, version: str) -> Floats:
        """Return the curve's lengths (3,), d or mean free paths, at a radius of 1."""
        if self.variant == "random-walk":
            return np.full(3, 1.0 if _is_mfp(version) else 1.0 / _PI4)
        if self.variant == "random-walk-skin":
            return skin_stretch(subject.colour(), SKIN_ETA)
        return np.full(3, 1.0 / _PI4) / (burley_stretch(subject.colour()) if self.variant == "eevee" else 1.0)

    def _walks(self, subject: Subject, version: str) -> list[Walk]:
        plain = self.variant == "random-walk"
        found = (albedo if plain and _is_mfp(version) else legacy_albedo)(subject.colour())
        return [Walk(float(one), "straight" if plain else "skin") for one in found]

    def _units(self, subject: Subject, version: str) -> list[Within]:
        """Return the curve of each channel at a length of 1."""
        if self.variant in ("burley", "eevee"):
            return [burley_within] * 3
        return [walk.within for walk in self._walks(subject, version)]

    def _returned(self, subject: Subject, version: str) -> Floats:
        """Return the light (3,) that leaves along the normal over the base colour."""
        if self.variant in ("burley", "eevee"):
            return np.ones(3)
        total = np.array([walk.total for walk in self._walks(subject, version)])
        return total / np.maximum(subject.albedo, 1e-6)


def _is_mfp(version: str) -> bool:
    """Return whether the radius of a random walk is a mean free path there."""
    return tuple(map(int, version.split("."))) >= _MFP


TARGET = Blender()
