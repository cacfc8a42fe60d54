"""Sets highlights beside those of Cycles: python tools/accuracy_highlight.py [ADAPTER].

DERMIS_BLENDER_PYTHON names a Python with bpy. Writes benchmarks/results/highlights.json, from which
tools/accuracy.py takes its rows, so that only this needs Blender.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import dermis
from dermis.apps.truths.cycles import cycles_passes
from dermis.apps.truths.cycles_scene import Facets
from dermis.atlas.build import build_atlas
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.scene import PointLight, Scene, Settings, Skin, load_camera
from dermis.specular.two_lobe import NARROW, SHARE_OF_NARROW, WIDE

RESULTS = Path(__file__).parent.parent / "benchmarks" / "results" / "highlights.json"
MODELS = ("torrance-sparrow-smith", "kelemen", "two-lobe")
VIEWS = ("cheek", "portrait")
ROUGHNESS, PATHS = 0.3, 64
LIGHT = PointLight(position=(-300, 250, 600), irradiance=(3, 3, 3))
ONE_KIND = ((1.0, ROUGHNESS),)
TWO_KINDS = ((SHARE_OF_NARROW, NARROW * ROUGHNESS), (1.0 - SHARE_OF_NARROW, WIDE * ROUGHNESS))
BRIGHT = 0.6  # share of the lit pixels that are darker than those that count
GRAIN = 6.0  # standard deviation of what counts as the picture without its grain [pixel]

Picture = NDArray[np.float32]


def bumpy_head() -> Head:
    """The scan with its relief as a normal map, which both programs take, and no other map."""
    head = dermis.load_head("lee_perry_smith", subdivide=1, regions="none")
    height = head.maps.height
    assert height is not None
    down, right = np.gradient(height)
    stretch = build_atlas(head.mesh, len(height)).stretch.astype(np.float32)
    slopes = np.asarray(np.stack([right, -down], axis=-1) * stretch, np.float32)
    return replace(head, maps=Maps(normal=slopes))


def grain(picture: Picture, lit: NDArray[np.bool_]) -> float:
    """Contrast of what is finer than the picture without its grain: root mean square over the mean."""
    smooth = gaussian_filter(picture, GRAIN)
    return float(np.sqrt((((picture - smooth) / np.maximum(smooth, 1e-9))[lit] ** 2).mean()))


def traced(scene: Scene, settings: Settings, kinds: tuple[tuple[float, float], ...]) -> Picture:
    """Green light that facets reflect, path-traced.

    kinds : share and roughness of each kind of facets
    """
    picture = np.zeros(settings.size[::-1], np.float32)
    for share, roughness in kinds:
        (passed,) = cycles_passes(scene, Facets(roughness), [PATHS], settings)
        picture += share * passed.image[..., 1]
    return picture


def measured(renderer: dermis.Renderer, head: Head, view: str) -> list[dict[str, Any]]:
    """A row for each model: energy and contrast over Cycles', and how alike they are."""
    camera = load_camera(view, head)
    settings = Settings(size=(384, 384), atlas=512, samples=16, parts="specular", transmission="none")
    scene, rows = Scene(head, [LIGHT], camera), list[dict[str, Any]]()
    alike, mixed = (traced(scene, settings, kinds) for kinds in (ONE_KIND, TWO_KINDS))
    for model in MODELS:
        truth = mixed if model == "two-lobe" else alike
        lit = truth > np.quantile(truth[truth > 0], BRIGHT)
        skin = Skin.model_validate(
            {"specular": model, "fresnel": "exact", "rho_s": 1.0, "roughness": ROUGHNESS}
        )
        ours = renderer.draw(Scene(head, [LIGHT], camera, skin), settings).linear()[..., 1]
        rows.append(
            {
                "view": view,
                "model": model,
                "energy": float(ours.sum() / truth.sum()),
                "grain": grain(ours, lit),
                "grain_of_cycles": grain(truth, lit),
                "correlation": float(np.corrcoef(ours[lit], truth[lit])[0, 1]),
            }
        )
    return rows


def table() -> str:
    """Rows of the page, of what was measured last."""
    rows = json.loads(RESULTS.read_text(encoding="utf-8"))["rows"]
    return "\n".join(
        f"| {row['view']} | {row['model']} | {row['energy']:.3f} | {row['grain']:.2f} "
        f"| {row['grain_of_cycles']:.2f} | {row['correlation']:.3f} |"
        for row in rows
    )


def main() -> None:
    """Measure and write."""
    renderer, head = dermis.Renderer(sys.argv[1] if len(sys.argv) > 1 else "auto"), bumpy_head()
    rows = [row for view in VIEWS for row in measured(renderer, head, view)]
    RESULTS.write_text(json.dumps({"paths": PATHS, "rows": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
