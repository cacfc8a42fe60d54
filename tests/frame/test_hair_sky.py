"""Light of the sky on hair and on skin beside hair."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.validation.comparisons.person_views import VIEWS, view_scene
from dermis.environment.panorama import texel_directions
from dermis.frame.lights.environment import sky_directions, sky_moments
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.person import Human
from dermis.images.io import write_exr
from dermis.scene.environment import Environment
from dermis.scene.settings import Settings

UNIFORM = Environment(name="uniform")


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))


def _picture_and_labels(
    renderer: Renderer, hair: HairLook, environment: Environment = UNIFORM
) -> tuple[NDArray[np.float32], NDArray[np.integer[Any]]]:
    head = replace(Human(), hair=hair).head(subdivide=0)
    scene = view_scene(head, VIEWS["portrait"]).replace(lights=(), environment=environment)
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


def test_moments_give_the_light_that_a_surface_receives() -> None:
    """Compare with the sum over directions; the polynomial of degree 2 errs by up to 1/16 of a cosine."""
    rng = np.random.default_rng(1)
    directions, light = sky_directions(), 0.2 + rng.random(32) ** 4
    first, squares, mixed = sky_moments(light)
    for normal in rng.normal(size=(50, 3)):
        n = normal / np.linalg.norm(normal)
        products = squares[:3] @ (n * n) + 2.0 * mixed[:3] @ (n * np.roll(n, -1))
        received = (3.0 * first[3] + 16.0 * first[:3] @ n + 15.0 * products) / 32.0
        exact = np.maximum(directions @ n, 0.0) @ light
        assert abs(received - exact) < light.sum() / 16.0
        assert received == pytest.approx(exact, rel=0.12)


def test_hair_hides_the_sky_most_from_skin_whose_light_comes_from_behind_it(
    renderer: Renderer, tmp_path: Path
) -> None:
    """The neck faces the front: long hair beside it hides more light from the sides than from the front."""
    ratio = {}
    for name, axis in {"front": [0.0, 0.0, 1.0], "sides": [1.0, 0.0, 0.0]}.items():
        cosine = texel_directions(32, 64) @ np.array(axis)
        radiance = 0.02 + np.maximum(cosine if name == "front" else np.abs(cosine), 0.0) ** 8
        write_exr(tmp_path / f"{name}.exr", np.repeat(radiance[..., None], 3, axis=-1).astype(np.float32))
        sky = Environment(name=str(tmp_path / f"{name}.exr"))
        (bald, before), (long, after) = (
            _picture_and_labels(renderer, HairLook(style), sky) for style in ("none", "long")
        )
        seen = (before == class_number("neck")) & (after == class_number("neck"))
        ratio[name] = float(long[seen].sum() / bald[seen].sum())
    assert ratio["sides"] < ratio["front"] - 0.2
    assert ratio["front"] > 0.7
