"""Unreal Engine: a Python script for the editor that makes a SubsurfaceProfile, and the maps of a head.

By public copies of its source (SubsurfaceProfile.cpp, BurleyNormalizedSSS.cpp) the lobe's d is the mean free
path over 0.6 s(A), where s is Burley's for perpendicular light: the scaling of searchlight profiles cancels.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import fit_burley_width, fit_homogeneous_medium, burley_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, Value, floats, get_numbers, write_files
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import UNREAL_FACTOR, BurleyProfile, shape_factor, unreal_parameters
from dermis.optics.media import Floats

ALBEDO, COLOUR, DISTANCE = "surface_albedo", "mean_free_path_color", "mean_free_path_distance"
SCALE, DEPTH_SCALE = "world_unit_scale", "distance_scale"
_LEAST_COLOUR, _MOST_CM, _LEAST_ALBEDO = 0.001, 50.0, 1e-3
_UPLOADED_COLOUR = 0.009  # what the engine raises less to
_MM_PER_CM = 10.0
_IMPORTED = "colour", "normal", "roughness"
_BEFORE_58 = ("5.3", "5.4", "5.5", "5.6", "5.7")


class Unreal(Target):
    """A subsurface profile with Burley's kernel, for scenes in centimetres."""

    name = "unreal"
    title = "Unreal Engine"
    suffixes = ("", ".py")
    versions = (*_BEFORE_58, "5.8")
    needs_maps = True
    limitations = (
        "The base colour of the material colours the light, not the profile. Before 5.8 depths of thin parts "
        "are off by about 100 for light that comes through, and no field mends it; in 5.8 they are right "
        "while r.SSProfiles.Transmission.UseLegacy is 0."
    )
    untested = True

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Mean free paths that the engine turns into the fitted lobes."""
        albedo = subject.clipped_albedo(_LEAST_ALBEDO)
        told = unreal_parameters(BurleyProfile(albedo, 1.0 / fit_burley_width(subject.curve)))
        return _parameters(albedo, np.array(told.mean_free_path_colour) * told.mean_free_path_distance_cm, version)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """The tissue's own mean free path, reduced, as the name of the field invites."""
        path = fit_homogeneous_medium(subject.curve, subject.curve.energy).mfp_mm
        if subject.tissue is not None and subject.tissue.rgb is None:
            path = subject.tissue.medium.layers[-1].mean_free_path_mm
        return _parameters(subject.clipped_albedo(_LEAST_ALBEDO), path / _MM_PER_CM, version)

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """The lobe that the engine computes from its parameters, at the scale of its screen pass."""
        colour = np.maximum(get_numbers(parameters, COLOUR), _UPLOADED_COLOUR)
        path = _MM_PER_CM * colour * get_numbers(parameters, DISTANCE)[0] * get_numbers(parameters, SCALE)[0]
        albedo = np.array(get_numbers(parameters, ALBEDO))
        return burley_curve(path / (UNREAL_FACTOR * shape_factor(albedo)), subject.curve.energy)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """The script, and beside it the maps."""
        file, maps = self.main_file(output,  subject), subject.encode_maps()
        names = {role: f"{file.stem}_{role}.png" for role in maps}
        imported = {role: name for role, name in names.items() if role in _IMPORTED}
        file.write_text(_script(subject, parameters, imported, version), encoding="utf-8")
        return [file, *write_files(file.parent, zip(names.values(), maps.values(), strict=True))]


def _parameters(albedo: Floats, path_cm: Floats, version: str) -> Parameters:
    distance = float(np.clip(path_cm.max(), 0.1, _MOST_CM))
    colour = np.clip(path_cm / distance, _LEAST_COLOUR, 1.0)
    depth = Parameter(DEPTH_SCALE, 0.1, "-", "times the scale it has to be 0.1: depths of light through thin parts")
    return (
        Parameter("enable_burley", True, "-", "two exponentials; without it the old six Gaussians"),
        Parameter("enable_mean_free_path", True, "-", "without it the editor rewrites these numbers on loading"),
        Parameter(ALBEDO, floats(albedo), "-", "A of s(A); it colours nothing"),
        Parameter(COLOUR, floats(colour), "-", "mean free path by the distance, 0.6 s(A) d, no gamma"),
        Parameter(DISTANCE, distance, "cm", "mean free path where the colour is 1"),
        Parameter(SCALE, 1.0, "-", "1: a unit of the scene is a centimetre"),
        *(() if version in _BEFORE_58 else (depth,)),
        Parameter("ior", 1.4, "-", "of the surface reflection"),
    )


def _script(subject: Subject, parameters: Parameters, maps: Mapping[str, str], version: str) -> str:
    """Return a Python script that makes the profile and imports maps that lie beside it.

    maps : names of files by role
    """
    settings = "".join(f"    {json.dumps(row.name)}: {_value(row.value)},  # {row.unit}\n" for row in parameters)
    files = "".join(f"    {json.dumps(role)}: {json.dumps(name)},\n" for role, name in maps.items())
    text = Path(__file__).with_name("editor_script.txt").read_text("utf-8")
    known = {"NAME": json.dumps(subject.identifier), "SETTINGS": settings, "MAPS": files, "VERSION": version}
    for key, words in known.items():
        text = text.replace(f"@{key}@", words)
    return text


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return f"unreal.LinearColor({', '.join(f'{x:.6g}' for x in value)}, 1.0)"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


TARGET = Unreal()
