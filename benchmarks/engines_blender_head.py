"""The exported head in Cycles beside ours, with the same camera and lights."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt, maximum_filter

from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, painted, subject_of
from dermis.apps.truths.metrics import relative_rmse
from dermis.frame.renderer import Renderer
from dermis.images.colour import encode_srgb
from dermis.images.io import read_image
from dermis.scene.settings import Settings

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "engines_blender.webp"
TEXELS = 1024
SIDE, SAMPLES, SEEDS = 192, 32, 2
SHOWN, SHOWN_SAMPLES = 320, 48
METHODS = {"4.5": ("random-walk-skin",), "5.2": ("random-walk-skin", "random-walk", "burley")}
LIT = 0.25  # of the mean: what is darker lies in shadow
BRIGHT, GROWN = 0.75, 9  # radiance of highlights, white skin being 1, and pixels across that they spoil
Floats = np.ndarray[Any, Any]


def heads(pythons: dict[str, Path]) -> Iterator[dict[str, Any]]:
    """Without hair, which both draw by other means: outlines and colours of each method and version."""
    subject = painted(subject_of("human"), TEXELS, "auto")
    assert subject.head is not None
    bald = subject.with_head(replace(subject.head, hair=None, strands=None))
    ours = drawn(bald, SIDE)
    for version, python in pythons.items():
        for method in METHODS[version]:
            pictures = rendered(bald, method, version, python, SIDE, SAMPLES, SEEDS)
            found = {"version": version, "method": method, **compared(ours, np.stack(pictures))}
            print(found, flush=True)  # noqa: T201
            yield found


def drawn(subject: Subject, side: int) -> Floats:
    """(h, w, 4) ours, linear."""
    assert subject.scene is not None
    settings = Settings(size=(side, side), atlas=TEXELS, samples=16)
    return np.asarray(Renderer().draw(subject.scene, settings).linear_rgba(), np.float64)


def rendered(
    subject: Subject, method: str, version: str, python: Path, side: int, samples: int, seeds: int
) -> list[Floats]:
    """(h, w, 4) theirs, linear, by as many seeds."""
    with TemporaryDirectory() as place:
        folder = Path(place) / "head"
        export_skin(subject, "blender", folder, version=version, variant=method)
        script = folder / "skin.py"
        text = script.read_text(encoding="utf-8")
        script.write_text(text.replace("'size': [1024, 1024]", f"'size': [{side}, {side}]"), encoding="utf-8")
        found = []
        for seed in range(seeds):
            picture = folder / f"{seed}.exr"
            words = ["--render", str(picture), "--samples", str(samples), "--seed", str(seed)]
            command = [str(python), "-I", str(script), "--", *words]
            subprocess.run(command, check=True, capture_output=True)
            found.append(read_image(picture).astype(np.float64))
    return found


def compared(ours: Floats, theirs: Floats) -> dict[str, Any]:
    """theirs : (seeds, h, w, 4)"""
    mean, variance = theirs.mean(axis=0), theirs.var(axis=0, ddof=1) / len(theirs)
    a, b = ours[..., 3] > 0.5, mean[..., 3] > 0.5
    apart = max(distance_transform_edt(~b)[a].max(), distance_transform_edt(~a)[b].max())
    whole = (ours[..., 3] > 0.999) & (mean[..., 3] > 0.999)
    light = ours[..., :3].mean(axis=-1)
    lit = whole & (light > LIT * light[whole].mean())
    bright = (ours[..., :3].max(axis=-1) > BRIGHT) | (mean[..., :3].max(axis=-1) > BRIGHT)
    matte = whole & ~maximum_filter(bright, GROWN)
    errors = [relative_rmse(ours[..., :3], mean[..., :3], on, variance[..., :3]) for on in (whole, matte)]
    return {
        "side": ours.shape[0],
        "samples": SEEDS * SAMPLES,
        "outline_px": float(apart),
        "pixels_apart": int((a != b).sum()),
        "pixels": int(a.sum()),
        "lit_colour": (mean[lit][:, :3].mean(axis=0) / ours[lit][:, :3].mean(axis=0)).round(4).tolist(),
        "relative_rmse": round(float(errors[0].value), 4),
        "without_highlights": round(float(errors[1].value), 4),
        "share_without_highlights": round(float(matte.sum() / whole.sum()), 4),
    }


def picture(pythons: dict[str, Path]) -> None:
    """Ours beside Cycles of each version, with hair."""
    subject = painted(subject_of("human"), TEXELS, "auto")
    seen = [drawn(subject, SHOWN)]
    for version, python in pythons.items():
        seen += rendered(subject, METHODS[version][0], version, python, SHOWN, SHOWN_SAMPLES, 1)
    shown = [one[..., :3] + 0.4 * (1.0 - one[..., 3:]) for one in seen]
    levels = encode_srgb(np.clip(np.concatenate(shown, axis=1), 0.0, 1.0))
    Image.fromarray(np.rint(255.0 * levels).astype(np.uint8)).save(PICTURE, quality=88)
