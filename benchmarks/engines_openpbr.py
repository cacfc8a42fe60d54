"""What OpenPBR, MaterialX's profile and pbrt make of skins, by their own formulas and by their libraries.

python benchmarks/engines_openpbr.py

Writes results/engines_openpbr.json and prints the table of docs/engines.md. No renderer of these runs here.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from cyclopts import run
from figures_file import write_figures

from dermis.apps.export.fitting import deviation
from dermis.apps.export.run import export_skin, judged
from dermis.apps.export.subject import subject_of
from dermis.apps.export.target import numbers_of
from dermis.apps.export.targets.openpbr.document import OPEN_PBR
from dermis.apps.export.targets.openpbr.target import fitted_mm, profile_of_specification
from dermis.apps.export.targets.openpbr.target import target as openpbr
from dermis.apps.export.targets.pbrt.target import target as pbrt

RESULTS = Path(__file__).parent / "results" / "engines_openpbr.json"
SKINS = "skin1", "skin2", "marble", "dj3", "light", "gpu-gems-3"
_NODES_OF_MATERIALX = "MissingShaderIdInRegistry"  # of a plug-in that usd-core comes without


def figures() -> dict[str, Any]:
    """By skin: radii and errors as meant, as typed without knowing, and as a profile."""
    found: dict[str, Any] = {}
    for name in SKINS:
        subject = subject_of(name)
        walk = judged(subject, openpbr.TARGET, "1.1.1")
        beam = judged(subject, pbrt.TARGET, "4")
        misread = deviation(subject.curve, profile_of_specification(fitted_mm(subject), subject))
        found[name] = {
            "model": subject.model,
            "d_mm": numbers(walk.d_mm),
            "openpbr": {
                "radius_mm": numbers(openpbr.radii_mm(walk.rows, OPEN_PBR)),
                "error": walk.error.as_json(),
                "naive": walk.naive_error.as_json(),
                "as_a_profile": misread.as_json(),
            },
            "pbrt": {
                "mfp_mm": numbers(numbers_of(beam.rows, "mfp")),
                "error": beam.error.as_json(),
                "naive": beam.naive_error.as_json(),
            },
        }
    return found


def checked() -> dict[str, Any]:
    """What the libraries say of documents and stages, and their versions."""
    import MaterialX
    from pxr import Usd, UsdValidation

    with TemporaryDirectory() as folder:
        export_skin("skin1", "openpbr", Path(folder) / "skin.mtlx")
        export_skin("skin1", "usd", Path(folder) / "skin.usda")
        document, library = MaterialX.createDocument(), MaterialX.createDocument()
        places = MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath()
        MaterialX.loadLibraries(*places, library)
        MaterialX.readFromXmlFile(document, str(Path(folder) / "skin.mtlx"))
        document.setDataLibrary(library)
        stage = Usd.Stage.Open(str(Path(folder) / "skin.usda"))
        validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        errors = [one.GetName() for one in UsdValidation.ValidationContext(validators).Validate(stage)]
    return {
        "materialx": MaterialX.getVersionString(),
        "valid": document.validate()[0],
        "usd": ".".join(map(str, Usd.GetVersion()[1:])),
        "validators": len(validators),
        "errors": sorted(set(errors) - {_NODES_OF_MATERIALX}),
    }


def numbers(values: Any) -> list[float]:
    """Plain numbers."""
    return [float(one) for one in np.ravel(values)]


def table(found: dict[str, Any]) -> list[str]:
    """Markdown, an edge's largest difference for each reading."""
    lines = [
        "| skin | radius [mm] | OpenPBR's walk | dmfp typed in | read as a profile | pbrt | dmfp typed in |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, one in found.items():
        walk, beam = one["openpbr"], one["pbrt"]
        edges = [walk["error"], walk["naive"], walk["as_a_profile"], beam["error"], beam["naive"]]
        told = [" / ".join(f"{x:.3f}" for x in edge["edge"]) for edge in edges]
        radius = " / ".join(f"{x:.2f}" for x in walk["radius_mm"])
        lines.append(f"| {name} | {' | '.join([radius, *told])} |")
    return lines


def main() -> None:
    """Compute and write."""
    write_figures(RESULTS, {"libraries": checked(), "skins": figures()}, 4)
    told = json.loads(RESULTS.read_text("utf-8"))
    sys.stdout.write("\n".join([*table(told["skins"]), ""]))


if __name__ == "__main__":
    run(main)
