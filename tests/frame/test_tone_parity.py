"""Exposure and tone curves treat all skin tones alike."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import frontal, head_of, scene_of, settings_of
from tolerances import TONE_PARITY

from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.human.skin.painted import mean_colour
from dermis.images.colour import decode_srgb, luminance
from dermis.mesh.primitives import plane

ITAS = (-60, -40, -20, 0, 15, 30, 45, 60)
IRRADIANCE = 2.6
Doubles = NDArray[np.float64]


def without_curve(shown: Doubles, tone: str) -> Doubles:
    """Return the light before a tone curve, for colours that the curve does not compress."""
    if tone == "neutral":
        least = shown.min(axis=-1, keepdims=True)
        dark = np.sqrt(np.maximum(least, 0.0) / 6.25)  # the least channel, where that is below 0.08
        return shown + np.where(dark < 0.08, dark - least, 0.04)
    if tone == "filmic":
        light = np.linspace(0.0, 2.0, 20001)
        curve = film(2.0 * light) / film(np.array(11.2))
        return np.interp(shown, curve, light)
    return shown


def film(x: Doubles) -> Doubles:
    """Return the curve of film by its published constants. Source: [Hable2010]."""
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3


@pytest.mark.parametrize("tone", ["none", "filmic", "neutral"])
def test_light_is_as_exact_in_dark_as_in_light_skin(renderer: Renderer, tone: str) -> None:
    """Undo encoding, tone curve and exposure of the picture of a lit plane in measured tones.

    The colours vary by 15 % in the plane, so that the steps of eight bits average out.
    """
    errors, exposures = [], []
    uneven = np.random.default_rng(1).uniform(0.85, 1.15, (128, 128, 1))
    for ita in ITAS:
        colour = mean_colour(Human(ita=ita).look) * uneven
        scene = scene_of(head_of(plane(100.0), colour=colour), frontal(IRRADIANCE), mix=0.0, rho_s=0.0)
        frame = renderer.draw(
            scene, settings_of(exposure="auto", tone=tone, technique="none", size=(96, 96), bloom=0.0)
        )
        inner = np.s_[24:72, 24:72]
        shown = decode_srgb(frame.srgb8()[inner] / 255.0).astype(np.float64)
        exposures.append(frame.exposure)
        light = without_curve(shown, tone) / exposures[-1]
        truth = renderer.draw(
            scene, settings_of(exposure=1.0, technique="none", size=(96, 96), bloom=0.0)
        ).linear()[inner]
        errors.append(luminance(light).mean() / luminance(truth).astype(np.float64).mean() - 1.0)
    assert np.ptp(exposures) < 1e-5 * exposures[0], "the meter does not brighten dark skin"
    assert max(errors) - min(errors) <= TONE_PARITY
    assert max(map(abs, errors)) <= TONE_PARITY
