"""Export to RenderMan: parameters of PxrSurface, based on published documentation and not tested.

The diffuse mean free path is subsurfaceDmfp times subsurfaceDmfpColor times unitLength, in mm. The width d of
the Burley profile is the diffuse mean free path divided by s(A). Here A is the albedo, and s is Burley's
factor for diffuse mean free paths.

Source: [ChristensenBurley2015].
"""

from __future__ import annotations

import numpy as np

from dermis.apps.export.fitting import cumulative_burley_profile, fit_burley_width
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import JsonTarget, Parameter, Parameters, flat_tuple, get_numbers
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import shape_factor_diffuse
from dermis.optics.media import Floats

_COLOUR_NAME, _UNIT_LENGTH_NAME = "subsurfaceColor", "unitLength"
_DMFP_NAME, _DMFP_COLOUR_NAME = "subsurfaceDmfp", "subsurfaceDmfpColor"
_MIN_ALBEDO = 1e-3


class RenderMan(JsonTarget):
    """Export of the parameters of PxrSurface with Burley's profile (subsurfaceType 4), for scenes in mm."""

    name = "renderman"
    title = "RenderMan"
    versions = ("26",)
    import_steps = (
        "Create a `PxrSurface` material in a scene in millimetres.",
        "Set each parameter to the value in the .json file.",
        "Apply the maps of an export to `maps` to its colour, roughness and normal.",
    )
    limitations = (
        "The model has no published closed form; the profile of its authors' paper is used. The path-traced "
        "and multiple models differ."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the diffuse mean free paths for which Burley's profile is closest to the reference."""
        albedo = subject.clipped_albedo(_MIN_ALBEDO)
        return _material_parameters(albedo, fit_burley_width(subject.curve) * shape_factor_diffuse(albedo))

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters with the widths d of the closest Burley profiles as diffuse mean free paths."""
        return _material_parameters(subject.clipped_albedo(_MIN_ALBEDO), fit_burley_width(subject.curve))

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative Burley profile whose width follows from the diffuse mean free paths."""
        path, path_colour, unit, colour = (
            np.array(get_numbers(parameters, name))
            for name in (_DMFP_NAME, _DMFP_COLOUR_NAME, _UNIT_LENGTH_NAME, _COLOUR_NAME)
        )
        return cumulative_burley_profile(
            path * path_colour * unit / shape_factor_diffuse(colour), subject.curve.energy
        )


def _material_parameters(albedo: Floats, diffuse_mean_free_path_mm: Floats) -> Parameters:
    longest = float(diffuse_mean_free_path_mm.max())
    return (
        Parameter("subsurfaceGain", 1.0, "-", "all diffuse light is scattered below the surface"),
        Parameter(_COLOUR_NAME, flat_tuple(albedo), "-", "diffuse reflectance A"),
        Parameter(_DMFP_NAME, longest, "mm", "largest diffuse mean free path, s(A) d, of the channels"),
        Parameter(
            _DMFP_COLOUR_NAME,
            flat_tuple(diffuse_mean_free_path_mm / longest),
            "-",
            "each channel's relative to that, no gamma",
        ),
        Parameter(_UNIT_LENGTH_NAME, 1.0, "-", "scene units per mm: 0.1 for a scene in cm"),
    )


TARGET = RenderMan()
