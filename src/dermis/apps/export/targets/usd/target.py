"""Export to USD: a stage with the head, its rig and hairs, and OpenPBR materials as MaterialX nodes."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, get_numbers
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    encode_map_files,
    eye_material,
    file_prefix,
    mesh_materials,
    write_maps,
)
from dermis.apps.export.targets.openpbr.target import (
    PUBLISHED_MEANING,
    fitted_path_mm,
    get_radii_mm,
    profile_error_text,
    published_path_mm,
    surface_parameters,
    walk_curve,
)
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.optics.cumulative_profile import CumulativeProfile

_PACKAGE, _BINARY = ".usdz", ".usdc"
_UNIT_PARAMETER = Parameter("metersPerUnit", 1.0, "m", "unit of all lengths, also in materials")


class Usd(Target):
    """Export to a USD stage: a file with maps beside it, a .usdz package, or a folder."""

    name = "usd"
    title = "USD with OpenPBR"
    suffixes = (".usda", _BINARY, ".usd", _PACKAGE, "")
    versions = ("1.1.1",)
    needs_maps = True
    limitations = (
        "Correct in renderers that support the MaterialX nodes and random walks as OpenPBR specifies. Others "
        "use UsdPreviewSurface, which has no subsurface scattering. Hairs do not follow the head's motion. "
        "Programs that convert the unit of a stage must also scale the radii."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of OpenPBR whose random walk is closest to the profile."""
        path = fitted_path_mm(subject)
        meaning = f"longest mean free path; {profile_error_text(path, subject)}"
        return (*surface_parameters(subject, OPEN_PBR, path, meaning), _UNIT_PARAMETER)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return published diffuse mean free paths used as mean free paths."""
        path = published_path_mm(subject)
        return (*surface_parameters(subject, OPEN_PBR, path, PUBLISHED_MEANING), _UNIT_PARAMETER)

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of the random walk with the parameters."""
        colour = np.array(get_numbers(parameters, "subsurface_color"))
        return walk_curve(colour, get_radii_mm(parameters, OPEN_PBR), subject)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the stage, with the maps beside it or in the package."""
        import_extra("pxr", "writing USD")
        file = self.main_file(output, subject, _BINARY)
        prefix = file_prefix(file, subject)
        if file.suffix.lower() != _PACKAGE:
            return [file, *_write(subject, parameters, file, prefix)]
        from pxr import UsdUtils

        with TemporaryDirectory(prefix="dermis-") as folder:
            stage = Path(folder) / f"{prefix}stage{_BINARY}"
            _write(subject, parameters, stage, prefix)
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(file)):
                refuse(output.name, "a package that USD can write", "it failed", "Write a .usdc instead")
        return [file]


def _write(subject: Subject, parameters: Parameters, file: Path, prefix: str) -> list[Path]:
    """Write the stage, and the maps beside it; return the paths of the maps."""
    from dermis.apps.export.targets.usd.stage import build_stage

    maps, head = write_maps(subject, file.parent, prefix), subject.head_or_ball
    definitions = mesh_materials(subject, get_radii_mm(parameters, OPEN_PBR), maps)
    eye_pictures = subject.eye_pictures()
    if head.eyes is not None and eye_pictures is not None:
        maps["eye"] = file.parent / f"{prefix}eye.png"
        maps["eye"].write_bytes(encode_map_files({"eye": eye_pictures.colour})["eye"])
        for material in definitions.keys() & set(head.eyes.material.tolist()):
            definitions[material] = eye_material(head.mesh.materials[material].name)
    stage = build_stage(head, Path(subject.name).stem or subject.name, definitions, prefix)
    if not stage.GetRootLayer().Export(str(file)):
        refuse(file.name, "a stage that USD can write", "it failed", "Choose another name")
    return [*maps.values()]


TARGET = Usd()
