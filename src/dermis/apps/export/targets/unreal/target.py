"""Unreal Engine: a Python script for the editor that makes a SubsurfaceProfile, and the maps of a head.

By public copies of its source (SubsurfaceProfile.cpp, BurleyNormalizedSSS.cpp) the lobe's d is the mean free
path over 0.6 s(A), where s is Burley's for perpendicular light: the scaling of searchlight profiles cancels.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import fit_d, homogeneous, lobe
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, Value, floats, numbers_of, write_files
from dermis.optics.curve import Curve
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
    wrong = (
        "The base colour of the material colours the light, not the profile. Before 5.8 depths of thin parts "
        "are off by about 100 for light that comes through, and no field mends it; in 5.8 they are right "
        "while r.SSProfiles.Transmission.UseLegacy is 0."
    )
    not_run = True

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Mean free paths that the engine turns into the fitted lobes."""
        albedo = subject.colour(_LEAST_ALBEDO)
        told = unreal_parameters(BurleyProfile(albedo, 1.0 / fit_d(subject.curve)))
        return _rows(albedo, np.array(told.mean_free_path_colour) * told.mean_free_path_distance_cm, version)

    def naive(self, subject: Subject, version: str) -> Rows:
        """The tissue's own mean free path, reduced, as the name of the field invites."""
        path = homogeneous(subject.curve, subject.curve.energy).mfp_mm
        if subject.tissue is not None and subject.tissue.rgb is None:
            path = subject.tissue.medium.layers[-1].mean_free_path_mm
        return _rows(subject.colour(_LEAST_ALBEDO), path / _MM_PER_CM, version)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The lobe that the engine computes from its parameters, at the scale of its screen pass."""
        colour = np.maximum(numbers_of(rows, COLOUR), _UPLOADED_COLOUR)
        path = _MM_PER_CM * colour * numbers_of(rows, DISTANCE)[0] * numbers_of(rows, SCALE)[0]
        albedo = np.array(numbers_of(rows, ALBEDO))
        return lobe(path / (UNREAL_FACTOR * shape_factor(albedo)), subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The script, and beside it the maps."""
        file, maps = self.file_in(place, subject), subject.map_pictures()
        names = {role: f"{file.stem}_{role}.png" for role in maps}
        imported = {role: name for role, name in names.items() if role in _IMPORTED}
        file.write_text(_script(subject, rows, imported, version), encoding="utf-8")
        return [file, *write_files(file.parent, zip(names.values(), maps.values(), strict=True))]


def _rows(albedo: Floats, path_cm: Floats, version: str) -> Rows:
    distance = float(np.clip(path_cm.max(), 0.1, _MOST_CM))
    colour = np.clip(path_cm / distance, _LEAST_COLOUR, 1.0)
    depth = Row(DEPTH_SCALE, 0.1, "-", "times the scale it has to be 0.1: depths of light through thin parts")
    return (
        Row("enable_burley", True, "-", "two exponentials; without it the old six Gaussians"),
        Row("enable_mean_free_path", True, "-", "without it the editor rewrites these numbers on loading"),
        Row(ALBEDO, floats(albedo), "-", "A of s(A); it colours nothing"),
        Row(COLOUR, floats(colour), "-", "mean free path by the distance, 0.6 s(A) d, no gamma"),
        Row(DISTANCE, distance, "cm", "mean free path where the colour is 1"),
        Row(SCALE, 1.0, "-", "1: a unit of the scene is a centimetre"),
        *(() if version in _BEFORE_58 else (depth,)),
        Row("ior", 1.4, "-", "of the surface reflection"),
    )


def _script(subject: Subject, rows: Rows, maps: Mapping[str, str], version: str) -> str:
    """Return a Python script that makes the profile and imports maps that lie beside it.

    maps : names of files by role
    """
    settings = "".join(f"    {json.dumps(row.name)}: {_value(row.value)},  # {row.unit}\n" for row in rows)
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
