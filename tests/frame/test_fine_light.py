"""Light finer than texels and pixels: its amount, position and width after scattering."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import entered_light, head_of, place, run_frame, scene_of

from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.primitives import plane
from dermis.optics.profiles import load_profile
from dermis.scene.lights import StripeLight

Floats = NDArray[np.float64]
SIDE_MM, FRAME_MM, PIXELS = 96.0, 32.0, 96
FLAT = head_of(plane(SIDE_MM, 4))
PROFILE = load_profile("skin1")


def stripe(x_mm: float, width_mm: float) -> StripeLight:
    """Return a stripe along +Y, from straight above."""
    middle = place(FLAT, (x_mm, 0, 0))
    return StripeLight(direction=(0, 0, -1), position=middle, width_mm=width_mm, shadows=False)


def lit(renderer: Renderer, light: StripeLight, atlas: int, **settings: Any) -> Any:
    """Render the plane in the colour of `PROFILE`, without specular reflection."""
    camera = scene_of(FLAT).camera.model_copy(update={"frame_mm": FRAME_MM})
    skin = {"profile": "skin1", "albedo": "profile", "specular": "none", "energy": "none"}
    scene = scene_of(FLAT, light, camera=camera, **skin)
    return run_frame(renderer, scene, atlas=atlas, size=(PIXELS, PIXELS), **settings)


def across(renderer: Renderer, light: StripeLight, atlas: int, **settings: Any) -> Floats:
    """Return the (w, 3) radiance along a row of the picture, away from edges of triangles."""
    picture = lit(renderer, light, atlas, **settings).resources.post.picture
    return download(renderer.device, picture.radiance)[PIXELS // 2 + 12, :, :3].astype(float)


def spread(light: StripeLight, x_mm: float, sub: int, width: float = 1.0) -> Floats:
    """Return the analytic (w, 3) radiance of the row, the mean over `sub` points of each pixel.

    width : factor of the scattering distance
    """
    x = (np.arange(PIXELS * sub) + 0.5) / sub * FRAME_MM / PIXELS - FRAME_MM / 2 - x_mm
    sigma2 = (light.width_mm / 4) ** 2
    variance = sigma2 + width**2 * PROFILE.variance_mm2
    share = np.sqrt(sigma2 / variance) * np.exp(-0.5 * x[:, None] ** 2 / variance)
    row = np.array(light.irradiance) / np.pi * (share @ PROFILE.weight)
    return np.asarray(row.reshape(PIXELS, sub, 3).mean(axis=1))


@pytest.mark.parametrize("atlas", [64, 128])
@pytest.mark.parametrize("x_mm", [0.0, 0.4, 1.1])
def test_stripe_on_coarse_texels_follows_the_profile(renderer: Renderer, x_mm: float, atlas: int) -> None:
    """A stripe of 1.5 mm on texels of 1.5 and 0.75 mm is 3 to 64 % off without the picture's correction."""
    made, exact = across(renderer, stripe(x_mm, 1.5), atlas), spread(stripe(x_mm, 1.5), x_mm, 1)
    assert np.sqrt(((made - exact) ** 2).sum() / (exact**2).sum()) < 0.04


@pytest.mark.parametrize("samples", [1, 16])
def test_pixel_average_matches_its_samples(renderer: Renderer, samples: int) -> None:
    """A stripe of 0.5 mm within pixels of 0.33 mm: point samples would have 12 % too much light."""
    middle = FRAME_MM / PIXELS / 2
    light = stripe(middle, 0.5)
    made = across(renderer, light, 64, samples=samples, technique="none").sum(axis=0)
    exact = spread(light, middle, samples, 0.0).sum(axis=0)
    assert np.allclose(made, exact, rtol=0.03)


def test_texels_conserve_light_at_any_subtexel_offset(renderer: Renderer) -> None:
    """Move a stripe half as wide as a texel by fractions of a texel; point samples hold 0 to 320 %."""
    held = [
        entered_light(renderer, lit(renderer, stripe(x, 0.75), 64))[16:48, :, 0].sum(axis=1).mean()
        for x in (0.0, 0.375, 0.75)
    ]
    exact = stripe(0, 1).irradiance[0] * 0.75 / 4 * np.sqrt(2 * np.pi) / (SIDE_MM / 64)
    assert np.ptp(held) < 0.04 * np.mean(held)
    assert np.mean(held) == pytest.approx(exact, rel=0.01)
