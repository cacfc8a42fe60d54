"""Measurements of exported skin and heads in Blender, rendered by Cycles."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal, get_args

import numpy as np
from cyclopts import Parameter
from PIL import Image

from dermis.apps.export.fitting import fit_burley_width, profile_error
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.blender.target import TARGET
from dermis.apps.truths.blender_process import BlenderTask, blender_python, run_blender
from dermis.apps.validation.engines.heads import (
    EXPORTED_MAP_SIDE,
    Floats,
    compare_pictures,
    render_cycles,
    render_dermis,
)
from dermis.apps.validation.pages import DOCS, RESULTS, JsonObject, read_results, write_results
from dermis.base.console import print_lines
from dermis.images.colour import encode_srgb
from dermis.optics.cumulative_profile import CumulativeProfile

RESULTS_FILE = RESULTS / "engines_blender.json"
PICTURE_FILE = DOCS / "images" / "engines_blender.webp"
BLENDER_SCRIPT = Path(__file__).with_name("blender_script.py")
Measurement = Literal["edges", "heads", "picture"]
COMPARED_SKINS = "skin1", "skin2", "dj3"
SUBSURFACE_METHODS = "random-walk-skin", "random-walk", "burley"
EDGE_BIN_COUNT, PIXELS_PER_BIN, PIXEL_ROWS = (
    12,
    8,
    8,
)  # bins from -6 d to 6 d, pixels across a bin, and rows of pixels
SAMPLES_BY_METHOD = {"burley": 512}
DEFAULT_SAMPLES = 1024
SEED_COUNT = 2  # pictures per channel; their difference gives the noise
HEAD_SIDE, HEAD_SAMPLES, HEAD_SEEDS = 192, 32, 2
PICTURE_SIDE, PICTURE_SAMPLES = 320, 48
METHODS_BY_VERSION = {"4.5": ("random-walk-skin",), "5.2": ("random-walk-skin", "random-walk", "burley")}
HALF_LIT_PLANE_TASK = BlenderTask(
    "Cycles", "to render a half-lit plane", "See the message of Blender in brackets"
)


def measure_blender(
    blender_45_python: Annotated[Path, Parameter(name="--python-45")],
    blender_52_python: Annotated[Path, Parameter(name="--python-52")],
    *parts: Measurement,
) -> None:
    """Measure exported skin in Cycles and write benchmarks/results/engines_blender.json; takes half an hour.

    Parameters
    ----------
    blender_45_python:
        Python program that has the module bpy of Blender 4.5.
    blender_52_python:
        Python program that has the module bpy of Blender 5.2.
    parts:
        Measurements to make [all]; other measurements keep their last results.
    """
    python_by_version = {"4.5": blender_python(blender_45_python), "5.2": blender_python(blender_52_python)}
    parts = parts or get_args(Measurement)
    results: JsonObject = read_results(RESULTS_FILE) if RESULTS_FILE.exists() else {}
    results["columns_in_d"] = (
        column_edge_distances().reshape(EDGE_BIN_COUNT, PIXELS_PER_BIN).mean(axis=1).tolist()
    )
    if "edges" in parts:
        results["edges"] = list(measure_edges(python_by_version))
        write_results(RESULTS_FILE, results)
    if "heads" in parts:
        results["heads"] = list(measure_heads(python_by_version))
        write_results(RESULTS_FILE, results)
    if "picture" in parts:
        write_hair_picture(python_by_version)


def measure_edges(python_by_version: dict[str, Path]) -> Iterator[JsonObject]:
    """Yield results of `measure_edge_response` for each Blender version, subsurface method and skin."""
    for version, python in python_by_version.items():
        for method in SUBSURFACE_METHODS:
            for name in COMPARED_SKINS:
                yield measure_edge_response(python, version, method, name)
                print_lines(f"{version} {method} {name}")


def column_edge_distances() -> Floats:
    """Return the distances (n,) of the n pixel columns from the edge of the lit half of the plane [-].

    The distances are in units of the width d of Burley's profile, and positive on the lit side.
    """
    return 12.0 * (np.arange(EDGE_BIN_COUNT * PIXELS_PER_BIN) + 0.5) / (EDGE_BIN_COUNT * PIXELS_PER_BIN) - 6.0


def measure_edge_response(
    python_program: Path, blender_version: str, subsurface_method: str, skin_name: str
) -> JsonObject:
    """Return the measured and the predicted edge response of an exported skin, and its errors.

    An edge response is the radiance of a half-lit plane by distance from the edge of the lit half.

    python_program : Python program that has Blender's module bpy
    blender_version : version of Blender for which the skin is exported
    subsurface_method : name of a variant of the export target "blender"
    skin_name : name of the skin
    """
    subject, target = load_subject(skin_name), TARGET.with_variant(subsurface_method)
    rows, d = target.parameters(subject, blender_version), fit_burley_width(subject.curve)
    predicted_profile = target.predicted_profile(rows, subject, blender_version)
    naive = target.predicted_profile(
        target.naive_parameters(subject, blender_version), subject, blender_version
    )
    samples = SAMPLES_BY_METHOD.get(subsurface_method, DEFAULT_SAMPLES)
    shared = {"size": [EDGE_BIN_COUNT * PIXELS_PER_BIN, PIXEL_ROWS], "samples": samples}
    channels = [(k, c) for k in range(SEED_COUNT) for c in range(3)]
    passes = [{"channel": c, "width_m": 12e-3 * d[c], "seed": k, **shared} for k, c in channels]
    with TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        target.write(subject, rows, folder, blender_version)
        (folder / "passes.json").write_text(json.dumps(passes), encoding="utf-8")
        run_blender(python_program, BLENDER_SCRIPT, [str(folder)], 3600.0, HALF_LIT_PLANE_TASK)
        output = json.loads((folder / "done.json").read_text(encoding="utf-8"))
    columns = np.array([[output["columns"][3 * k + c] for c in range(3)] for k in range(SEED_COUNT)])[..., 0]
    means = columns.reshape(SEED_COUNT, 3, EDGE_BIN_COUNT, PIXELS_PER_BIN).mean(axis=-1)
    predicted, true = (binned_edge_response(curve, d) for curve in (predicted_profile, subject.curve))
    radiance = (means.mean(axis=0) * predicted).sum(axis=1) / (predicted**2).sum(axis=1)
    measured = means.mean(axis=0) / radiance[:, None]
    noise = np.abs(means[0] - means[1]) / (2.0 * radiance[:, None])
    return {
        "version": output["version"],
        "method": subsurface_method,
        "skin": skin_name,
        "samples": SEED_COUNT * PIXELS_PER_BIN * PIXEL_ROWS * samples,
        "d_mm": d.round(4).tolist(),
        "measured": measured.round(4).tolist(),
        "predicted": predicted.round(4).tolist(),
        "against_predicted": np.abs(measured - predicted).max(axis=1).round(4).tolist(),
        "against_true": np.abs(measured - true).max(axis=1).round(4).tolist(),
        "noise": np.sqrt((noise**2).mean(axis=1)).round(4).tolist(),
        "energy": (np.pi * radiance / subject.curve.energy).round(4).tolist(),
        "typed_in": profile_error(subject.curve, naive).edge.round(4).tolist(),
        "predicted_energy": (predicted_profile.energy / subject.curve.energy).round(4).tolist(),
    }


def binned_edge_response(cumulative_profile: CumulativeProfile, burley_width_mm: Floats) -> Floats:
    """Return the predicted edge response (3, n) of a profile, averaged over groups of pixel columns.

    The picture is 12 Burley widths wide. Its pixel columns are divided into n groups of adjacent columns.

    cumulative_profile : cumulative form of the profile
    burley_width_mm : (3,) Burley width of each channel [mm]
    """
    columns = [
        cumulative_profile.edge_response(column_edge_distances() * burley_width_mm[c])[:, c] for c in range(3)
    ]
    return np.asarray(np.array(columns).reshape(3, EDGE_BIN_COUNT, PIXELS_PER_BIN).mean(axis=-1))


def measure_heads(python_by_version: dict[str, Path]) -> Iterator[JsonObject]:
    """Yield differences in outline and colour between pictures of a bald head by Cycles and dermis.

    There is one result for each Blender version and subsurface method.
    """
    subject = load_subject("human").with_painted_maps(EXPORTED_MAP_SIDE, "auto")
    assert subject.scene is not None
    head = replace(subject.scene.head, hair=None, strands=None)
    bald = replace(subject, scene=replace(subject.scene, head=head))
    ours = render_dermis(bald, HEAD_SIDE)
    for version, python in python_by_version.items():
        for method in METHODS_BY_VERSION[version]:
            pictures = render_cycles(bald, method, version, python, HEAD_SIDE, HEAD_SAMPLES, HEAD_SEEDS)
            results = {"version": version, "method": method, "samples": HEAD_SEEDS * HEAD_SAMPLES}
            results |= compare_pictures(ours, np.stack(pictures))
            print_lines(str(results))
            yield results


def write_hair_picture(python_by_version: dict[str, Path]) -> None:
    """Write a picture that shows a head with hair, rendered by dermis and by each version of Cycles."""
    subject = load_subject("human").with_painted_maps(EXPORTED_MAP_SIDE, "auto")
    columns = [render_dermis(subject, PICTURE_SIDE)]
    for version, python in python_by_version.items():
        method = METHODS_BY_VERSION[version][0]
        columns += render_cycles(subject, method, version, python, PICTURE_SIDE, PICTURE_SAMPLES, 1)
    composite_over_grey = [one[..., :3] + 0.4 * (1.0 - one[..., 3:]) for one in columns]
    levels = encode_srgb(np.clip(np.concatenate(composite_over_grey, axis=1), 0.0, 1.0))
    Image.fromarray(np.rint(255.0 * levels).astype(np.uint8)).save(PICTURE_FILE, quality=88)
