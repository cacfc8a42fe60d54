"""The command `dermis render`: an image of a head."""

from __future__ import annotations

import contextlib
import gc
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.console import print_note, print_report, spinner
from dermis.cli.options import AdapterOption, JsonOption, OutputPath
from dermis.cli.output_options import (
    FrameLandmarks,
    FrameOutputs,
    LandmarksOption,
    OutputsFormatOption,
    OutputsOption,
)
from dermis.cli.scene_options import (
    DEFAULT_SCENE_OPTIONS,
    SceneOptions,
    assemble_scene,
    note_subdivision,
    shrink_atlas_on_cpu,
)
from dermis.cli.spectral_options import NO_SPECTRA, SpectralOptions
from dermis.scene.techniques import TECHNIQUES

if TYPE_CHECKING:
    from dermis.frame.features.outputs.output_images import OutputArray
    from dermis.frame.rendered_frame import RenderedFrame
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings

_MAX_UNSCATTERED_FRACTION = 0.05
"""Largest fraction of the skin's triangles that may be lit without scattering before a note says so.

Closed eyes and other collapsed charts of scans stay below it.
"""
_MAX_CLIPPED_FRACTION = 0.02
"""Largest fraction of the head's pixels that may be overexposed before a note says so."""


def render(
    head: str = "human",
    /,
    *,
    output: OutputPath = Path("dermis.png"),
    scene: SceneOptions = DEFAULT_SCENE_OPTIONS,
    spectra: SpectralOptions = NO_SPECTRA,
    outputs: OutputsOption = None,
    outputs_format: OutputsFormatOption = None,
    landmarks: LandmarksOption = None,
    adapter: AdapterOption = "auto",
    as_json: JsonOption = False,
) -> int:
    """Render a head to a PNG (sRGB) or EXR (linear float) image.

    Examples:

        dermis render -o face.png

        dermis render lee_perry_smith --camera cheek --technique none -o dry.exr

        dermis render head.obj --unit-mm 100 --colour skin.png --opaque teeth

        dermis render --pose mouthSmileLeft=1,mouthSmileRight=1 --bone head=0,20,0 -o smile.png

        dermis render face.glb --pose jawOpen=0.6,mouthSmileLeft=1 --bone head=0,25,0 -o face.png

        dermis render scene.toml --size 1920x1080 --json

        dermis render --outputs depth,normal,uv -o face.exr

        dermis render human:7 --outputs label --landmarks ibug-68 -o face.png

        dermis render human --spectral 31 --light-spectrum FL11 -o cube.exr

        dermis render human --polarisation cross -o cross.png

    Parameters
    ----------
    head:
        human (the head of the package), human:SEED (a random person, dressed by chance), human:SEED?bare (the
        same person with bare shoulders), a person (.json), a sample (lee_perry_smith), a mesh (.glb .gltf
        .vrm .usdz .obj .ply .stl) or a scene (.toml).
    output:
        Image to write: .png (sRGB, 8 bit) or .exr (linear Rec. 709, float); it has alpha if --background is
        none.
    as_json:
        Print one JSON object with timings, measured on a second frame after the first has filled the caches.
    """
    started = time.perf_counter()
    from dermis.images.io import check_output

    check_output(output)
    frame_outputs = FrameOutputs(outputs, outputs_format, output)
    landmark_output = FrameLandmarks(landmarks, output)
    spectra.check(output, scene.settings, outputs is not None, as_json)
    from dermis.frame.renderer import Renderer
    from dermis.gpu.memory import check_driver_address_space

    check_driver_address_space()  # before the head is loaded, which needs memory too
    with _disable_garbage_collection(), ThreadPoolExecutor(1) as pool:
        future = pool.submit(Renderer, adapter)  # the driver starts and compiles while the head is loaded
        with spinner("loading"):
            loaded_scene, settings = assemble_scene(head, scene, looks_at_camera=True)
            landmark_output.check_landmark_sets(loaded_scene.head)
        note_subdivision(head, scene, loaded_scene.head)
        with spinner("rendering"):
            renderer = future.result()
            settings = shrink_atlas_on_cpu(loaded_scene, settings, renderer.device.adapter.kind)
            if spectra.are_given:
                lines = spectra.render(renderer, loaded_scene, settings, output)
                landmark_output.write(renderer, loaded_scene, settings)
                summary = f"{output}  {time.perf_counter() - started:.1f} s on {renderer.device.adapter.name}"
                attribution = [loaded_scene.head.attribution]
                print_report(False, {}, lambda: [summary, *lines, *filter(None, attribution)])
                return 0
            rendered = renderer.draw(loaded_scene, settings, timed=False, outputs=frame_outputs.names)
            values = {name: rendered.output(name) for name in frame_outputs.names}
            setup_ms = rendered.setup_ms
            if as_json:  # time a second frame, because the first one fills the caches
                rendered = renderer.draw_after_warm_up(loaded_scene, settings)
        _note_lighting_problems(loaded_scene, settings, rendered)
        _write_images(rendered, output, frame_outputs, values)
        _note_overexposure(rendered)
        landmark_output.write(renderer, loaded_scene, settings)
    report = {
        "image": str(output),
        **({"outputs": frame_outputs.written_paths} if frame_outputs.names else {}),
        **({"landmarks": str(landmark_output.path)} if landmark_output.names else {}),
        "adapter": renderer.device.adapter.name,
        "size": list(settings.size),
        "atlas": settings.atlas,
        "subdivide": loaded_scene.head.levels,
        "triangles": len(loaded_scene.head.mesh.triangles),
        "exposure": rendered.exposure,
        "gaussians": rendered.gaussians,
        "gpu_ms": rendered.gpu_ms,
        "frame_ms": rendered.frame_ms,
        "setup_ms": setup_ms,
    }
    summary = f"{output}  {time.perf_counter() - started:.1f} s on {report['adapter']}"
    print_report(as_json, report, lambda: [summary, *filter(None, [loaded_scene.head.attribution])])
    return 0


@contextlib.contextmanager
def _disable_garbage_collection() -> Iterator[None]:
    """Disable garbage collection in a with block; collections would free little memory during one render."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _write_images(
    rendered_frame: RenderedFrame,
    output: Path,
    frame_outputs: FrameOutputs,
    output_values: Mapping[str, OutputArray],
) -> None:
    """Write the image file and the requested outputs, which may share the image's EXR file.

    output_values : dictionary from output names to pixel arrays
    """
    from dermis.images.io import write_image, write_png

    linear, with_alpha = None, rendered_frame.settings.background == "none"
    if output.suffix.lower() == ".png":
        write_png(output, rendered_frame.rgba8() if with_alpha else rendered_frame.srgb8())
    else:
        linear = rendered_frame.linear_rgba() if with_alpha else rendered_frame.linear()
        if not (frame_outputs.names and frame_outputs.in_image_file):
            write_image(output, linear)
    if frame_outputs.names:
        frame_outputs.write(linear, output_values)


def _note_lighting_problems(scene: Scene, settings: Settings, rendered_frame: RenderedFrame) -> None:
    """Print notes on stderr about lighting that may surprise users.

    The notes concern skin triangles that are lit without scattering, sun-like peaks of the environment, and
    the setting gamma "wrong".
    """
    technique, suns = TECHNIQUES[settings.technique], rendered_frame.suns
    if (
        technique.uses_atlas
        and technique.stitches_seams
        and rendered_frame.unscattered_fraction > _MAX_UNSCATTERED_FRACTION
    ):
        fraction = f"{rendered_frame.unscattered_fraction:.0%} of the skin's triangles"
        reason = "their uv is collapsed, mirrored onto other skin, or thinner than a texel of the atlas"
        print_note(f"note: {fraction} are lit without scattering: {reason}")
    if suns and scene.environment:
        peaks = "a sun-like peak" if suns == 1 else f"{suns} sun-like peaks"
        effect = "is rendered as a light" if suns == 1 else "are rendered as lights"
        print_note(f"note: {peaks} of {scene.environment.name} {effect} with shadows")
    if settings.gamma == "wrong":
        print_note("note: --gamma wrong computes light with encoded colours, an error, for comparison only")


def _note_overexposure(rendered_frame: RenderedFrame) -> None:
    if (fraction := rendered_frame.clipped_fraction()) > _MAX_CLIPPED_FRACTION:
        advice = f"use less than --exposure {rendered_frame.exposure:.3g}, or --tone neutral"
        print_note(f"note: {fraction:.0%} of the head is overexposed: {advice}")
