"""Highlights and skins rendered by dermis, compared with renderings by Cycles for docs/accuracy.md.

The comparisons need Blender's Python. The page therefore shows stored results from benchmarks/results.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import dermis
from dermis.apps.truths.cycles import BeckmannSurface, PrincipledSkin, cycles_passes
from dermis.apps.validation.accuracy.person import sheet_bytes
from dermis.apps.validation.pages import DOCS, RESULTS, read_results, require_in_checkout, write_results
from dermis.atlas.build import build_atlas
from dermis.base.console import print_lines
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.optics.profiles import load_profile
from dermis.scene import Scene, Settings, Skin, load_camera
from dermis.scene.camera import CAMERA_PRESETS
from dermis.scene.lights import PointLight
from dermis.specular.two_lobe import NARROW_FACTOR, NARROW_WEIGHT, WIDE_FACTOR

HIGHLIGHT_RESULTS, SKIN_COMPARISON_RESULTS = RESULTS / "highlights.json", RESULTS / "look.json"
SKIN_COMPARISON_PICTURE = DOCS / "images" / "look.webp"
LOBE_MODELS = ("torrance-sparrow-smith", "kelemen", "two-lobe")
HIGHLIGHT_VIEWS = ("cheek", "portrait")
SKIN_ROUGHNESS, HIGHLIGHT_PATH_COUNT = 0.3, 64
KEY_LIGHT = PointLight(position=(-300, 250, 600), irradiance=(3, 3, 3))
ONE_LOBE = ((1.0, SKIN_ROUGHNESS),)
TWO_LOBES = (
    (NARROW_WEIGHT, NARROW_FACTOR * SKIN_ROUGHNESS),
    (1.0 - NARROW_WEIGHT, WIDE_FACTOR * SKIN_ROUGHNESS),
)
LIT_QUANTILE = 0.6  # quantile of brightness above which lit pixels are compared
GRAIN_BLUR_PX = 6.0  # standard deviation of the blur that removes the grain [pixel]

HEAD_NAMES = {"scan": "lee_perry_smith", "human": "human"}
SKIN_COMPARISON_VIEWS = ("portrait", "three-quarter", "cheek", "profile")
SKIN_COMPARISON_COLUMNS = ("deck-2007", "default", "Cycles")
SKIN_COMPARISON_SIDE, SURFACE_PATH_COUNT, MAX_MAP_SIDE = 256, 16, 1024

Picture = NDArray[np.float32]


class HighlightRow(TypedDict):
    """Comparison of a reflection model's highlights with those of Cycles.

    view : camera preset
    model : model of surface reflection
    energy : light reflected in the picture by dermis, divided by the light reflected in that by Cycles [-]
    grain : contrast of fine detail in the picture rendered by dermis [-]
    grain_of_cycles : contrast of fine detail in the picture rendered by Cycles [-]
    correlation : correlation of the two pictures in bright pixels [-]
    """

    view: str
    model: str
    energy: float
    grain: float
    grain_of_cycles: float
    correlation: float


class SkinRender(NamedTuple):
    """Picture (h, w, 3) in linear light, and the fraction of its light that is surface reflection [-]."""

    picture: Picture
    reflected: float


def compare_highlights(adapter: str = "auto") -> None:
    """Compare highlights rendered by dermis and by Cycles; write benchmarks/results/highlights.json."""
    require_in_checkout(RESULTS)
    renderer, head = dermis.Renderer(adapter), scan_with_normal_map()
    rows = [row for view in HIGHLIGHT_VIEWS for row in highlight_rows(renderer, head, view)]
    write_results(HIGHLIGHT_RESULTS, {"paths": HIGHLIGHT_PATH_COUNT, "rows": rows})


def compare_skins(adapter: str = "auto") -> None:
    """Render skin with dermis and Cycles; write benchmarks/results/look.json and docs/images/look.webp."""
    require_in_checkout(SKIN_COMPARISON_PICTURE.parent)
    renderer, rows, panels = dermis.Renderer(adapter), list[dict[str, object]](), dict[str, Picture]()
    renders = {head: skin_renders(renderer, head) for head in HEAD_NAMES}
    for view in SKIN_COMPARISON_VIEWS:
        for head in HEAD_NAMES:
            columns = renders[head][view]
            rows.append({"head": head, "view": view, "shares": [one.reflected for one in columns]})
            for column, one in zip(SKIN_COMPARISON_COLUMNS, columns, strict=True):
                panels[f"{head} {view}, {column}: {100 * one.reflected:.1f} %"] = one.picture
    write_results(SKIN_COMPARISON_RESULTS, {"paths": HIGHLIGHT_PATH_COUNT, "rows": rows})
    SKIN_COMPARISON_PICTURE.write_bytes(sheet_bytes(panels, 2 * len(SKIN_COMPARISON_COLUMNS)))


def cycles_comparison_texts() -> dict[str, object]:
    """Return texts on the last measurement for docs/templates/accuracy.md, keyed by placeholder."""
    highlight_rows, skin_rows = (
        read_results(HIGHLIGHT_RESULTS)["rows"],
        read_results(SKIN_COMPARISON_RESULTS)["rows"],
    )
    cells = (" | ".join(f"{100 * share:.1f} %" for share in row["shares"]) for row in skin_rows)
    return {
        "highlights": "\n".join(
            f"| {row['view']} | {row['model']} | {row['energy']:.3f} | {row['grain']:.2f} "
            f"| {row['grain_of_cycles']:.2f} | {row['correlation']:.3f} |"
            for row in highlight_rows
        ),
        "highlight_paths": HIGHLIGHT_PATH_COUNT,
        "looks": "\n".join(
            f"| {row['head']} | {row['view']} | {fractions} |"
            for row, fractions in zip(skin_rows, cells, strict=True)
        ),
        "look_paths": HIGHLIGHT_PATH_COUNT,
    }


def scan_with_normal_map() -> Head:
    """Return the head "lee_perry_smith" with only one map: a normal map made from its height map."""
    head = dermis.load_head("lee_perry_smith", subdivide=1, regions="none")
    assert head.maps.height is not None
    return replace(head, maps=Maps(normal=relief_slopes(head.mesh, head.maps.height)))


def relief_slopes(mesh: Mesh, height_map: Picture) -> Picture:
    """Return the slopes (n, n, 2) of a height map, as stored in `Maps.normal`.

    height_map : (n, n) height map [mm]
    """
    down, right = np.gradient(height_map)
    stretch = build_atlas(mesh, len(height_map)).stretch.astype(np.float32)
    return np.asarray(np.stack([right, -down], axis=-1) * stretch, np.float32)


def grain_contrast(picture: Picture, lit_mask: NDArray[np.bool_]) -> float:
    """Return the contrast of fine detail: the relative RMS difference between a picture and its blurred copy.

    lit_mask : (h, w) mask of the pixels to compare
    """
    smooth = gaussian_filter(picture, GRAIN_BLUR_PX)
    return float(np.sqrt((((picture - smooth) / np.maximum(smooth, 1e-9))[lit_mask] ** 2).mean()))


def traced_highlights(scene: Scene, settings: Settings, lobes: tuple[tuple[float, float], ...]) -> Picture:
    """Return the highlights (h, w) that Cycles renders on a surface that reflects a sum of Beckmann lobes.

    lobes : weight and roughness of each lobe
    """
    picture = np.zeros(settings.size[::-1], np.float32)
    for weight, roughness in lobes:
        (image_pass,) = cycles_passes(scene, BeckmannSurface(roughness), [HIGHLIGHT_PATH_COUNT], settings)
        picture += weight * image_pass.image[..., 1]
    return picture


def highlight_rows(renderer: dermis.Renderer, head: Head, view: str) -> list[HighlightRow]:
    """Return one comparison of highlights with Cycles for each model of surface reflection.

    view : camera preset
    """
    camera = load_camera(view, head)
    settings = Settings(size=(384, 384), atlas=512, samples=16, parts="specular", transmission="none")
    scene, rows = Scene(head, [KEY_LIGHT], camera), list[HighlightRow]()
    one_lobe, two_lobes = (traced_highlights(scene, settings, lobes) for lobes in (ONE_LOBE, TWO_LOBES))
    for model in LOBE_MODELS:
        reference = two_lobes if model == "two-lobe" else one_lobe
        lit = reference > np.quantile(reference[reference > 0], LIT_QUANTILE)
        values = {"specular": model, "fresnel": "exact", "rho_s": 1.0, "roughness": SKIN_ROUGHNESS}
        skin = Skin.model_validate(values)
        ours = renderer.draw(Scene(head, [KEY_LIGHT], camera, skin), settings).linear()[..., 1]
        rows.append(
            {
                "view": view,
                "model": model,
                "energy": float(ours.sum() / reference.sum()),
                "grain": grain_contrast(ours, lit),
                "grain_of_cycles": grain_contrast(reference, lit),
                "correlation": float(np.corrcoef(ours[lit], reference[lit])[0, 1]),
            }
        )
    return rows


def render_skin(renderer: dermis.Renderer, scene: Scene) -> SkinRender:
    """Render a scene with dermis; return the picture and the fraction of its light due to surface reflection.

    This fraction is found by a second rendering without scattered light.
    """
    options = {"size": (SKIN_COMPARISON_SIDE, SKIN_COMPARISON_SIDE), "atlas": 1024, "strands": False}
    settings = Settings.model_validate(options), Settings.model_validate(options | {"parts": "specular"})
    picture, surface_pass = (renderer.draw(scene, one).linear() for one in settings)
    return SkinRender(picture, float(surface_pass.sum() / picture.sum()))


def render_cycles_skin(scene: Scene, skin: PrincipledSkin) -> SkinRender:
    """Render a scene with Cycles; return the picture and the fraction of its light due to surface reflection.

    This fraction is found by a second rendering with black skin, which only reflects light at its surface.
    """
    settings = Settings(size=(SKIN_COMPARISON_SIDE, SKIN_COMPARISON_SIDE))
    black = replace(skin, colour=np.zeros_like(skin.colour))
    (image_pass,) = cycles_passes(scene, skin, [HIGHLIGHT_PATH_COUNT], settings)
    (surface_pass,) = cycles_passes(scene, black, [SURFACE_PATH_COUNT], settings)
    return SkinRender(image_pass.image, float(surface_pass.image.sum() / image_pass.image.sum()))


def downsample_map(map_texels: Picture) -> Picture:
    """Return a map averaged over blocks of texels, to at most `MAX_MAP_SIDE` rows.

    map_texels : (h, w) or (h, w, c) map
    """
    step = max(1, len(map_texels) // MAX_MAP_SIDE)
    blocks = map_texels.reshape(
        len(map_texels) // step, step, map_texels.shape[1] // step, step, *map_texels.shape[2:]
    )
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)


def with_normal_map(head: Head) -> Head:
    """Return the head with its height map converted to a normal map, for Cycles."""
    if head.maps.height is None:
        return head
    relief = relief_slopes(head.mesh, downsample_map(head.maps.height))
    return replace(head, maps=replace(head.maps, normal=relief, height=None))


def principled_skin(head: Head) -> PrincipledSkin:
    """Return a Cycles material with the colours of a head and the mean scattering distance of default skin.

    The scattering distance is the distance between the points where light enters and leaves. For Burley's
    profile its mean is 2.5 d, where d is the mean free path divided by a function of the colour.
    """
    assert head.maps.colour is not None and head.maps.mean_colour is not None
    profile, colour = load_profile(Skin().profile), head.maps.mean_colour
    offset_mm = (profile.weight * np.sqrt(0.5 * np.pi * profile.variance_mm2[:, None])).sum(axis=0)
    mean_free_path_mm = offset_mm / 2.5 * (1.9 - colour + 3.5 * (colour - 0.8) ** 2)
    red, green, blue = (float(part) for part in 4.0 * np.pi * mean_free_path_mm)
    return PrincipledSkin(downsample_map(head.maps.colour), (red, green, blue), SKIN_ROUGHNESS)


def skin_renders(renderer: dermis.Renderer, head_title: str) -> dict[str, list[SkinRender]]:
    """Return a dictionary from the name of a view to three renderings of a head.

    The first shows the preset skin "deck-2007", the second the default skin. The third is rendered by Cycles.

    head_title : key of `HEAD_NAMES`
    """
    name = HEAD_NAMES[head_title]
    painted, one_lobe = (dermis.load_head(name, subdivide=1, regions=regions) for regions in ("auto", "none"))
    mapped = with_normal_map(with_painted_maps(renderer.device, painted, MAX_MAP_SIDE))
    skin, renders = principled_skin(mapped), dict[str, list[SkinRender]]()
    for view in SKIN_COMPARISON_VIEWS:
        camera = CAMERA_PRESETS[view](painted)
        preset_2007 = render_skin(renderer, Scene(one_lobe, camera=camera, skin=Skin.preset("deck-2007")))
        ours = render_skin(renderer, Scene(painted, camera=camera))
        renders[view] = [preset_2007, ours, render_cycles_skin(Scene(mapped, camera=camera), skin)]
        print_lines(f"{head_title} {view} {' '.join(f'{one.reflected:.3f}' for one in renders[view])}")
    return renders
