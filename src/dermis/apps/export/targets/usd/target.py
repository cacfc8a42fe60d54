"""USD: a stage with the head, what moves it, its hairs, and OpenPBR materials as nodes of MaterialX."""

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
    mesh_materials,
    file_prefix,
    write_maps,
)
from dermis.apps.export.targets.openpbr.target import (
    PUBLISHED_MEANING,
    fitted_path_mm,
    profile_error_text,
    parameter_radii_mm,
    surface_parameters,
    published_path_mm,
    walk_curve,
)
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.optics.cumulative_profile import CumulativeProfile

_PACKAGE, _BINARY = ".usdz", ".usdc"
_UNIT_PARAMETER = Parameter("metersPerUnit", 1.0, "m", "lengths of the stage are metres, those of materials too")


class Usd(Target):
    """A stage, alone with its maps, in a package or in a folder."""

    name = "usd"
    title = "USD with OpenPBR"
    suffixes = (".usda", _BINARY, ".usd", _PACKAGE, "")
    versions = ("1.1.1",)
    needs_maps = True
    limitations = (
        "True for renderers that read the MaterialX nodes and walk as OpenPBR says; UsdPreviewSurface, which "
        "the others read, has no light below the surface at all. Hairs stay where they are when the head "
        "moves, and programs that scale a stage to their own unit must scale radii too."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the walk whose curve is nearest."""
        path = fitted_path_mm(subject)
        meaning = f"longest mean free path; {profile_error_text(path, subject)}"
        return (*surface_parameters(subject, OPEN_PBR, path, meaning), _UNIT_PARAMETER)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the diffuse mean free paths of published tables, typed in as mean free paths."""
        return (*surface_parameters(subject, OPEN_PBR, published_path_mm(subject), PUBLISHED_MEANING), _UNIT_PARAMETER)

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the curve of the walk of these rows."""
        return walk_curve(np.array(get_numbers(parameters, "subsurface_color")), parameter_radii_mm(parameters, OPEN_PBR), subject)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the stage, and the maps beside it or in the package."""
        import_extra("pxr", "writing USD")
        file = self.main_file(output,  subject, _BINARY)
        prefix = file_prefix(file, subject)
        if file.suffix.lower() != _PACKAGE:
            return [file, *_write(subject, parameters, file, prefix)]
        from pxr import UsdUtils

        with TemporaryDirectory(prefix="dermis-") as folder:
            stage = Path(folder) / f"{prefix}stage{_BINARY}"
            _write(subject, parameters, stage, prefix)
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(file)):
                refuse(output.name, "a package that USD can write", "it could not", "Write a .usdc instead")
        return [file]


def _write(subject: Subject, parameters: Parameters, file: Path, prefix: str) -> list[Path]:
    """Write the stage and the maps beside it; return the paths of the maps."""
    from dermis.apps.export.targets.usd.stage import build_stage

    pictures = write_maps(subject, file.parent, prefix)
    looks = mesh_materials(subject, parameter_radii_mm(parameters, OPEN_PBR), pictures)
    eyes, painted = subject.head_or_ball.eyes, subject.eye_pictures()
    if eyes is not None and painted is not None:
        pictures["eye"] = file.parent / f"{prefix}eye.png"
        pictures["eye"].write_bytes(encode_map_files({"eye": painted.colour})["eye"])
        names = subject.head_or_ball.mesh.materials
        looks |= {kind: eye_material(names[kind].name) for kind in eyes.material.tolist() if kind in looks}
    stage = build_stage(subject.head_or_ball, Path(subject.name).stem or subject.name, looks, prefix)
    if not stage.GetRootLayer().Export(str(file)):
        refuse(file.name, "a stage that USD can write", "it could not", "Choose another name")
    return [*pictures.values()]


TARGET = Usd()
