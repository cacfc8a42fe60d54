"""Export to USD: a stage with a head, rig, hairs, and OpenPBR materials as MaterialX nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import ClassVar

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    encode_map_files,
    eye_material,
    file_prefix,
    mesh_materials,
    write_maps,
    write_part_pictures,
)
from dermis.apps.export.targets.openpbr.target import OpenPbr, get_radii_mm
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.human.expressions import available_expressions

_PACKAGE_SUFFIX, _BINARY_SUFFIX = ".usdz", ".usdc"
_METERS_PER_UNIT_PARAMETER = Parameter("metersPerUnit", 1.0, "m", "unit of all lengths, also in materials")


class Usd(OpenPbr):
    """Export to a USD stage: a file with maps beside it, a .usdz package, or a folder."""

    name = "usd"
    title = "USD with OpenPBR"
    suffixes = (".usda", _BINARY_SUFFIX, ".usd", _PACKAGE_SUFFIX, "")
    variants = ()
    import_steps = (
        "Open the stage in usdview, or import it: in Blender with File > Import > Universal Scene Desc.",
        "Keep the unit at metres; if the program converts it, scale `subsurface_radius` as well.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.usd?": "stage with all parts of the head and their materials; metres, Y up",
        "*.usd": "stage with all parts of the head and their materials; metres, Y up",
        "*_roughness.png": "roughness of OpenPBR, the square root of Beckmann's m; linear",
    }
    limitations = (
        "Correct in renderers that support the MaterialX nodes and random walks as OpenPBR specifies. Others "
        "use UsdPreviewSurface, which has no subsurface scattering. Scalp hair follows one bone only. "
        "Programs that convert the unit of a stage must also scale the radii."
    )
    part_limitations = ""

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return `import_steps`, and how to move the head or, without a rig, how to render it."""
        names = subject.head_or_ball.targets
        if len(available_expressions(names)) > 1:  # more than "neutral"
            last = (
                "Choose an expression with the variant set `expression` of the top prim, or set the weights "
                "of blend shapes in `skeleton/rest`."
            )
        elif names:
            last = "Set the weights of blend shapes in `skeleton/rest`."
        elif subject.head_or_ball.bones:
            last = "Pose the joints in `skeleton/rest`."
        else:
            last = (
                "Render with OpenPBR as MaterialX nodes, if the program supports these; UsdPreviewSurface "
                "has no subsurface scattering."
            )
        return (*self.import_steps, last)

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the OpenPBR parameters for which the random walk is closest to the reference profile."""
        return (*super().parameters(subject, version), _METERS_PER_UNIT_PARAMETER)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of a user who enters published diffuse mean free paths as mean free paths.

        OpenPBR expects mean free paths, which have other values.
        """
        return (*super().naive_parameters(subject, version), _METERS_PER_UNIT_PARAMETER)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the stage, with the maps beside the stage file or inside the .usdz package."""
        import_extra("pxr", "writing USD")
        file = self.main_file(output, subject, _BINARY_SUFFIX)
        prefix = file_prefix(file, subject)
        if file.suffix.lower() != _PACKAGE_SUFFIX:
            return [file, *_write_stage(subject, parameters, file, prefix)]
        from pxr import UsdUtils

        with TemporaryDirectory(prefix="dermis-") as folder:
            stage = Path(folder) / f"{prefix}stage{_BINARY_SUFFIX}"
            _write_stage(subject, parameters, stage, prefix)
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(file)):
                refuse(output.name, "a package that USD can write", "it failed", "Write a .usdc instead")
        return [file]


def _write_stage(subject: Subject, parameters: Parameters, stage_path: Path, map_prefix: str) -> list[Path]:
    """Write the stage file, and the maps beside the stage file; return the paths of the maps.

    map_prefix : prefix of the file names of the maps
    """
    from dermis.apps.export.targets.usd.stage import build_stage

    maps, head = write_maps(subject, stage_path.parent, map_prefix), subject.head_or_ball
    definitions = mesh_materials(subject, get_radii_mm(parameters, OPEN_PBR), maps)
    eye_pictures = subject.eye_pictures()
    if head.eyes is not None and eye_pictures is not None:
        maps["eye"] = stage_path.parent / f"{map_prefix}eye.png"
        maps["eye"].write_bytes(encode_map_files({"eye": eye_pictures.colour})["eye"])
        for material in definitions.keys() & set(head.eyes.material.tolist()):
            definitions[material] = eye_material(head.mesh.materials[material].name)
    part_pictures = write_part_pictures(subject, stage_path.parent, map_prefix, ["cutout"])
    stage = build_stage(head, Path(subject.name).stem or subject.name, definitions, map_prefix)
    if not stage.GetRootLayer().Export(str(stage_path)):
        refuse(stage_path.name, "a stage that USD can write", "it failed", "Choose another name")
    return [*maps.values(), *part_pictures]


TARGET = Usd()
