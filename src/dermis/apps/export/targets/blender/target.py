"""Blender: a script that builds the skin's material, the head, its lights and camera, or a .blend of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.apps.export.fitting import fit_length
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of
from dermis.apps.export.targets.blender.files import Versions, write_scene
from dermis.apps.export.targets.blender.walks import (
    Entry,
    albedo,
    burley_stretch,
    burley_within,
    legacy_albedo,
    skin_stretch,
    walk_within,
)
from dermis.optics.curve import Curve
from dermis.optics.media import SKIN_ETA, Floats

Within = Callable[[Floats], Floats]
_RADIUS, _SCALE = "Subsurface Radius", "Subsurface Scale"
_M = 1e-3
_PI4 = 4.0 * np.pi
JENSEN_MM = 3.67, 1.37, 0.68
"""Diffuse mean free paths of skin1 in [Jensen2001], which forums pass on as "the" radii of skin [mm]."""
_FIRST = 4, 5
_MFP = 5, 2  # from which version on the radius of a random walk is a mean free path
_FAR = 1e9


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
