"""Highlight of a bumpy ball at several distances against pixels that resolve the bumps."""

from __future__ import annotations

import numpy as np
import pytest
from setups import head_of, place
from tolerances import BUMPY_HIGHLIGHT

import dermis
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.mesh.primitives import uv_sphere

RADIUS_MM, MAP_SIDE, BUMPS = 50.0, 1024, 192
FRAME_MM, SIZE = 110.0, 96
"""Frame at the smallest distance, and side of the pictures [pixel]: a bump is 1.4 pixels wide there."""
SIDE_OF_REFERENCE = 8 * SIZE  # 64 samples in the place of each pixel
TURNS = (0.0, 11.0, 23.0)
"""Angles of the ball [degrees]."""
MIDDLE_MM = 8.0
"""Standard deviation of the Gaussian around the highlight, over which radiance is averaged."""


def ball_of(slope: float) -> Head:
    """Return a ball with bumps, whose slopes have the given amplitude."""
    v, u = (np.mgrid[:MAP_SIDE, :MAP_SIDE] + 0.5) / MAP_SIDE
    rows = np.sin(2 * np.pi * BUMPS * u) * np.sin(np.pi * BUMPS * v) * np.sin(np.pi * v)
    return head_of(uv_sphere(RADIUS_MM, 96, 48), height=slope * RADIUS_MM / BUMPS * rows)


@pytest.fixture(scope="module")
def ball() -> Head:
    return ball_of(0.25)


def highlight(renderer: Renderer, ball: Head, frame_mm: float, size: int, turn: float) -> float:
    """Return the mean specular radiance in the middle of the highlight, in the units of the frame."""
    a = np.radians(turn)
    towards, aside = np.array([np.sin(a), 0.0, np.cos(a)]), np.array([np.cos(a), 0.0, -np.sin(a)])
    eye, target = place(ball, 2000.0 * towards), place(ball, (0, 0, 0))
    lamp = dermis.DirectionalLight(direction=tuple(-(0.8 * towards + 0.6 * aside)), irradiance=(3, 3, 3))
    settings = dermis.Settings(
        size=(size, size), samples=8, parts="specular", technique="none", atlas=256, shadow_size=64
    )
    scene = dermis.Scene(
        ball,
        camera=dermis.Camera(position=eye, target=target, frame_mm=frame_mm),
        lights=(lamp.replace(shadows=False),),
        skin={"roughness": 0.25},
    )
    linear = renderer.draw(scene, settings).linear().mean(axis=-1)
    y, x = (np.mgrid[:size, :size] + 0.5) / size - 0.5
    middle = RADIUS_MM * 0.6 / np.hypot(1.8, 0.6)
    weight = np.exp(-0.5 * ((x * frame_mm - middle) ** 2 + (y * frame_mm) ** 2) / MIDDLE_MM**2)
    return float((linear * weight).sum() / weight.sum())


@pytest.mark.parametrize("turn", TURNS)
def test_highlight_of_a_turning_bumpy_ball_is_that_of_resolved_bumps(
    renderer: Renderer, ball: Head, turn: float
) -> None:
    resolved = highlight(renderer, ball, FRAME_MM, SIDE_OF_REFERENCE, turn)
    for distance in (1.0, 1.5, 2.0, 3.0, 4.0):
        seen = highlight(renderer, ball, distance * FRAME_MM, SIZE, turn)
        assert seen == pytest.approx(resolved, rel=BUMPY_HIGHLIGHT), distance


def test_bumps_dim_the_middle_of_a_highlight(renderer: Renderer, ball: Head) -> None:
    """Bumps that pixels do not resolve have an effect, which the other test measures."""
    seen, smooth = (highlight(renderer, one, 4.0 * FRAME_MM, SIZE, 0.0) for one in (ball, ball_of(0.0)))
    assert seen < (1.0 - 4.0 * BUMPY_HIGHLIGHT) * smooth
