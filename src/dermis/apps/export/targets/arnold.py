"""Arnold's standard_surface, by its published meanings: a table of values, as nobody here has run it.

The radius is the mean free path for each channel in units of the scene, times the scale; the colour is
turned into the albedo of a scattering, as in OpenPBR. Its walk is taken to be in an index-matched medium.
"""

from __future__ import annotations

import numpy as np

from dermis.apps.export.fitting import fit_d, homogeneous
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import ParameterTable, Row, Rows, floats, numbers_of
from dermis.optics.curve import Curve
from dermis.optics.half_space import albedo_of, half_space
from dermis.optics.media import Floats

_COLOUR, _RADIUS, _SCALE = "subsurface_color", "subsurface_radius", "subsurface_scale"
_MM_PER_CM, _DARKEST = 10.0, 1e-3


class Arnold(ParameterTable):
    """The random walk of standard_surface, for a scene in centimetres."""

    name = "arnold"
    title = "Arnold"
    versions = ("7",)
    wrong = (
        "How colour becomes the albedo of a scattering inside the renderer is not published: this is by a "
        "walk counted here. One medium cannot hold layers."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Mean free paths of the homogeneous medium that shows the colour and is nearest to the profile."""
        colour = subject.colour(_DARKEST)
        return _rows(colour, homogeneous(subject.curve, colour, "walk").mfp_mm)

    def naive(self, subject: Subject, version: str) -> Rows:
        """The width of a fitted lobe as the radius."""
        return _rows(subject.colour(_DARKEST), fit_d(subject.curve))

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The walk of the colour's albedo; a white curve is shown with the head's colours by its map."""
        path = _MM_PER_CM * np.array(numbers_of(rows, _RADIUS)) * numbers_of(rows, _SCALE)
        colour = np.array(numbers_of(rows, _COLOUR))
        walk = half_space("walk", albedo_of("walk", colour), path)
        return walk.with_energy(walk.energy / subject.colour(_DARKEST) * subject.curve.energy)


def _rows(colour: Floats, path_mm: Floats) -> Rows:
    return (
        Row("subsurface", 1.0, "-", "all of the diffuse light is scattered below the surface"),
        Row("subsurface_type", "randomwalk", "-", "not diffusion, which has another curve"),
        Row(_COLOUR, floats(colour), "-", "diffuse reflectance"),
        Row(_RADIUS, floats(path_mm / _MM_PER_CM), "cm", "mean free path"),
        Row(_SCALE, 1.0, "-", "units of the scene in a cm: 0.01 where it is in metres"),
        Row("subsurface_anisotropy", 0.0, "-", "scattering alike to all directions"),
    )


TARGET = Arnold()
