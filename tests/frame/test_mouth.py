"""Mouths of people are closed at rest."""

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
MOUTH_CAMERA = Camera(position=(0, -50, 900), target=(0, -50, 90), frame_mm=75)
Labels = NDArray[np.uint8]


@cache
def head_of(seed: int | None) -> Head:
    return (Human() if seed is None else Human.sampled(seed)).head()


def close_up(renderer: Renderer, seed: int | None, weights: Mapping[str, float]) -> Labels:
    """Return the labels of a mouth."""
    scene = Scene(head_of(seed), lights="portrait", camera=MOUTH_CAMERA, pose=weights)
    frame = renderer.draw(scene, SETTINGS, outputs=("label",))
    return np.asarray(frame.output("label"))


def pixels(labels: Labels, *names: str) -> NDArray[np.bool_]:
    return np.isin(labels, [class_number(name) for name in names])


@pytest.mark.parametrize("seed", [None, 1, 5])
def test_neutral_close_up_shows_neither_teeth_nor_tongue(renderer: Renderer, seed: int | None) -> None:
    labels = close_up(renderer, seed, expression("neutral"))
    assert pixels(labels, "upper_lip").sum() > 100 and pixels(labels, "lower_lip").sum() > 100
    assert not pixels(labels, "teeth", "tongue").any()


@pytest.mark.parametrize("seed", [None, 5])
def test_smiles_show_teeth_and_no_tongue(renderer: Renderer, seed: int | None) -> None:
    closed = close_up(renderer, seed, expression("smile"))
    assert not pixels(closed, "teeth", "tongue").any()
    labels = close_up(renderer, seed, expression("joy"))
    assert pixels(labels, "teeth").sum() > 150 and not pixels(labels, "tongue").any()
