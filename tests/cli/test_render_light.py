"""`dermis render` with environments, rigs, bloom and tone curves: precedence and refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.environment.panorama import texel_directions
from dermis.images.io import read_image, write_exr

Run = Callable[..., Any]


@pytest.fixture
def sky(folder: Path) -> str:
    """Return the path of a panorama that is bright on the head's left, with a sun-like peak."""
    towards = texel_directions(64, 128)
    radiance = np.full((64, 128, 3), 0.2, np.float32)
    radiance[towards[..., 0] > 0.5] = 2.0
    radiance[towards @ [0, 1, 0] > np.cos(np.radians(3.0))] = 2000.0
    write_exr(folder / "sky.exr", radiance)
    return "sky.exr"


def picture(render: Run, *words: str) -> Any:
    ended = render("head.obj", "-o", "a.exr", *words)
    assert ended.code == 0, ended.stderr
    return read_image("a.exr")


def test_an_environment_replaces_the_default_lights(render: Run) -> None:
    one, studio = picture(render, "--env", "uniform"), picture(render, "--lights", "studio")
    both = picture(render, "--env", "uniform", "--lights", "studio")
    assert one.max() > 0.1 and studio.max() > 0.1
    assert np.abs(one + studio - both).max() < 1e-4 * both.max()
    assert np.array_equal(one, picture(render, "--env", "uniform", "--lights", "none"))
    assert np.allclose(picture(render, "--env", "uniform", "--env-exposure", "2"), 2 * one, rtol=1e-4)


def test_the_environment_is_drawn_on_request(render: Run, sky: str) -> None:
    words = ("--env", sky, "--occlusion", "none", "--samples", "1")
    plain, shown = picture(render, *words), picture(render, *words, "--background", "environment")
    behind = plain.max(axis=-1) == 0
    assert behind.any() and (shown[behind] > 0.1).all()
    assert np.array_equal(shown[~behind], plain[~behind])


def test_sun_like_peaks_are_noted(render: Run, sky: str) -> None:
    ended = render("head.obj", "--env", sky, "-o", "a.exr", "--exposure", "0.1")
    assert (ended.code, ended.stderr) == (
        0,
        "note: a sun-like peak of sky.exr is rendered as a light with shadows\n",
    )
    assert render("head.obj", "--env", "uniform", "-o", "a.exr", "--exposure", "0.1").stderr == ""


def test_rotation_turns_the_light(render: Run, sky: str) -> None:
    left, right = (picture(render, "--env", sky, "--env-rotation", angle) for angle in ("0", "180"))
    half = left.shape[1] // 2
    assert left[:, half:].sum() > left[:, :half].sum()
    assert right[:, half:].sum() < right[:, :half].sum()


def test_a_scenes_environment_can_be_changed(render: Run, folder: Path, sky: str) -> None:
    scene = '[environment]\nname = "sky.exr"\nexposure = 0.5\n[head]\nname = "head.obj"\n'
    (folder / "scene.toml").write_text(scene)
    assert render("scene.toml", "-o", "b.exr").code == 0
    dim = read_image("b.exr")
    whole = picture(render, "--env", sky)
    assert np.allclose(dim, picture(render, "--env", sky, "--env-exposure", "0.5"))
    assert render("scene.toml", "-o", "b.exr", "--env-exposure", "1").code == 0
    assert np.allclose(read_image("b.exr"), whole)


def test_wrong_gamma_is_noted(render: Run) -> None:
    dim = ("head.obj", "--exposure", "0.5")
    right = render(*dim, "-o", "a.png", "--gamma", "right")
    wrong = render(*dim, "-o", "b.png", "--gamma", "wrong")
    assert right.stderr == "" and "for comparison" in wrong.stderr and wrong.code == 0
    assert not np.array_equal(read_image("a.png"), read_image("b.png"))


def test_bloom_and_tone_reach_the_picture(render: Run) -> None:
    plain = picture(render)
    assert np.array_equal(plain, picture(render, "--tone", "filmic"))  # linear stays linear
    soft = picture(render, "--bloom", "0.3")
    assert soft.sum() == pytest.approx(plain.sum(), rel=0.05) and soft.max() < plain.max()
    curves = []
    for tone in ("none", "filmic", "neutral"):
        assert render("head.obj", "-o", "a.png", "--tone", tone).code == 0
        curves.append(read_image("a.png").astype(int))
    assert all((a != b).any() for a, b in ((curves[0], curves[1]), (curves[1], curves[2])))


@pytest.mark.parametrize(
    ("words", "error_subject", "actual"),
    [
        ("--env nowhere.hdr", "environment 'nowhere.hdr'", "neither"),
        ("--env lee_perry_smith", "lee_perry_smith", "a head"),
        ("--env head.obj", "head.obj", "none"),
        ("--env-rotation 30", "--env-rotation", "there is none"),
        ("--background environment", "background environment", "there is none"),
        ("--env uniform --env-rotation nan", "--env-rotation", "nan"),
        ("--env uniform --env-exposure -1", "--env-exposure", "got -1.0"),
        ("--lights none", "--lights", "'none' has none"),
        ("--bloom 1.5", "--bloom", "got 1.5"),
        ("--tone aces", "--tone", "got 'aces'"),
        ("--occlusion some", "--occlusion", "got 'some'"),
    ],
)
def test_bad_light_is_refused(render: Run, words: str, error_subject: str, actual: str) -> None:
    ended = render("head.obj", *words.split(), "-o", "a.png")
    assert ended.code == 2 and ended.stdout == ""
    assert ended.stderr.startswith(f"dermis: {error_subject}: expected ") and actual in ended.stderr
