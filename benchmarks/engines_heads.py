"""One head, camera and parallel lights in dermis, Cycles, Babylon.js and Mitsuba: pictures beside each other.

    DERMIS_BABYLON=node_modules DERMIS_BLENDER_PYTHONS=bpy45/bin/python,bpy52/bin/python \\
        python benchmarks/engines_heads.py

writes `benchmarks/results/engines_heads.json` and `docs/images/engines_heads.webp`. Hair is left out, which
all of them draw by other means. Lights are parallel, as Babylon's page has them.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from engines_blender_head import compared, drawn, rendered
from figures_file import write_figures
from PIL import Image

from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, painted, subject_of
from dermis.images.colour import decode_srgb, encode_srgb
from dermis.scene.lights import DirectionalLight

HERE = Path(__file__).parent
RESULT = HERE / "results" / "engines_heads.json"
PICTURE = HERE.parent / "docs" / "images" / "engines_heads.webp"
TEXELS, SIDE = 1024, 256
CYCLES_SAMPLES, MITSUBA_SAMPLES, PASSES = 64, 256, 2
LIGHTS = (
    DirectionalLight(direction=(0.8, -0.5, -0.7), irradiance=(3.4, 3.3, 3.1)),
    DirectionalLight(direction=(-0.9, -0.2, -0.3), irradiance=(0.8, 0.85, 0.95)),
)
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
Floats = np.ndarray[Any, Any]


def main() -> int:
    """Draw all, compare each with ours, and put them beside each other."""
    subject = painted(subject_of("human"), TEXELS, "auto")
    assert subject.head is not None and subject.scene is not None
    bald = replace(subject.head, hair=None, strands=None)
    subject = replace(subject, scene=replace(subject.scene, head=bald, lights=LIGHTS))
    ours = drawn(subject, SIDE)
    shown, told = [ours], []
    for name, draw in programs(subject, ours).items():
        pictures = np.stack(draw())
        found = {"program": name, **compared(ours, pictures)}
        print(found, flush=True)  # noqa: T201
        shown.append(pictures.mean(axis=0))
        told.append(found)
        write_figures(RESULT, {"heads": told}, 4)
    levels = encode_srgb(np.clip(np.concatenate([on_grey(one) for one in shown], axis=1), 0.0, 1.0))
    Image.fromarray(np.rint(255.0 * levels).astype(np.uint8)).save(PICTURE, quality=90)
    return 0


def programs(subject: Subject, ours: Floats) -> dict[str, Callable[[], list[Floats]]]:
    """Those that are here, and how each draws (h, w, 4) linear pictures, some of path tracers."""
    found: dict[str, Callable[[], list[Floats]]] = {}
    named = [one for one in os.environ.get("DERMIS_BLENDER_PYTHONS", "").split(",") if one]
    for version, python in zip(("4.5", "5.2"), named, strict=False):
        found[f"Cycles {version}"] = lambda version=version, python=python: rendered(  # type: ignore[misc]
            subject, "random-walk-skin", version, Path(python), SIDE, CYCLES_SAMPLES, PASSES
        )
    if library := os.environ.get("DERMIS_BABYLON"):
        found["Babylon.js 9.28"] = lambda: [in_babylon(subject, Path(library), ours)] * 2
    found["Mitsuba 3"] = lambda: in_mitsuba(subject, ours)
    return found


def in_babylon(subject: Subject, library: Path, ours: Floats) -> Floats:
    """The exported page's canvas in Chromium, by its own levels; where the head is, as ours says."""
    from playwright.sync_api import sync_playwright

    with TemporaryDirectory() as place, sync_playwright() as play:
        file = Path(place) / "head.html"
        export_skin(subject, "babylon", file, library=library)
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
        page = browser.new_page(viewport={"width": SIDE, "height": SIDE}, offline=True)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-state]", state="attached", timeout=240_000)
        page.evaluate("document.querySelectorAll('body > :not(canvas)').forEach((one) => one.remove())")
        seen = Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB")
        browser.close()
    light = decode_srgb(np.asarray(seen) / 255.0)
    return np.dstack([light, np.where(light.any(axis=-1), ours[..., 3], 0.0)])


def in_mitsuba(subject: Subject, ours: Floats) -> list[Floats]:
    """The exported scene by several seeds; where the head is, as ours says."""
    from dermis.apps.truths.mitsuba_scene import load_mitsuba, variant_of

    mi = load_mitsuba()
    with TemporaryDirectory() as place, variant_of(mi, "scalar_rgb"):
        folder = Path(place) / "head"
        export_skin(subject, "mitsuba", folder)
        scene = mi.load_file(str(folder / "scene.xml"), width=SIDE, height=SIDE, samples=MITSUBA_SAMPLES)
        seen = [np.array(mi.render(scene, seed=k, spp=MITSUBA_SAMPLES))[..., :3] for k in range(PASSES)]
    return [np.dstack([one, ours[..., 3]]).astype(np.float64) for one in seen]


def on_grey(picture: Floats) -> Floats:
    """Before a grey wall; picture : (h, w, 4) over black."""
    return np.asarray(picture[..., :3] * (picture[..., 3:] > 0) + 0.05 * (1.0 - picture[..., 3:]))


if __name__ == "__main__":
    sys.exit(main())
