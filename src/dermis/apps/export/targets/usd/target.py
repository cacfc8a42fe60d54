"""USD: a stage with the head, what moves it, its hairs, and OpenPBR materials as nodes of MaterialX."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of
from dermis.apps.export.targets.openpbr.materials import (
    OPEN_PBR,
    encoded_maps,
    eye_look,
    looks_of,
    prefix_of,
    write_pictures,
)
from dermis.apps.export.targets.openpbr.target import (
    TYPED,
    fitted_mm,
    misread,
    radii_mm,
    surface_rows,
    typed_mm,
    walk,
)
from dermis.base.errors import refuse
from dermis.base.extras import needed
from dermis.optics.curve import Curve

_PACKAGE, _BINARY = ".usdz", ".usdc"
_UNIT = Row("metersPerUnit", 1.0, "m", "lengths of the stage are metres, those of materials too")


class Usd(Target):
    """A stage, alone with its maps, in a package or in a folder."""

    name = "usd"
    title = "USD with OpenPBR"
    suffixes = (".usda", _BINARY, ".usd", _PACKAGE, "")
    versions = ("1.1.1",)
    needs_maps = True
    wrong = (
        "True for renderers that read the MaterialX nodes and walk as OpenPBR says; UsdPreviewSurface, which "
        "the others read, has no light below the surface at all. Hairs stay where they are when the head "
        "moves, and programs that scale a stage to their own unit must scale radii too."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the walk whose curve is nearest."""
        path = fitted_mm(subject)
        meaning = f"longest mean free path; {misread(path, subject)}"
        return (*surface_rows(subject, OPEN_PBR, path, meaning), _UNIT)

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the diffuse mean free paths of published tables, typed in as mean free paths."""
        return (*surface_rows(subject, OPEN_PBR, typed_mm(subject), TYPED), _UNIT)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of the walk of these rows."""
        return walk(np.array(numbers_of(rows, "subsurface_color")), radii_mm(rows, OPEN_PBR), subject)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the stage, and the maps beside it or in the package."""
        needed("pxr", "writing USD")
        file = self.file_in(place, subject, _BINARY)
        prefix = prefix_of(file, subject)
        if file.suffix.lower() != _PACKAGE:
            return [file, *_write(subject, rows, file, prefix)]
        from pxr import UsdUtils

        with TemporaryDirectory(prefix="dermis-") as folder:
            stage = Path(folder) / f"{prefix}stage{_BINARY}"
            _write(subject, rows, stage, prefix)
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(file)):
                refuse(place.name, "a package that USD can write", "it could not", "Write a .usdc instead")
        return [file]


def _write(subject: Subject, rows: Rows, file: Path, prefix: str) -> list[Path]:
    """Write the stage and the maps beside it; return the paths of the maps."""
    from dermis.apps.export.targets.usd.stage import stage_of

    pictures = write_pictures(subject, file.parent, prefix)
    looks = looks_of(subject, radii_mm(rows, OPEN_PBR), pictures)
    eyes, painted = subject.shape.eyes, subject.eye_pictures()
    if eyes is not None and painted is not None:
        pictures["eye"] = file.parent / f"{prefix}eye.png"
        pictures["eye"].write_bytes(encoded_maps({"eye": painted.colour})["eye"])
        names = subject.shape.mesh.materials
        looks |= {kind: eye_look(names[kind].name) for kind in eyes.material.tolist() if kind in looks}
    stage = stage_of(subject.shape, Path(subject.name).stem or subject.name, looks, prefix)
    if not stage.GetRootLayer().Export(str(file)):
        refuse(file.name, "a stage that USD can write", "it could not", "Choose another name")
    return [*pictures.values()]


TARGET = Usd()
