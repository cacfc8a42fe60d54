"""Pictures of one exported head, rendered by dermis, Cycles, Babylon.js and Mitsuba with the same lights.

Hair is omitted, because each program draws it differently. Lights are directional, as on the page that is
exported for Babylon.js.
"""

from __future__ import annotations

import io
import os
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt, maximum_filter

from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.truths.metrics import relative_rmse
from dermis.apps.truths.mitsuba_scene import load_mitsuba, mitsuba_variant
from dermis.apps.validation.engines.babylon import LIBRARY_FOLDER_VARIABLE, babylon_library
from dermis.apps.validation.pages import (
    DOCS,
    RESULTS,
    JsonObject,
    chromium_page,
    require_in_checkout,
    write_results,
)
from dermis.base.console import print_lines
from dermis.frame.renderer import Renderer
from dermis.images.colour import decode_srgb, encode_srgb
from dermis.images.io import read_image
from dermis.scene.lights import DirectionalLight
from dermis.scene.settings import Settings

RESULTS_FILE, PICTURE_FILE = RESULTS / "engines_heads.json", DOCS / "images" / "engines_heads.webp"
EXPORTED_MAP_SIDE, HEAD_PICTURE_SIDE = 1024, 256
CYCLES_SAMPLES, MITSUBA_SAMPLES, SEED_COUNT = 64, 256, 2
HEAD_LIGHTS = (
    DirectionalLight(direction=(0.8, -0.5, -0.7), irradiance=(3.4, 3.3, 3.1)),
    DirectionalLight(direction=(-0.9, -0.2, -0.3), irradiance=(0.8, 0.85, 0.95)),
)
MIN_LIT_FRACTION_OF_MEAN = 0.25  # fraction of the mean light; darker pixels are in shadow
MIN_HIGHLIGHT_RADIANCE = 0.75  # radiance above which a pixel is a highlight; white skin has 1
HIGHLIGHT_WIDTH_PX = 9  # width of the square around a highlight that is excluded
Floats = NDArray[np.float64]


def compare_heads() -> None:
    """Render one head in all installed programs and compare each picture with that of dermis.

    Writes benchmarks/results/engines_heads.json and docs/images/engines_heads.webp. Needs Mitsuba. Other
    programs are found by environment variables: DERMIS_BLENDER_PYTHONS names Python programs that have bpy
    4.5 and 5.2, separated by a comma; DERMIS_BABYLON names a folder into which npm installed babylonjs.
    """
    require_in_checkout(PICTURE_FILE.parent)
    subject = load_subject("human").with_painted_maps(EXPORTED_MAP_SIDE, "auto")
    assert subject.head is not None and subject.scene is not None
    hairless = replace(subject.head, hair=None, strands=None)
    subject = replace(subject, scene=replace(subject.scene, head=hairless, lights=HEAD_LIGHTS))
    ours = render_dermis(subject, HEAD_PICTURE_SIDE)
    columns, rows = [ours], []
    for name, draw in available_renderers(subject, ours).items():
        pictures = np.stack(draw())
        result = {"program": name, **compare_pictures(ours, pictures)}
        print_lines(str(result))
        columns.append(pictures.mean(axis=0))
        rows.append(result)
        write_results(RESULTS_FILE, {"heads": rows}, 4)
    levels = encode_srgb(
        np.clip(np.concatenate([composite_over_grey(one) for one in columns], axis=1), 0.0, 1.0)
    )
    Image.fromarray(np.rint(255.0 * levels).astype(np.uint8)).save(PICTURE_FILE, quality=90)


def available_renderers(subject: Subject, dermis_picture: Floats) -> dict[str, Callable[[], list[Floats]]]:
    """Return a dictionary from the name of each installed program to a function that renders with it.

    The functions return linear pictures (h, w, 4), one per random seed.

    dermis_picture : (h, w, 4) picture rendered by dermis; its alpha is used for programs that render none
    """
    result: dict[str, Callable[[], list[Floats]]] = {}
    named = [one for one in os.environ.get("DERMIS_BLENDER_PYTHONS", "").split(",") if one]
    for version, python in zip(("4.5", "5.2"), named, strict=False):
        result[f"Cycles {version}"] = lambda version=version, python=python: render_cycles(  # type: ignore[misc]
            subject, "random-walk-skin", version, Path(python), HEAD_PICTURE_SIDE, CYCLES_SAMPLES, SEED_COUNT
        )
    if os.environ.get(LIBRARY_FOLDER_VARIABLE):
        library = babylon_library()
        result["Babylon.js 9.28"] = lambda: [render_babylon(subject, library, dermis_picture)] * 2
    result["Mitsuba 3"] = lambda: render_mitsuba(subject, dermis_picture)
    return result


def render_babylon(subject: Subject, library_folder: Path, dermis_picture: Floats) -> Floats:
    """Return the linear picture (h, w, 4) that Babylon.js renders in the exported page, in Chromium.

    dermis_picture : (h, w, 4) picture rendered by dermis; its alpha is copied to the result, except where
        Babylon.js draws nothing
    """
    with TemporaryDirectory() as folder_name, chromium_page(HEAD_PICTURE_SIDE) as page:
        file = Path(folder_name) / "head.html"
        export_skin(subject, "babylon", file, library=library_folder)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-state]", state="attached", timeout=240_000)
        page.evaluate("document.querySelectorAll('body > :not(canvas)').forEach((one) => one.remove())")
        canvas = Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB")
    light = decode_srgb(np.asarray(canvas) / 255.0)
    return np.dstack([light, np.where(light.any(axis=-1), dermis_picture[..., 3], 0.0)])


def render_mitsuba(subject: Subject, dermis_picture: Floats) -> list[Floats]:
    """Return linear pictures (h, w, 4) of the exported scene rendered by Mitsuba, one per random seed.

    dermis_picture : (h, w, 4) picture rendered by dermis; its alpha is copied to the results
    """
    mi = load_mitsuba()
    with TemporaryDirectory() as folder_name, mitsuba_variant(mi, "scalar_rgb"):
        folder = Path(folder_name) / "head"
        export_skin(subject, "mitsuba", folder)
        scene = mi.load_file(
            str(folder / "scene.xml"),
            width=HEAD_PICTURE_SIDE,
            height=HEAD_PICTURE_SIDE,
            samples=MITSUBA_SAMPLES,
        )
        frames = [np.array(mi.render(scene, seed=k, spp=MITSUBA_SAMPLES))[..., :3] for k in range(SEED_COUNT)]
    return [np.dstack([one, dermis_picture[..., 3]]).astype(np.float64) for one in frames]


def composite_over_grey(picture: Floats) -> Floats:
    """Return a picture (h, w, 4) composited over a grey background, (h, w, 3)."""
    return np.asarray(picture[..., :3] * (picture[..., 3:] > 0) + 0.05 * (1.0 - picture[..., 3:]))


def render_dermis(subject: Subject, picture_side: int) -> Floats:
    """Return the linear picture (h, w, 4) of the subject rendered by dermis."""
    assert subject.scene is not None
    settings = Settings(size=(picture_side, picture_side), atlas=EXPORTED_MAP_SIDE, samples=16)
    return np.asarray(Renderer().draw(subject.scene, settings).linear_rgba(), np.float64)


def render_cycles(
    subject: Subject,
    subsurface_method: str,
    blender_version: str,
    python_program: Path,
    picture_side: int,
    samples: int,
    seed_count: int,
) -> list[Floats]:
    """Return linear pictures (h, w, 4) of the exported scene rendered by Cycles, one per random seed.

    subsurface_method : name of a variant of the export target "blender"
    python_program : Python program that has Blender's module bpy
    """
    with TemporaryDirectory() as folder_name:
        folder = Path(folder_name) / "head"
        export_skin(subject, "blender", folder, version=blender_version, variant=subsurface_method)
        script = folder / "skin.py"
        text = script.read_text(encoding="utf-8")
        script.write_text(
            text.replace("'size': [1024, 1024]", f"'size': [{picture_side}, {picture_side}]"),
            encoding="utf-8",
        )
        result = []
        for seed in range(seed_count):
            picture = folder / f"{seed}.exr"
            options = ["--render", str(picture), "--samples", str(samples), "--seed", str(seed)]
            command = [str(python_program), "-I", str(script), "--", *options]
            subprocess.run(command, check=True, capture_output=True)
            result.append(read_image(picture).astype(np.float64))
    return result


def compare_pictures(dermis_picture: Floats, other_pictures: Floats) -> JsonObject:
    """Return the differences in outline and colour between pictures by dermis and by another program.

    dermis_picture : (h, w, 4) picture rendered by dermis
    other_pictures : (n, h, w, 4) pictures rendered by the other program with n different random seeds
    """
    mean, variance = other_pictures.mean(axis=0), other_pictures.var(axis=0, ddof=1) / len(other_pictures)
    a, b = dermis_picture[..., 3] > 0.5, mean[..., 3] > 0.5
    outline_distance = max(distance_transform_edt(~b)[a].max(), distance_transform_edt(~a)[b].max())
    covered = (dermis_picture[..., 3] > 0.999) & (mean[..., 3] > 0.999)
    light = dermis_picture[..., :3].mean(axis=-1)
    lit = covered & (light > MIN_LIT_FRACTION_OF_MEAN * light[covered].mean())
    bright = np.maximum(dermis_picture[..., :3], mean[..., :3]).max(axis=-1) > MIN_HIGHLIGHT_RADIANCE
    matte = covered & ~maximum_filter(bright, HIGHLIGHT_WIDTH_PX)
    errors = [
        relative_rmse(dermis_picture[..., :3], mean[..., :3], on, variance[..., :3])
        for on in (covered, matte)
    ]
    return {
        "side": dermis_picture.shape[0],
        "outline_px": float(outline_distance),
        "pixels_apart": int((a != b).sum()),
        "pixels": int(a.sum()),
        "lit_colour": (mean[lit][:, :3].mean(axis=0) / dermis_picture[lit][:, :3].mean(axis=0))
        .round(4)
        .tolist(),
        "relative_rmse": round(float(errors[0].value), 4),
        "without_highlights": round(float(errors[1].value), 4),
        "share_without_highlights": round(float(matte.sum() / covered.sum()), 4),
    }
