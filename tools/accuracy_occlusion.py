"""The table of ambient occlusion that follows a head, for docs/motion.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.cached import cached_atlas
from dermis.frame.passes.occlusion import bake_occlusion
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.head import Head
from dermis.scene import Environment, Pose, Scene, Settings

Open = NDArray[np.float64]
SIDE = 512
SETTINGS = Settings(size=(16, 16), atlas=SIDE, samples=1)
_TRUTH = 1024  # directions, and texels along the side of their depth maps
_CHANGED = 0.02


def lines(renderer: Renderer, head: Head, shapes: Mapping[str, tuple[Pose, Head]]) -> Iterator[str]:
    """Root mean square errors: over all texels, and over those whose truth is not that of the rest.

    shapes : poses by name, each with the head as if a file had it so
    """
    scene, fine = Scene(head, environment=Environment(name="uniform")), (_TRUTH, _TRUTH)
    rest = baked(renderer, head, head, *fine)
    for name, (pose, shape) in shapes.items():
        truth, posed = baked(renderer, head, shape, *fine), replace(scene, pose=pose)
        made = [followed(renderer, posed, which) for which in ("rest", "baked")] + [
            baked(renderer, head, shape)
        ]
        own = np.isfinite(truth) & np.isfinite(rest)
        changed = own & (np.abs(np.where(own, truth - rest, 0.0)) > _CHANGED)
        cells = [f"{rms((one - truth)[own]):.3f} / {rms((one - truth)[changed]):.3f}" for one in made]
        yield f"| {name} | {changed.sum() / own.sum():.1%} | {' | '.join(cells)} |"


def baked(renderer: Renderer, head: Head, shape: Head, *exactness: int) -> Open:
    """(n, n) open share of the head in another shape, NaN where there is no surface, on its own atlas.

    exactness : directions and sides of depth maps, those of frames when left out
    """
    inputs = renderer.prepare(Scene(head), SETTINGS)
    texels, atlas = inputs.layouts[0].atlas.resources["atlas"], cached_atlas(head.mesh, SIDE, "stitched")
    made = bake_occlusion(renderer.device, shape, atlas, inputs.lit, texels, SIDE, *exactness)
    return made[:SIDE].astype(float)


def followed(renderer: Renderer, scene: Scene, which: str) -> Open:
    """(n, n) the open share that a frame of the scene reads."""
    settings = SETTINGS.model_copy(update={"occlusion": which})
    renderer.draw(scene, settings)
    made = renderer.prepare(scene, settings).lit["occlusion_map"]
    return download(renderer.device, made)[:SIDE].astype(float)


def rms(error: Open) -> float:
    return float(np.sqrt(np.mean(error**2)))
