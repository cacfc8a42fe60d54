"""Export to Unity HDRP: a DiffusionProfileSettings asset, and the maps of a head.

In DiffusionProfileSettings.cs, the width d of the Burley profile [mm] is the scattering colour times the
multiplier. The world scale must be the length of a scene unit in metres.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from string import Template
from typing import ClassVar

import numpy as np

from dermis.apps.export.fitting import cumulative_burley_profile, fit_burley_width
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import (
    Parameter,
    Parameters,
    ParameterValue,
    Target,
    flat_tuple,
    get_numbers,
    replace_values,
    write_files,
)
from dermis.apps.export.targets.engine_files import LOD_FILE_MEANINGS
from dermis.apps.export.targets.unity.project import project_files
from dermis.formats.gltf.write import skin_part_names
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import BurleyProfile, unity_parameters
from dermis.optics.media import Floats

_SCATTERING_DISTANCE_NAME, _MULTIPLIER_NAME, _WORLD_SCALE_NAME, _IOR_NAME = (
    "scatteringDistance",
    "scatteringDistanceMultiplier",
    "worldScale",
    "ior",
)
_TRANSMISSION_NAME, _THICKNESS_NAME = "transmissionTint", "thicknessRemap"
_SKIN_IOR, _RELATIVE_MAX_THICKNESS = 1.4, 10.0  # thickness relative to the largest d
_NAIVE_MULTIPLIER_MM = 1.0
_VERSION_BEFORE_14 = "12"
_FILE_VERSION_BY_HDRP_VERSION = {
    _VERSION_BEFORE_14: 1,
    "14": 2,
    "17": 2,
}  # m_Version; version 1 has no multiplier


class Unity(Target):
    """Export to a DiffusionProfileSettings asset or, for a head in a folder, to a project of Unity."""

    name = "unity"
    title = "Unity HDRP"
    suffixes = (".asset", "")
    versions = tuple(_FILE_VERSION_BY_HDRP_VERSION)
    needs_maps = True
    import_steps = (
        "Copy the diffusion profile, and the maps beside it if there are any, into Assets of a project with "
        "HDRP.",
        "Create a material of HDRP/Lit with the material type Subsurface Scattering.",
        "Choose the diffusion profile in the material, and press Fix to add the profile to the list of the "
        "project.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.meta": "import settings and GUID of the file with this name",
        "Packages/manifest.json": "packages of the project: HDRP, and glTFast for the meshes",
        "ProjectSettings/ProjectVersion.txt": "version of the editor",
        "*.asset": "diffusion profile",
        "*_Skin.mat": "material of the skin: HDRP/Lit with subsurface scattering and the maps",
        "*_BaseMap.png": "colour of the skin; sRGB",
        "*_MaskMap.png": "smoothness of the skin in alpha, no occlusion in green; linear",
        "*_Normal.png": "normals in tangent space, green up; linear",
        **LOD_FILE_MEANINGS,
    }
    part_limitations = (
        "Only skin is exported to a single file; an export to a folder contains the other parts."
    )
    limitations = (
        "The filter is truncated at 99.7 % of the widest channel. In a scene that is not in metres, "
        "worldScale must be set to the length of a unit."
    )
    untested = True

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return the steps for a project, or `import_steps` for a profile alone."""
        meshes = [file.stem for file in files if file.suffix == ".glb"]
        if not meshes:
            return self.import_steps
        parts = " and ".join(f"`{name}`" for name in skin_part_names(subject.head_or_ball))
        skin = f"`{subject.identifier}_Skin`"
        second = (
            f"Drag the mesh `{meshes[0]}` into the scene, and set the material of {parts} in it to {skin}"
        )
        if len(meshes) > 1:
            second += f"; the mesh `{meshes[1]}` is the second level for a LOD Group"
        return (
            "Open the folder as a project in the Unity Hub, and run Window > Rendering > HDRP Wizard > Fix "
            "All, or copy the subfolder of Assets into a project with HDRP and glTFast.",
            f"{second}.",
            f"Select {skin}, choose the diffusion profile in its field, and press Fix to add the profile to "
            "the list of the project.",
        )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the scattering colour and multiplier for which the profile is closest to the reference."""
        d = fit_burley_width(subject.curve)
        return (
            *_scattering_distances(d, version),
            Parameter(_WORLD_SCALE_NAME, 1.0, "m", "metres per scene unit"),
            Parameter(_IOR_NAME, _SKIN_IOR, "-", "of the specular reflection"),
            Parameter(_TRANSMISSION_NAME, (1.0, 1.0, 1.0), "-", "factor of light through thin parts"),
            Parameter(
                _THICKNESS_NAME,
                (0.0, _RELATIVE_MAX_THICKNESS * float(d.max())),
                "mm",
                "range of a thickness map",
            ),
        )

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters without a fit: the scattering distance is the skin's colour times 1 mm."""
        colour = flat_tuple(subject.clipped_albedo())
        values: dict[str, ParameterValue] = {
            _SCATTERING_DISTANCE_NAME: colour,
            _MULTIPLIER_NAME: _NAIVE_MULTIPLIER_MM,
        }
        return replace_values(self.parameters(subject, version), values)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative Burley profile that HDRP derives from scattering colour and multiplier."""
        colour, scale = (
            np.array(get_numbers(parameters, _SCATTERING_DISTANCE_NAME)),
            get_numbers(parameters, _WORLD_SCALE_NAME)[0],
        )
        multiplier = 1.0 if version == _VERSION_BEFORE_14 else get_numbers(parameters, _MULTIPLIER_NAME)[0]
        return cumulative_burley_profile(colour * multiplier / scale, subject.curve.energy)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the asset and the maps of a head beside it; a head in a folder becomes a Unity project."""
        if not output.suffix and subject.head is not None:
            stem = subject.identifier
            profile = asset_text(f"{stem}_DiffusionProfile", parameters, version)
            return write_files(output, project_files(subject, stem, profile, version))
        asset = self.main_file(output, subject)
        asset.write_text(asset_text(asset.stem, parameters, version), encoding="utf-8")
        maps = ((f"{asset.stem}_{role}.png", data) for role, data in subject.encode_maps().items())
        return [asset, *write_files(asset.parent, maps)]


def _scattering_distances(burley_width_mm: Floats, version: str) -> Parameters:
    """Return Burley widths as parameters: a colour before HDRP 14; a colour and a multiplier since HDRP 14.

    burley_width_mm : (3,) widths of the Burley profiles [mm]
    """
    if version == _VERSION_BEFORE_14:
        return (
            Parameter(
                _SCATTERING_DISTANCE_NAME, flat_tuple(burley_width_mm), "mm", "d as a linear HDR colour"
            ),
        )
    profile = unity_parameters(BurleyProfile(np.ones(3), 1.0 / burley_width_mm))
    return (
        Parameter(
            _SCATTERING_DISTANCE_NAME,
            profile.scattering_colour,
            "-",
            "d relative to its largest channel, linear",
        ),
        Parameter(_MULTIPLIER_NAME, profile.multiplier_mm, "mm", "largest d of the channels"),
    )


def asset_text(asset_name: str, parameters: Parameters, version: str) -> str:
    """Return the YAML of the asset; the profile's hash is left out, as Unity adds it on first opening."""
    values = {one.name: one.value for one in parameters}
    colour, tint = (
        _format_rgba(get_numbers(parameters, key)) for key in (_SCATTERING_DISTANCE_NAME, _TRANSMISSION_NAME)
    )
    low, high = get_numbers(parameters, _THICKNESS_NAME)
    multiplier = (
        f"    {_MULTIPLIER_NAME}: {values[_MULTIPLIER_NAME]:.6g}\n" if _MULTIPLIER_NAME in values else ""
    )
    template = Template(Path(__file__).with_name("profile.asset").read_text("utf-8"))
    return template.substitute(
        name=json.dumps(asset_name),
        colour=colour,
        multiplier=multiplier,
        tint=tint,
        low=f"{low:.6g}",
        high=f"{high:.6g}",
        scale=f"{values[_WORLD_SCALE_NAME]:.6g}",
        ior=f"{values[_IOR_NAME]:.6g}",
        form=_FILE_VERSION_BY_HDRP_VERSION[version],
    )


def _format_rgba(colour: tuple[float, ...]) -> str:
    r, g, b = colour
    return f"{{r: {r:.6g}, g: {g:.6g}, b: {b:.6g}, a: 1}}"


TARGET = Unity()
