"""Export to Unreal Engine: the maps of a head, and an editor script that creates a SubsurfaceProfile.

In SubsurfaceProfile.cpp and BurleyNormalizedSSS.cpp, the width d of the Burley profile is the mean free path
divided by 0.6 s(A). Here A is the albedo, and s is Burley's factor for light at normal incidence.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
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
from dermis.apps.export.targets.engine_files import (
    LOD_FILE_MEANINGS,
    colour_png,
    engine_maps,
    lod_files,
    normal_png,
    packed_png,
)
from dermis.formats.gltf.materials import skin_material_names
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import UNREAL_SHAPE_RATIO, BurleyProfile, shape_factor, unreal_parameters
from dermis.optics.media import SKIN_ETA, Floats

ALBEDO_NAME, MEAN_FREE_PATH_COLOUR_NAME, MEAN_FREE_PATH_DISTANCE_NAME = (
    "surface_albedo",
    "mean_free_path_color",
    "mean_free_path_distance",
)
WORLD_UNIT_SCALE_NAME, DISTANCE_SCALE_NAME = "world_unit_scale", "distance_scale"
_MIN_MEAN_FREE_PATH_COLOUR, _MAX_DISTANCE_CM, _MIN_ALBEDO = 0.001, 50.0, 1e-3
_MIN_ENGINE_COLOUR = 0.009  # lower limit that the engine applies
_MM_PER_CM = 10.0
COLOUR_PARAMETER = "BaseColor"
_F0_AT_FULL_SPECULAR = 0.08
_SKIN_SPECULAR = ((SKIN_ETA - 1.0) / (SKIN_ETA + 1.0)) ** 2 / _F0_AT_FULL_SPECULAR  # for a strength of 1
_VERSIONS_BEFORE_5_8 = ("5.3", "5.4", "5.5", "5.6", "5.7")


class Unreal(Target):
    """Export to a SubsurfaceProfile of Unreal Engine with Burley's kernel, for scenes in cm."""

    name = "unreal"
    title = "Unreal Engine"
    suffixes = ("", ".py")
    versions = (*_VERSIONS_BEFORE_5_8, "5.8")
    needs_maps = True
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.py": "script for the editor",
        "T_*_BC.png": "colour of the skin; sRGB",
        "T_*_N.png": "normals in tangent space, green up (the script flips it); linear",
        "T_*_SRM.png": "specular in red, roughness in green, metallic in blue; linear",
        **LOD_FILE_MEANINGS,
    }
    part_limitations = (
        "Only skin is exported to a single file; an export to a folder contains the other parts."
    )
    limitations = (
        "The base colour of the material, not the profile, colours the light. Before 5.8, thicknesses are "
        "wrong by a factor of about 100 for light through thin parts, which no parameter corrects; in 5.8 "
        "they are correct if r.SSProfiles.Transmission.UseLegacy is 0."
    )
    untested = True

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return the steps that run the script, and how to use the meshes or the material alone."""
        meshes = [file.stem for file in files if file.suffix == ".glb"]
        imported = "imports meshes and maps, and " if meshes else ""
        third = f"Set the material of the skin of a mesh to `MI_{subject.identifier}`."
        if meshes:
            third = f"Drag the mesh `{meshes[0]}` into the level."
        if len(meshes) > 1:
            third = f"{third[:-1]}; `{meshes[1]}` is the second level of detail for its LOD settings."
        return (
            "Keep the files together, and enable the plug-ins Python Editor Script and Interchange.",
            f"Choose Tools > Execute Python Script, and select `{files[0].name}`: it {imported}creates the "
            "subsurface profile, the material and its instance in /Game/Dermis.",
            third,
        )

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
        """Write the editor script, and beside it the maps of a head and, into a folder, the meshes."""
        file = self.main_file(output, subject)
        maps = {name: (f"T_{file.stem}_{suffix}.png", data) for name, suffix, data in _map_files(subject)}
        meshes = [] if output.suffix else list(lod_files(subject, f"SK_{file.stem}"))
        names = {parameter: name for parameter, (name, _) in maps.items()}
        script = _editor_script(subject, parameters, names, [name for name, _ in meshes], version)
        file.write_text(script, encoding="utf-8")
        return [file, *write_files(file.parent, [*maps.values(), *meshes])]


def _map_files(subject: Subject) -> Iterator[tuple[str, str, bytes]]:
    """Yield the texture parameter, the suffix of the file name, and the file of each map.

    SRM: red specular (0.08 is F0 at 1), green roughness, blue metallic.
    """
    maps = engine_maps(subject)
    if "colour" in maps:
        yield COLOUR_PARAMETER, "BC", colour_png(maps["colour"])
    if "normal" in maps:
        yield "Normal", "N", normal_png(maps["normal"])
    if "roughness" in maps:
        strength = maps.get("specular", subject.skin.specular_strength)
        yield "SRM", "SRM", packed_png(_SKIN_SPECULAR * strength, maps["roughness"], 0.0)


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
    subject: Subject,
    parameters: Parameters,
    map_files: Mapping[str, str],
    mesh_files: Sequence[str],
    version: str,
) -> str:
    """Return a Python script for the editor that creates the profile and imports the files beside the script.

    map_files : dictionary from the texture parameter that each map sets to the name of the map
    mesh_files : names of the meshes
    """
    skin = subject.skin
    settings = [
        f"    {json.dumps(one.name)}: {_python_literal(one.value)},  # {one.unit}\n" for one in parameters
    ]
    files = [
        f"    {json.dumps(parameter)}: ({json.dumps(name)}, {parameter == COLOUR_PARAMETER}),\n"
        for parameter, name in map_files.items()
    ]
    text = Path(__file__).with_name("editor_script.txt").read_text("utf-8")
    fields = {"NAME": json.dumps(subject.identifier), "TITLE": subject.identifier, "VERSION": version}
    fields |= {"SETTINGS": "".join(settings), "MAPS": "".join(files)}
    fields["MESHES"] = ", ".join(map(json.dumps, mesh_files))
    fields["SLOTS"] = ", ".join(map(json.dumps, skin_material_names(subject.head_or_ball)))
    fields["ROUGHNESS"] = f"{np.sqrt(skin.roughness * skin.roughness_factor):.6g}"
    fields["SPECULAR"] = f"{_SKIN_SPECULAR * skin.specular_strength:.6g}"
    fields["COLOUR"] = ", ".join(f"{x:.6g}" for x in subject.clipped_albedo())
    for field, value in fields.items():
        text = text.replace(f"@{field}@", value)
    return text


def _python_literal(parameter_value: ParameterValue) -> str:
    if isinstance(parameter_value, tuple):
        return f"unreal.LinearColor({', '.join(f'{x:.6g}' for x in parameter_value)}, 1.0)"
    return f"{parameter_value:.6g}" if isinstance(parameter_value, float) else repr(parameter_value)


TARGET = Unreal()
