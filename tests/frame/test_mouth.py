"""Mouths of people: closed at rest, and with visible upper teeth in a smile and in speech."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human
from dermis.frame.renderer import Renderer
from dermis.human.expressions import expression
from dermis.human.labels.classes import class_number
from dermis.mesh.head import Head
from dermis.scene import Camera, Scene, Settings

SETTINGS = Settings(size=(96, 96), atlas=256, samples=4, strands=False)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
MOUTH_CAMERA = Camera(position=(0, -50, 900), target=(0, -50, 90), frame_mm=75)
Picture = NDArray[np.float32]
Labels = NDArray[np.uint8]


@cache
def head_of(seed: int | None) -> Head:
    return (Human() if seed is None else Human.sampled(seed)).head()


def close_up(renderer: Renderer, seed: int | None, weights: Mapping[str, float]) -> tuple[Picture, Labels]:
    """Return the linear picture and the labels of a mouth in the rig "portrait"."""
    scene = Scene(head_of(seed), lights="portrait", camera=MOUTH_CAMERA, pose=weights)
    frame = renderer.draw(scene, SETTINGS, outputs=("label",))
    return frame.linear(), frame.output("label")


def pixels(labels: Labels, *names: str) -> NDArray[np.bool_]:
    return np.isin(labels, [class_number(name) for name in names])


@pytest.mark.parametrize("seed", [None, 1, 5])
def test_neutral_close_up_shows_neither_teeth_nor_tongue(renderer: Renderer, seed: int | None) -> None:
    _, labels = close_up(renderer, seed, expression("neutral"))
    assert pixels(labels, "upper_lip").sum() > 100 and pixels(labels, "lower_lip").sum() > 100
    assert not pixels(labels, "teeth", "tongue").any()


@pytest.mark.parametrize("name", ["joy", "laugh", "smile-with-teeth", "speak-e"])
def test_teeth_in_a_smile_are_darker_than_skin_but_not_dark(renderer: Renderer, name: str) -> None:
    picture, labels = close_up(renderer, None, expression(name))
    teeth, skin = pixels(labels, "teeth"), pixels(labels, "skin")
    assert teeth.sum() > 60
    luminance = picture @ LUMINANCE
    assert 0.4 < np.median(luminance[teeth]) / np.median(luminance[skin]) < 0.8


def test_open_mouth_is_dark_but_not_black(renderer: Renderer) -> None:
    picture, labels = close_up(renderer, None, expression("open-jaw"))
    inside, skin = pixels(labels, "mouth_interior"), pixels(labels, "skin")
    luminance = picture @ LUMINANCE
    relative = np.median(luminance[inside]) / np.median(luminance[skin])
    assert inside.sum() > 100 and 0.01 < relative < 0.25
