"""`dermis render`: an image of a head."""

from __future__ import annotations

import contextlib
import gc
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.console import note, print_report, working_on
from dermis.cli.options import Adapter, OutputPath, Json
from dermis.cli.output_options import Format, FrameLandmarks, FrameOutputs, Landmarks, Outputs
from dermis.cli.scene_options import DEFAULTS, SceneOptions, assemble_scene, note_subdivision
from dermis.scene.techniques import TECHNIQUES

if TYPE_CHECKING:
    from dermis.frame.features.outputs.planes import PlaneArray
    from dermis.frame.rendered import Rendered
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings

_MAX_UNSCATTERED = 0.05  # closed eyes and other collapsed charts of real scans stay under it

_MAX_CLIPPED = 0.02


def render(
    head: str = "human",
    /,
    *,
    output: OutputPath = Path("dermis.png"),
    scene: SceneOptions = DEFAULTS,
    outputs: Outputs = None,
    outputs_format: Format = None,
    landmarks: Landmarks = None,
    adapter: Adapter = "auto",
    as_json: Json = False,
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

    Parameters
    ----------
    head:
        human, the head of the package, human:7, a person by seed, or a person's numbers (.json); a sample
        (lee_perry_smith), a mesh (.glb .gltf .obj .ply) or a scene (.toml).
    output:
        Image to write: .png (sRGB, 8 bit) or .exr (linear Rec. 709, float); with --background none it has
        alpha.
    as_json:
        Print one JSON object with the timings of a warm frame.
    """
    started = time.perf_counter()
    from dermis.images.io import check_output

    check_output(output)
    more = FrameOutputs(outputs, outputs_format, output)
    marked = FrameLandmarks(landmarks, output)
    from dermis.frame.renderer import Renderer
    from dermis.gpu.memory import check_drivers

    check_drivers()  # before the head, which takes memory too
    with _gc_disabled(), ThreadPoolExecutor(1) as beside:
        opening = beside.submit(Renderer, adapter)  # its driver starts and compiles while the head loads
        with working_on("loading"):
            described, settings = assemble_scene(head, scene)
            marked.check(described.head)
        note_subdivision(head, scene, described.head)
        with working_on("rendering"):
            renderer = opening.result()
            rendered = renderer.draw(described, settings, outputs=more.names)
            values = {name: rendered.output(name) for name in more.names}
            setup_ms = rendered.setup_ms
            if as_json:  # the first frame fills caches; a warm one is timed
                rendered = renderer.draw_warm(described, settings)
        _note_light(described, settings, rendered)
        _write(rendered, output, more, values)
        _note_clipped(rendered)
        marked.write(renderer, described, settings)
    report = {
        "image": str(output),
        **({"outputs": more.report} if more.names else {}),
        **({"landmarks": str(marked.path)} if marked.names else {}),
        "adapter": renderer.device.adapter.name,
        "size": list(settings.size),
        "atlas": settings.atlas,
        "subdivide": described.head.levels,
        "triangles": len(described.head.mesh.triangles),
        "exposure": rendered.exposure,
        "gaussians": rendered.gaussians,
        "gpu_ms": rendered.gpu_ms,
        "frame_ms": rendered.frame_ms,
        "setup_ms": setup_ms,
    }
    said = f"{output}  {time.perf_counter() - started:.1f} s on {report['adapter']}"
    print_report(as_json, report, lambda: [said, *filter(None, [described.head.attribution])])
    return 0


@contextlib.contextmanager
def _gc_disabled() -> Iterator[None]:
    """Disable garbage collection: one picture leaves little, and a collection scans all libraries."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _write(rendered: Rendered, output: Path, more: FrameOutputs, values: Mapping[str, PlaneArray]) -> None:
    """Write the image, and the outputs in it or beside it."""
    from dermis.images.io import write_image, write_png

    linear, with_alpha = None, rendered.settings.background == "none"
    if output.suffix.lower() == ".png":
        write_png(output, rendered.rgba8() if with_alpha else rendered.srgb8())
    else:
        linear = rendered.linear_rgba() if with_alpha else rendered.linear()
        if not (more.names and more.together):
            write_image(output, linear)
    if more.names:
        more.write(linear, values)


def _note_light(scene: Scene, settings: Settings, rendered: Rendered) -> None:
    """Print notes about light that is not as one may expect."""
    technique, suns = TECHNIQUES[settings.technique], rendered.suns
    if technique.on_atlas and technique.stitches and rendered.unscattered > _MAX_UNSCATTERED:
        share = f"{rendered.unscattered:.0%} of the skin's triangles"
        why = "their uv is collapsed, mirrored onto other skin, or thinner than a texel of the atlas"
        note(f"note: {share} are lit without scattering: {why}")
    if suns and scene.environment:
        peaks = "a sun-like peak" if suns == 1 else f"{suns} sun-like peaks"
        shine = "shines as a light" if suns == 1 else "shine as lights"
        note(f"note: {peaks} of {scene.environment.name} {shine} with shadows, the rest from all around")
    if settings.gamma == "wrong":
        note("note: --gamma wrong shades encoded colours, which is a mistake: for comparison only")


def _note_clipped(rendered: Rendered) -> None:
    if (share := rendered.clipped()) > _MAX_CLIPPED:
        remedy = f"take less than --exposure {rendered.exposure:.3g}, or --tone neutral"
        note(f"note: {share:.0%} of the head is brighter than the picture can show: {remedy}")
