"""Skin exported to Blender, measured in Cycles itself: writes benchmarks/results/engines_blender.json.

    python benchmarks/engines_blender.py PYTHON_OF_4.5 PYTHON_OF_5.2 [edges|heads|picture]   # half an hour

Each PYTHON is one with the module bpy of that version. A part that is named is measured alone, and the others
stay as they were written.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from engines_blender_head import heads, picture

from dermis.apps.export.fitting import deviation, fit_d
from dermis.apps.export.subject import subject_of
from dermis.apps.export.targets.blender.target import TARGET
from dermis.apps.truths.blender_process import Errand, run_blender

RESULTS = Path(__file__).with_name("results") / "engines_blender.json"
SCRIPT = Path(__file__).with_name("engines_blender_script.py")
SKINS = "skin1", "skin2", "dj3"
METHODS = "random-walk-skin", "random-walk", "burley"
BINS, EACH, ROWS = 12, 8, 8  # from -6 d to 6 d; columns of pixels in each, and rows of them
SAMPLES = {"burley": 512}
USUAL_SAMPLES = 1024
SEEDS = 2  # pictures of each channel, whose difference tells the noise
ERRAND = Errand("Cycles", "to render a half-lit plane", "See what it said")


def main() -> None:
    """Measure with both and write the results."""
    pythons = {version: Path(path) for version, path in zip(("4.5", "5.2"), sys.argv[1:3], strict=True)}
    parts = sys.argv[3:] or ["edges", "heads", "picture"]
    found: dict[str, Any] = json.loads(RESULTS.read_text("utf-8")) if RESULTS.exists() else {}
    found["columns_in_d"] = columns().reshape(BINS, EACH).mean(axis=1).tolist()
    if "edges" in parts:
        found["edges"] = list(edges(pythons))
        save(found)
    if "heads" in parts:
        found["heads"] = list(heads(pythons))
        save(found)
    if "picture" in parts:
        picture(pythons)


def save(found: dict[str, Any]) -> None:
    RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def edges(pythons: dict[str, Path]) -> Iterator[dict[str, Any]]:
    """The edge response of each skin by each method in each version."""
    for version, python in pythons.items():
        for method in METHODS:
            for name in SKINS:
                yield edge(python, version, method, name)
                print(version, method, name, flush=True)  # noqa: T201


def columns() -> np.ndarray[Any, Any]:
    """(BINS EACH,) distances of columns of pixels from the edge, in d."""
    return 12.0 * (np.arange(BINS * EACH) + 0.5) / (BINS * EACH) - 6.0


def edge(python: Path, version: str, method: str, name: str) -> dict[str, Any]:
    """Of one skin: what was measured, what the twin says and what is true."""
    subject, target = subject_of(name), TARGET.with_variant(method)
    rows, d = target.parameters(subject, version), fit_d(subject.curve)
    shown = target.shown(rows, subject, version)
    typed = target.shown(target.naive(subject, version), subject, version)
    samples = SAMPLES.get(method, USUAL_SAMPLES)
    passes = [
        {"channel": c, "width_m": 12e-3 * d[c], "size": [BINS * EACH, ROWS], "samples": samples, "seed": k}
        for k in range(SEEDS)
        for c in range(3)
    ]
    with TemporaryDirectory() as place:
        folder = Path(place)
        target.write(subject, rows, folder, version)
        (folder / "passes.json").write_text(json.dumps(passes), encoding="utf-8")
        run_blender(python, SCRIPT, [str(folder)], 3600.0, ERRAND)
        done = json.loads((folder / "done.json").read_text(encoding="utf-8"))
    seen = np.array([[done["columns"][3 * k + c] for c in range(3)] for k in range(SEEDS)])[..., 0]
    means = seen.reshape(SEEDS, 3, BINS, EACH).mean(axis=-1)
    wanted, true = (binned(curve, d) for curve in (shown, subject.curve))
    lit = (means.mean(axis=0) * wanted).sum(axis=1) / (wanted**2).sum(axis=1)
    measured = means.mean(axis=0) / lit[:, None]
    noise = np.abs(means[0] - means[1]) / (2.0 * lit[:, None])
    return {
        "version": done["version"],
        "method": method,
        "skin": name,
        "samples": SEEDS * EACH * ROWS * samples,
        "d_mm": d.round(4).tolist(),
        "measured": measured.round(4).tolist(),
        "predicted": wanted.round(4).tolist(),
        "against_predicted": np.abs(measured - wanted).max(axis=1).round(4).tolist(),
        "against_true": np.abs(measured - true).max(axis=1).round(4).tolist(),
        "noise": np.sqrt((noise**2).mean(axis=1)).round(4).tolist(),
        "energy": (np.pi * lit / subject.curve.energy).round(4).tolist(),
        "typed_in": deviation(subject.curve, typed).edge.round(4).tolist(),
        "predicted_energy": (shown.energy / subject.curve.energy).round(4).tolist(),
    }


def binned(curve: Any, d_mm: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """(3, BINS) edge response of a curve, averaged as the columns are."""
    each = [curve.edge(columns() * d_mm[c])[:, c].reshape(BINS, EACH).mean(axis=1) for c in range(3)]
    return np.array(each)


if __name__ == "__main__":
    main()
