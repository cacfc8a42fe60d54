"""Predicted errors of skins in glTF's draft of volume scattering, by interpretation of its parameters."""

from __future__ import annotations

from dermis.apps.export.fitting import curve_error
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.gltf.target import DIFFUSE, DRAFT, SCATTER, TARGET
from dermis.apps.export.targets.gltf.volume import fit_volume, volume_curve
from dermis.apps.validation.pages import RESULTS, JsonObject, write_results

FIGURES = RESULTS / "engines_gltf.json"
SKINS = "skin1", "skin2", "marble", "dj3", "gpu-gems-3"
VERSION = TARGET.versions[-1]


def skin_results(name: str) -> JsonObject:
    """Return fitted parameters of a skin and their errors.

    Also the errors of parameters set without a fit, and of the albedo in place of the multiple-scattering
    colour.
    """
    subject = load_subject(name)
    volume = fit_volume(subject.curve, subject.albedo)
    coloured = volume_curve(volume._replace(multiscatter=subject.curve.energy))
    results: JsonObject = {
        "albedo": [round(float(x), 4) for x in subject.curve.energy],
        "multiscatter": [round(float(x), 4) for x in volume.multiscatter],
        "mean_free_path_mm": [round(float(x), 4) for x in volume.mean_free_path_mm],
        "albedo_as_colour": curve_error(subject.curve, coloured).as_json(),
    }
    for variant in (SCATTER, DIFFUSE):
        target = TARGET.with_variant(variant)
        best, naive = (
            curve_error(subject.curve, target.predicted_curve(rows, subject, VERSION)).as_json()
            for rows in (target.parameters(subject, VERSION), target.naive_parameters(subject, VERSION))
        )
        results[variant] = {"error": best, "naive_error": naive}
    return results


def gltf() -> None:
    """Compute the errors of skins in glTF's draft and write benchmarks/results/engines_gltf.json."""
    figures = {"version": VERSION, "draft": DRAFT, "skins": {name: skin_results(name) for name in SKINS}}
    write_results(FIGURES, figures, 4)
