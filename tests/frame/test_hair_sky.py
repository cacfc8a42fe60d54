"""Light of the sky on hair and on skin beside hair."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.validation.comparisons.person_views import VIEWS, view_scene
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.person import Human
from dermis.scene.environment import Environment
from dermis.scene.settings import Settings


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


def _picture_and_labels(
    renderer: Renderer, hair: HairLook
) -> tuple[NDArray[np.float32], NDArray[np.integer[Any]]]:
    head = replace(Human(), hair=hair).head(subdivide=0)
    scene = view_scene(head, VIEWS["portrait"]).replace(lights=(), environment=Environment(name="uniform"))
    frame = renderer.draw(scene, Settings(size=(96, 96), atlas=256, samples=1), outputs=("label",))
    return frame.linear(), frame.output("label")


def test_long_hair_hides_the_sky_from_the_neck_but_hardly_from_the_nose(renderer: Renderer) -> None:
    (bald, before), (long, after) = (
        _picture_and_labels(renderer, HairLook(style)) for style in ("none", "long")
    )
    ratio = {}
    for name in ("neck", "nose"):
        seen = (before == class_number(name)) & (after == class_number(name))
        assert seen.sum() > 20
        ratio[name] = float(long[seen].sum() / bald[seen].sum())
    assert ratio["neck"] < 0.9
    assert 0.9 < ratio["nose"] < 1.005


def test_hair_reflects_light_of_the_sky_by_its_pigment(renderer: Renderer) -> None:
    radiance = {}
    for eumelanin in (0.0, 9.0):
        look = HairLook("long", eumelanin=eumelanin, pheomelanin=0.0)
        picture, labels = _picture_and_labels(renderer, look)
        radiance[eumelanin] = float(picture[labels == class_number("hair")].mean())
    assert 0.2 < radiance[0.0] < 1.0
    assert 0.01 < radiance[9.0] < 0.4 * radiance[0.0]
