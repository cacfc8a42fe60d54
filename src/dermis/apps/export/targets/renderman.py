"""RenderMan's PxrSurface, by its published meanings: a table of values, as nobody here has run it.

Subsurface DMFP is the diffuse mean free path in mm times the unit length; by [ChristensenBurley2015], which
is by the same people, its lobe has d = dmfp / s(A) with s for diffuse mean free paths.
"""

from __future__ import annotations

import numpy as np

from dermis.apps.export.fitting import fit_d, lobe
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import ParameterTable, Row, Rows, floats, numbers_of
from dermis.optics.curve import Curve
from dermis.optics.fits.burley import shape_factor_diffuse
from dermis.optics.media import Floats

_COLOUR, _UNIT = "subsurfaceColor", "unitLength"
_PATH, _COLOUR_OF_PATH = "subsurfaceDmfp", "subsurfaceDmfpColor"
_DARKEST = 1e-3


class RenderMan(ParameterTable):
    """Burley's model of PxrSurface (subsurfaceType 4), for a scene in millimetres."""

    name = "renderman"
    title = "RenderMan"
    versions = ("26",)
    wrong = (
        "The curve of the model is not published in closed form: this is that of its authors' paper. Its "
        "path traced and multiple models have others."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Diffuse mean free paths of the fitted lobes."""
        albedo = subject.colour(_DARKEST)
        return _rows(albedo, fit_d(subject.curve) * shape_factor_diffuse(albedo))

    def naive(self, subject: Subject, version: str) -> Rows:
        """The width of the lobe as if it were the diffuse mean free path."""
        return _rows(subject.colour(_DARKEST), fit_d(subject.curve))

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The lobe of the paper."""
        path = np.array(numbers_of(rows, _PATH)) * numbers_of(rows, _COLOUR_OF_PATH) * numbers_of(rows, _UNIT)
        return lobe(path / shape_factor_diffuse(numbers_of(rows, _COLOUR)), subject.curve.energy)


def _rows(albedo: Floats, path_mm: Floats) -> Rows:
    longest = float(path_mm.max())
    return (
        Row("subsurfaceGain", 1.0, "-", "all of the diffuse light is scattered below the surface"),
        Row(_COLOUR, floats(albedo), "-", "diffuse reflectance A"),
        Row(_PATH, longest, "mm", "diffuse mean free path, s(A) d, of the widest channel"),
        Row(_COLOUR_OF_PATH, floats(path_mm / longest), "-", "it by the widest, no gamma"),
        Row(_UNIT, 1.0, "-", "units of the scene in a mm: 0.1 where it is in cm"),
    )


TARGET = RenderMan()
