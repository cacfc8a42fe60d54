"""Export to Arnold's standard_surface as a JSON file of parameters, following the published documentation.

The mean free path of a channel is the parameter subsurface_radius times subsurface_scale, in scene units. The
parameter subsurface_color is converted to a single-scattering albedo with a table of random walks in an
index-matched medium.
"""

from __future__ import annotations

import numpy as np

from dermis.apps.export.fitting import fit_burley_width, fit_homogeneous_medium
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import JsonTarget, Parameter, Parameters, flat_tuple, get_numbers
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import half_space, tabulated_albedo
from dermis.optics.media import Floats

_COLOUR_NAME, _RADIUS_NAME, _SCALE_NAME = "subsurface_color", "subsurface_radius", "subsurface_scale"
_MM_PER_CM, _MIN_ALBEDO = 10.0, 1e-3


class Arnold(JsonTarget):
    """Export of parameters of standard_surface with random-walk subsurface scattering, for scenes in cm."""

    name = "arnold"
    title = "Arnold"
    versions = ("7",)
    import_steps = (
        "Create a `standard_surface` material in a scene in centimetres.",
        "Set each parameter to the value in the .json file.",
        "Apply the maps of an export to `maps` to its colour, roughness and normal.",
    )
    limitations = (
        "How the renderer converts a colour to a scattering albedo is not published; tabulated random walks "
        "of this package are used instead. A single medium cannot represent layers."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters for the homogeneous medium whose profile is closest to the reference profile."""
        colour = subject.clipped_albedo(_MIN_ALBEDO)
        return _material_parameters(colour, fit_homogeneous_medium(subject.curve, colour, "walk").mfp_mm)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters with Burley widths as subsurface_radius, instead of mean free paths."""
        return _material_parameters(subject.clipped_albedo(_MIN_ALBEDO), fit_burley_width(subject.curve))

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the profile of a random walk whose albedo is derived from subsurface_color."""
        path = (
            _MM_PER_CM
            * np.array(get_numbers(parameters, _RADIUS_NAME))
            * get_numbers(parameters, _SCALE_NAME)
        )
        colour = np.array(get_numbers(parameters, _COLOUR_NAME))
        curve = half_space("walk", tabulated_albedo("walk", colour), path)
        return curve.with_energy(curve.energy / subject.clipped_albedo(_MIN_ALBEDO) * subject.curve.energy)


def _material_parameters(base_colour: Floats, mean_free_path_mm: Floats) -> Parameters:
    return (
        Parameter("subsurface", 1.0, "-", "all diffuse light is scattered below the surface"),
        Parameter("subsurface_type", "randomwalk", "-", "not diffusion, whose profile differs"),
        Parameter(_COLOUR_NAME, flat_tuple(base_colour), "-", "diffuse reflectance"),
        Parameter(_RADIUS_NAME, flat_tuple(mean_free_path_mm / _MM_PER_CM), "cm", "mean free path"),
        Parameter(_SCALE_NAME, 1.0, "-", "scene units per cm: 0.01 for a scene in metres"),
        Parameter("subsurface_anisotropy", 0.0, "-", "isotropic scattering"),
    )


TARGET = Arnold()
