"""Predicted scattering errors of skins exported to glTF's draft extension for volume scattering."""

from __future__ import annotations

from dermis.apps.export.fitting import profile_error
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.gltf.target import DRAFT_NOTICE, SCATTER_VARIANT, TARGET, TRANSMISSION_VARIANT
from dermis.apps.export.targets.gltf.volume import fit_volume, volume_profile
from dermis.apps.validation.pages import RESULTS, JsonObject, write_results

RESULTS_FILE = RESULTS / "engines_gltf.json"
COMPARED_SKINS = "skin1", "skin2", "marble", "dj3", "gpu-gems-3"
GLTF_TARGET_VERSION = TARGET.versions[-1]


def gltf_results(skin_name: str) -> JsonObject:
    """Return the fitted glTF parameters of a skin, and predicted scattering errors.

    Errors are given for the fitted parameters, for parameters chosen without a fit, and for fitted parameters
    with the skin's albedo as multiple-scattering colour.
    """
    subject = load_subject(skin_name)
    volume = fit_volume(subject.curve, subject.albedo)
    coloured = volume_profile(volume._replace(multiscatter=subject.curve.energy))
    results: JsonObject = {
        "albedo": [round(float(x), 4) for x in subject.curve.energy],
        "multiscatter": [round(float(x), 4) for x in volume.multiscatter],
        "mean_free_path_mm": [round(float(x), 4) for x in volume.mean_free_path_mm],
        "albedo_as_colour": profile_error(subject.curve, coloured).as_json(),
    }
    for variant in (SCATTER_VARIANT, TRANSMISSION_VARIANT):
        target = TARGET.with_variant(variant)
        best, naive = (
            profile_error(
                subject.curve, target.predicted_profile(rows, subject, GLTF_TARGET_VERSION)
            ).as_json()
            for rows in (
                target.parameters(subject, GLTF_TARGET_VERSION),
                target.naive_parameters(subject, GLTF_TARGET_VERSION),
            )
        )
        results[variant] = {"error": best, "naive_error": naive}
    return results


def predict_gltf_errors() -> None:
    """Predict scattering errors of skins exported to glTF; write benchmarks/results/engines_gltf.json."""
    figures = {
        "version": GLTF_TARGET_VERSION,
        "draft": DRAFT_NOTICE,
        "skins": {name: gltf_results(name) for name in COMPARED_SKINS},
    }
    write_results(RESULTS_FILE, figures, 4)
