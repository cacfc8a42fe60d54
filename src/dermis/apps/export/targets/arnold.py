"""Arnold's standard_surface, by its published meanings: a table of values, as nobody here has run it.

The radius is the mean free path for each channel in units of the scene, times the scale; the colour is
turned into the albedo of a scattering, as in OpenPBR. Its walk is taken to be in an index-matched medium.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.fitting import fit_d, homogeneous
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of, write_values
from dermis.optics.curve import Curve
from dermis.optics.half_space import albedo_of, half_space
from dermis.optics.media import Floats

_COLOUR, _RADIUS, _SCALE = "subsurface_color", "subsurface_radius", "subsurface_scale"
_MM_PER_CM, _DARKEST, _BRIGHTEST = 10.0, 1e-3, 1.0


class Arnold(Target):
    """The random walk of standard_surface, for a scene in centimetres."""

    name: ClassVar[str] = "arnold"
    title: ClassVar[str] = "Arnold"
    suffixes: ClassVar[tuple[str, ...]] = (".json", "")
    versions: ClassVar[tuple[str, ...]] = ("7",)
    wrong: ClassVar[str] = (
        "How colour becomes the albedo of a scattering inside the renderer is not published: this is by a "
        "walk counted here. One medium cannot hold layers."
    )
    not_run: ClassVar[bool] = True

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Mean free paths of the homogeneous medium that shows the colour and is nearest to the profile."""
        colour = _colour(subject)
        return _rows(colour, homogeneous(subject.curve, colour, "walk").mfp_mm)

    def naive(self, subject: Subject, version: str) -> Rows:
        """The width of a fitted lobe as the radius."""
        return _rows(_colour(subject), fit_d(subject.curve))

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The walk of the colour's albedo; a white curve is shown with the head's colours by its map."""
        path = _MM_PER_CM * np.array(numbers_of(rows, _RADIUS)) * numbers_of(rows, _SCALE)
        colour = np.array(numbers_of(rows, _COLOUR))
        walk = half_space("walk", albedo_of("walk", colour), path)
        return walk.with_energy(walk.energy / _colour(subject) * subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The values as JSON."""
        return [write_values(self, subject, rows, place, version)]


def _colour(subject: Subject) -> Floats:
    return np.clip(subject.albedo, _DARKEST, _BRIGHTEST)


def _rows(colour: Floats, path_mm: Floats) -> Rows:
    return (
        Row("subsurface", 1.0, "-", "all of the diffuse light is scattered below the surface"),
        Row("subsurface_type", "randomwalk", "-", "not diffusion, which has another curve"),
        Row(_COLOUR, tuple(colour.tolist()), "-", "diffuse reflectance"),
        Row(_RADIUS, tuple((path_mm / _MM_PER_CM).tolist()), "cm", "mean free path"),
        Row(_SCALE, 1.0, "-", "units of the scene in a cm: 0.01 where it is in metres"),
        Row("subsurface_anisotropy", 0.0, "-", "scattering alike to all directions"),
    )


TARGET = Arnold()
