"""The scanned head with screen-space techniques, compared with diffusion on the atlas."""

from __future__ import annotations

import numpy as np
import pytest
from setups import run_frame

from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.scene import Camera, Scene, load_lights
from dermis.scene.heads import load_head

FACE = Camera(position=(0, 10, 600), target=(0, -5, 90), frame_mm=110.0)
SIZES = {"size": (160, 160), "atlas": 512, "shadow_size": 1024, "samples": 4, "transmission": "none"}
SIZES["interreflection"] = False  # whose cells lie otherwise on each technique's atlas


@pytest.mark.samples
def test_techniques_agree_on_a_scan(renderer: Renderer) -> None:
    """Each technique is much nearer to the atlas than dry skin is, and as bright."""
    head = load_head("lee_perry_smith", subdivide=0)
    scene = Scene(head, lights=load_lights("studio"), camera=FACE)
    made = {}
    for technique in ("none", "texture-space", "screen-space", "pre-integrated"):
        inputs = run_frame(renderer, scene, technique=technique, **SIZES)
        made[technique] = download(renderer.device, inputs.resources.post.picture.exposed)[..., :3].astype(
            float
        )
    atlas = made.pop("texture-space")
    off = {name: np.sqrt(((image - atlas) ** 2).mean()) for name, image in made.items()}
    assert off["screen-space"] < 0.4 * off["none"]
    assert off["pre-integrated"] < 0.6 * off["none"]
    for image in made.values():
        assert np.isfinite(image).all() and image.min() >= -1e-6
        assert image.sum() == pytest.approx(atlas.sum(), rel=0.03)
