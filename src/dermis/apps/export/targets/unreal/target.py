"""Export to Unreal Engine: the maps of a head, and an editor script that creates a SubsurfaceProfile.

In SubsurfaceProfile.cpp and BurleyNormalizedSSS.cpp, the width d of the Burley profile is the mean free path
divided by 0.6 s(A). Here A is the albedo, and s is Burley's factor for light at normal incidence.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.fitting import cumulative_burley_profile, fit_burley_width, fit_homogeneous_medium
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import (
    Parameter,
    Parameters,
    ParameterValue,
    Target,
    flat_tuple,
    get_numbers,
    write_files,
)
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import UNREAL_SHAPE_RATIO, BurleyProfile, shape_factor, unreal_parameters
from dermis.optics.media import Floats

ALBEDO_NAME, MEAN_FREE_PATH_COLOUR_NAME, MEAN_FREE_PATH_DISTANCE_NAME = (
    "surface_albedo",
    "mean_free_path_color",
    "mean_free_path_distance",
)
WORLD_UNIT_SCALE_NAME, DISTANCE_SCALE_NAME = "world_unit_scale", "distance_scale"
_MIN_MEAN_FREE_PATH_COLOUR, _MAX_DISTANCE_CM, _MIN_ALBEDO = 0.001, 50.0, 1e-3
_MIN_ENGINE_COLOUR = 0.009  # lower limit that the engine applies
_MM_PER_CM = 10.0
_IMPORTED_MAP_ROLES = "colour", "normal", "roughness"
_VERSIONS_BEFORE_5_8 = ("5.3", "5.4", "5.5", "5.6", "5.7")


class Unreal(Target):
    """Export to a SubsurfaceProfile of Unreal Engine with Burley's kernel, for scenes in cm."""

    name = "unreal"
    title = "Unreal Engine"
    suffixes = ("", ".py")
    versions = (*_VERSIONS_BEFORE_5_8, "5.8")
    needs_maps = True
    import_steps = (
        "Enable the plug-in Python Editor Script.",
        "Run the script: Tools > Execute Python Script.",
        "Set the material's shading model to Subsurface Profile, and choose the profile.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {"*.py": "script that creates the profile and imports maps"}
    limitations = (
        "The base colour of the material, not the profile, colours the light. Before 5.8, thicknesses are "
        "wrong by a factor of about 100 for light through thin parts, which no parameter corrects; in 5.8 "
        "they are correct if r.SSProfiles.Transmission.UseLegacy is 0."
    )
    untested = True

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the mean free paths for which the engine's Burley profile is closest to the reference."""
        albedo = subject.clipped_albedo(_MIN_ALBEDO)
        profile = unreal_parameters(BurleyProfile(albedo, 1.0 / fit_burley_width(subject.curve)))
        path_cm = np.array(profile.mean_free_path_colour) * profile.mean_free_path_distance_cm
        return _profile_parameters(albedo, path_cm, version)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of a user who enters the tissue's reduced mean free path.

        The reduced mean free path differs from the fitted value, because the engine converts its field "mean
        free path" to the width of a Burley profile.
        """
        path = fit_homogeneous_medium(subject.curve, subject.curve.energy).mfp_mm
        if subject.tissue is not None and subject.tissue.rgb is None:
            path = subject.tissue.medium.layers[-1].mean_free_path_mm
        return _profile_parameters(subject.clipped_albedo(_MIN_ALBEDO), path / _MM_PER_CM, version)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative Burley profile that the engine's screen-space pass renders."""
        colour = np.maximum(get_numbers(parameters, MEAN_FREE_PATH_COLOUR_NAME), _MIN_ENGINE_COLOUR)
        path = (
            _MM_PER_CM
            * colour
            * get_numbers(parameters, MEAN_FREE_PATH_DISTANCE_NAME)[0]
            * get_numbers(parameters, WORLD_UNIT_SCALE_NAME)[0]
        )
        albedo = np.array(get_numbers(parameters, ALBEDO_NAME))
        return cumulative_burley_profile(
            path / (UNREAL_SHAPE_RATIO * shape_factor(albedo)), subject.curve.energy
        )

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the editor script, and the maps of a head beside it."""
        file, maps = self.main_file(output, subject), subject.encode_maps()
        names = {role: f"{file.stem}_{role}.png" for role in maps}
        imported = {role: name for role, name in names.items() if role in _IMPORTED_MAP_ROLES}
        file.write_text(_editor_script(subject, parameters, imported, version), encoding="utf-8")
        return [file, *write_files(file.parent, zip(names.values(), maps.values(), strict=True))]


def _profile_parameters(albedo: Floats, mean_free_path_cm: Floats, version: str) -> Parameters:
    distance = float(np.clip(mean_free_path_cm.max(), 0.1, _MAX_DISTANCE_CM))
    colour = np.clip(mean_free_path_cm / distance, _MIN_MEAN_FREE_PATH_COLOUR, 1.0)
    depth = Parameter(
        DISTANCE_SCALE_NAME, 0.1, "-", "for thin parts; its product with the unit scale must be 0.1"
    )
    return (
        Parameter("enable_burley", True, "-", "Burley's profile instead of six Gaussians"),
        Parameter("enable_mean_free_path", True, "-", "else the editor converts these values on loading"),
        Parameter(ALBEDO_NAME, flat_tuple(albedo), "-", "A of s(A); does not affect the colour"),
        Parameter(
            MEAN_FREE_PATH_COLOUR_NAME,
            flat_tuple(colour),
            "-",
            "mean free path 0.6 s(A) d relative to the distance, linear",
        ),
        Parameter(MEAN_FREE_PATH_DISTANCE_NAME, distance, "cm", "mean free path at a colour of 1"),
        Parameter(WORLD_UNIT_SCALE_NAME, 1.0, "-", "1 for a scene in centimetres"),
        *(() if version in _VERSIONS_BEFORE_5_8 else (depth,)),
        Parameter("ior", 1.4, "-", "of the specular reflection"),
    )


def _editor_script(
    subject: Subject, parameters: Parameters, map_files: Mapping[str, str], version: str
) -> str:
    """Return a Python script for the editor that creates the profile and imports the maps beside the script.

    map_files : dictionary from the role of each map to its file name
    """
    settings = [
        f"    {json.dumps(one.name)}: {_python_literal(one.value)},  # {one.unit}\n" for one in parameters
    ]
    files = [f"    {json.dumps(role)}: {json.dumps(name)},\n" for role, name in map_files.items()]
    text = Path(__file__).with_name("editor_script.txt").read_text("utf-8")
    fields = {"NAME": json.dumps(subject.identifier), "VERSION": version}
    fields |= {"SETTINGS": "".join(settings), "MAPS": "".join(files)}
    for field, value in fields.items():
        text = text.replace(f"@{field}@", value)
    return text


def _python_literal(parameter_value: ParameterValue) -> str:
    if isinstance(parameter_value, tuple):
        return f"unreal.LinearColor({', '.join(f'{x:.6g}' for x in parameter_value)}, 1.0)"
    return f"{parameter_value:.6g}" if isinstance(parameter_value, float) else repr(parameter_value)


TARGET = Unreal()
