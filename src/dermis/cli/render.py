"""`dermis render`: an image of a head."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from dermis.cli.console import note, print_json, print_lines, working_on
from dermis.cli.options import Json, Whole, parse_colour, parse_size
from dermis.cli.render_scene import assemble
from dermis.specular.models import EnergyName, FresnelName, SpecularName

_MOST_UNSCATTERED = 0.05  # closed eyes and other collapsed charts of real scans stay under it

Output = Annotated[Path, Parameter(name=("--output", "-o"))]


def render(
    head: str = "bust",
    /,
    *,
    output: Output = Path("dermis.png"),
    size: str | None = None,
    atlas: Whole = None,
    samples: Whole = None,
    technique: Literal["texture-space", "none", "one-blur", "gpu-gems-3", "screen-space", "pre-integrated"]
    | None = None,
    transmission: Literal["thin", "none"] | None = None,
    seams: Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"] | None = None,
    stretch: Literal["full", "axes", "none"] | None = None,
    profile: str | None = None,
    albedo: Literal["map", "profile"] | None = None,
    direction: Literal["lambertian", "half-space"] | None = None,
    mix: float | None = None,
    roughness: float | None = None,
    rho_s: float | None = None,
    oiliness: float | None = None,
    regions: str | None = None,
    specular: SpecularName | None = None,
    fresnel: FresnelName | None = None,
    specular_colour: Literal["white", "wrong"] | None = None,
    energy: EnergyName | None = None,
    lights: str | None = None,
    env: str | None = None,
    env_rotation: float | None = None,
    env_exposure: float | None = None,
    env_visible: bool | None = None,
    occlusion: Literal["baked", "none"] | None = None,
    camera: str | None = None,
    exposure: float | None = None,
    bloom: float | None = None,
    tone: Literal["none", "filmic", "neutral"] | None = None,
    gamma: Literal["right", "wrong"] | None = None,
    background: str | None = None,
    colour: Path | None = None,
    normal: Path | None = None,
    height: Path | None = None,
    height_mm: float | None = None,
    specular_map: Path | None = None,
    roughness_map: Path | None = None,
    unit_mm: float | None = None,
    v_origin: Literal["auto", "top", "bottom"] | None = None,
    up: Literal["y", "z"] | None = None,
    normal_y: Literal["up", "down"] | None = None,
    opaque: list[str] | None = None,
    subdivide: Whole = None,
    adapter: str = "auto",
    as_json: Json = False,
) -> int:
    """Render a head to a PNG (sRGB) or EXR (linear float) image.

    Examples:

        dermis render -o face.png

        dermis render lee_perry_smith --camera cheek --technique none -o dry.exr

        dermis render head.obj --unit-mm 100 --colour skin.png --subdivide 1

        dermis render scene.toml --size 1920x1080 --json

    Parameters
    ----------
    head:
        bust, the head that the package makes [the default], a sample (lee_perry_smith), a mesh (.glb .gltf
        .obj .ply) or a scene (.toml).
    output:
        Image to write: .png (sRGB, 8 bit) or .exr (linear Rec. 709, float).
    size:
        Width x height in pixels [1024x1024].
    atlas:
        Side of the irradiance map in texels [2048].
    samples:
        Samples of each pixel's edges [4].
    technique:
        texture-space scatters light below the surface; none is dry skin. Baselines: one-blur, gpu-gems-3 (the
        passes of 2007), and what engines do: screen-space, pre-integrated.
    transmission:
        thin lets light through thin parts such as ears; none takes all for thick [thin].
    seams:
        stitch lets light cross the map's seams; the others are the talk's remedies, for comparison [stitch].
        one-blur and gpu-gems-3 know no stitching: for it they take clear-colour.
    stretch:
        full corrects blurs for the map's stretch and shear; axes takes u and v for at right angles [full].
    profile:
        Diffusion profile: gpu-gems-3 [the default], a medium or skin (dj3, skin1, light ...), a .toml file
        such as `dermis profile -o` writes, or a CSV file with variance_mm2,red,green,blue.
    albedo:
        map: profile made white, colour from the map (the deck). profile: the profile's own colour, no map.
    direction:
        How skin returns light: lambertian alike by all directions, or as a half-space [lambertian].
    mix:
        Share of the colour map applied before scattering, 0 to 1 [0.5].
    roughness:
        Beckmann roughness m of the surface [0.3]; a roughness map replaces it.
    rho_s:
        Strength of the surface reflection [0.18].
    oiliness:
        One dial over both, 0 to 1 for shiny skin; an artist's mapping [0].
    regions:
        Roughness and strength by region of the face: default (an artist's values), or a TOML file.
    specular:
        Model of the surface reflection; none leaves it out [kelemen].
    fresnel:
        schlick, or the exact curve of index 1.4 [schlick].
    specular_colour:
        white; wrong tints the reflection by the colour map, for comparison.
    energy:
        What is reflected does not enter: full; published overstates that as the deck does; none [full].
    lights:
        A rig (studio, window, top, rim, rembrandt, laser, none) or a TOML file with [[lights]]; studio unless
        --env is given.
    env:
        Light from all around: royal_esplanade, lebombo, uniform, or a latitude-longitude .hdr or .exr file.
    env_rotation:
        Turn of the environment about the upward axis [degrees].
    env_exposure:
        Factor of the environment's light [1].
    env_visible:
        Show the environment behind the head, out of focus.
    occlusion:
        baked dims the environment's light where the head is in its way; none does not.
    camera:
        portrait, three-quarter, profile, ear, cheek, or a TOML file with [camera].
    exposure:
        Factor from radiance to the image [1].
    bloom:
        Share of the light that the lens scatters around, 0 to 1 [0].
    tone:
        Curve before the encoding of a PNG: none, filmic, or the Khronos group's neutral [none].
    gamma:
        right; wrong takes the colour map for linear and leaves sRGB out, for comparison only.
    background:
        Linear red,green,blue [0,0,0].
    colour:
        Colour map (sRGB).
    normal:
        Tangent-space normal map.
    height:
        Height map; needs --height-mm.
    height_mm:
        Relief of one grey level of an 8-bit height map [mm].
    specular_map:
        Map of the surface reflection's strength, scaled to a mean of --rho-s.
    roughness_map:
        Map of the roughness m, 0 to 1.
    unit_mm:
        Length of the file's unit [mm]; 1000 for glTF and 1 for others when left out.
    v_origin:
        Which row of the maps v = 0 is; the format's rule when left out.
    up:
        The file's upward axis [y].
    normal_y:
        Way in which green points in the normal map: up (OpenGL) or down (DirectX) [up].
    opaque:
        A group of the file that is not skin; may be given again.
    subdivide:
        Levels of Loop subdivision, 0 to 3 [0].
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    as_json:
        Print one JSON object with the timings of a warm frame.
    """
    given = {name: value for name, value in locals().items() if value is not None}
    started = time.perf_counter()
    from dermis.images.io import check_output

    check_output(output)
    given |= {"size": parse_size(size)} if size is not None else {}
    given |= {"background": parse_colour(background)} if background is not None else {}
    with working_on("loading"):
        scene, settings = assemble(head, given)
    return _draw_and_report(scene, settings, output, adapter, as_json, started)


def _draw_and_report(
    scene: Any, settings: Any, output: Path, adapter: str, as_json: bool, started: float
) -> int:
    from dermis.frame.renderer import Renderer
    from dermis.images.io import write_image, write_png

    with working_on("rendering"):
        renderer = Renderer(adapter)
        rendered = renderer.draw(scene, settings)
        setup_ms = rendered.setup_ms
        if as_json:  # the first frame fills caches; a warm one is timed
            rendered = renderer.draw_warm(scene, settings)
    if settings.technique == "texture-space" and rendered.unscattered > _MOST_UNSCATTERED:
        share = f"{rendered.unscattered:.0%} of the skin's triangles"
        why = "their uv is collapsed, mirrored onto other skin, or thinner than a texel of the atlas"
        note(f"note: {share} are lit without scattering: {why}")
    _note_light(scene, settings, rendered.suns)
    if output.suffix.lower() == ".png":
        write_png(output, rendered.srgb8())
    else:
        write_image(output, rendered.linear())
    report = {
        "image": str(output),
        "adapter": renderer.device.adapter.name,
        "size": list(settings.size),
        "atlas": settings.atlas,
        "gaussians": rendered.gaussians,
        "gpu_ms": rendered.gpu_ms,
        "frame_ms": rendered.frame_ms,
        "setup_ms": setup_ms,
    }
    if as_json:
        print_json(report)
    else:
        seconds = time.perf_counter() - started
        print_lines(f"{output}  {seconds:.1f} s on {report['adapter']}", *_thanks(scene.head.attribution))
    return 0


def _note_light(scene: Any, settings: Any, suns: int) -> None:
    if suns:
        one, name = suns == 1, scene.environment.name
        peaks = "a sun-like peak" if one else f"{suns} sun-like peaks"
        shine = "shines as a light" if one else "shine as lights"
        note(f"note: {peaks} of {name} {shine} with shadows, the rest from all around")
    if settings.gamma == "wrong":
        note("note: --gamma wrong shades encoded colours, which is a mistake: for comparison only")


def _thanks(attribution: str) -> list[str]:
    return [attribution] if attribution else []
