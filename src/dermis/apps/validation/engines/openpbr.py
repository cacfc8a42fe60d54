"""Predicted scattering errors of skins exported to OpenPBR, MaterialX and pbrt, and checks of the files."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.export.fitting import profile_error
from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.openpbr import target as openpbr_target
from dermis.apps.export.targets.openpbr.materials import OPEN_PBR
from dermis.apps.export.targets.openpbr.target import fitted_mean_free_path_mm, materialx_profile
from dermis.apps.export.targets.pbrt import target as pbrt_target
from dermis.apps.validation.pages import RESULTS, JsonObject, read_results, write_results
from dermis.base.console import print_lines
from dermis.base.extras import import_extra

RESULTS_FILE = RESULTS / "engines_openpbr.json"
COMPARED_SKINS = "skin1", "skin2", "marble", "dj3", "light", "gpu-gems-3"
_MISSING_PLUGIN_ERROR = "MissingShaderIdInRegistry"  # reported for a plug-in that usd-core does not include


def skin_errors() -> JsonObject:
    """Return the scattering radii that each skin has in OpenPBR and pbrt, and predicted scattering errors.

    Errors are given for fitted parameters, for parameters chosen without a fit, and for fitted radii that a
    program interprets as widths of a Burley profile.
    """
    results: JsonObject = {}
    for name in COMPARED_SKINS:
        subject = load_subject(name)
        walk = evaluate_export(subject, openpbr_target.TARGET, "1.1.1")
        pbrt = evaluate_export(subject, pbrt_target.TARGET, "4")
        as_profile = profile_error(
            subject.curve, materialx_profile(fitted_mean_free_path_mm(subject), subject)
        )
        results[name] = {
            "model": subject.model,
            "d_mm": float_list(walk.d_mm),
            "openpbr": {
                "radius_mm": float_list(openpbr_target.get_radii_mm(walk.parameters, OPEN_PBR)),
                "error": walk.error.as_json(),
                "naive": walk.naive_error.as_json(),
                "as_a_profile": as_profile.as_json(),
            },
            "pbrt": {
                "mfp_mm": float_list(get_numbers(pbrt.parameters, "mfp")),
                "error": pbrt.error.as_json(),
                "naive": pbrt.naive_error.as_json(),
            },
        }
    return results


def validate_exported_files() -> JsonObject:
    """Validate exported MaterialX and USD files; return the errors found and the libraries' versions."""
    MaterialX = import_extra("MaterialX", "checking its files")
    import_extra("pxr", "checking USD")
    from pxr import Usd, UsdValidation

    with TemporaryDirectory() as folder:
        export_skin("skin1", "openpbr", Path(folder) / "skin.mtlx")
        export_skin("skin1", "usd", Path(folder) / "skin.usda")
        document, library = MaterialX.createDocument(), MaterialX.createDocument()
        library_paths = MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath()
        MaterialX.loadLibraries(*library_paths, library)
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
        "errors": sorted(set(errors) - {_MISSING_PLUGIN_ERROR}),
    }


def float_list(numbers: ArrayLike) -> list[float]:
    """Return an array as a flat list of Python floats, for JSON."""
    return [float(one) for one in np.ravel(numbers)]


def error_table(results: JsonObject) -> list[str]:
    """Return a Markdown table of the largest errors of edge responses, with one row for each skin."""
    lines = [
        "| skin | radius [mm] | OpenPBR's random walk | diffuse mean free path typed in"
        " | radius interpreted as a profile | pbrt | diffuse mean free path typed in |",
        "|---|---|---|---|---|---|---|",
    ]
    for skin, one in results.items():
        errors = [one["openpbr"][name] for name in ("error", "naive", "as_a_profile")]
        errors += [one["pbrt"][name] for name in ("error", "naive")]
        cells = [" / ".join(f"{x:.3f}" for x in error["edge"]) for error in errors]
        radius = " / ".join(f"{x:.2f}" for x in one["openpbr"]["radius_mm"])
        lines.append(f"| {skin} | {' | '.join([radius, *cells])} |")
    return lines


def predict_openpbr_errors() -> None:
    """Predict the scattering errors of exported skins, and write benchmarks/results/engines_openpbr.json.

    The errors are also printed. Needs the packages usd-core and MaterialX; no renderer of these formats is
    run.
    """
    write_results(RESULTS_FILE, {"libraries": validate_exported_files(), "skins": skin_errors()}, 4)
    print_lines(*error_table(read_results(RESULTS_FILE)["skins"]))
