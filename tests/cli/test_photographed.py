"""Default exposure and background of the commands; alpha in files; overexposed pictures."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.frame.features.post.meter import METERED_IRRADIANCE
from dermis.images.io import read_image

Run = Callable[..., Any]
pytestmark = pytest.mark.photographed
HAND = ("--exposure", "1", "--background", "none")


def report(render: Run, *words: str) -> dict:
    ended = render("head.obj", "-o", "a.exr", "--json", *words)
    assert ended.code == 0
    return dict(json.loads(ended.stdout))


def test_render_meters_the_exposure_by_default(render: Run) -> None:
    metered = report(render)["exposure"]
    assert report(render, "--exposure", "skin")["exposure"] == metered
    assert report(render, "--exposure", "auto")["exposure"] <= metered
    assert report(render, "--exposure", "2.5")["exposure"] == 2.5
    words = "--env", "uniform", "--occlusion", "none", "--exposure", "auto"
    assert report(render, *words)["exposure"] == pytest.approx(METERED_IRRADIANCE, rel=1e-3)


def test_settings_of_a_scene_file_are_kept(run: Run, render: Run, folder: Path) -> None:
    named = 'lights = "portrait"\n[head]\nname = "head.obj"\n[render]\nsize = [64, 64]\natlas = 64\n'
    (folder / "plain.toml").write_text(named)
    (folder / "named.toml").write_text(f'{named}exposure = 0.5\nbackground = "#ffffff"\n')
    plain = json.loads(run("render", "plain.toml", "-o", "a.png", "--json").stdout)
    assert plain["exposure"] == pytest.approx(report(render)["exposure"], rel=1e-5)
    assert read_image("a.png").shape == (64, 64, 3) and read_image("a.png")[0, 32].max() > 60
    assert json.loads(run("render", "named.toml", "-o", "a.png", "--json").stdout)["exposure"] == 0.5
    assert (read_image("a.png")[0, 0] == 255).all()


def test_pictures_without_background_have_alpha(render: Run) -> None:
    for words, channels in ((("--background", "none"), 4), (("--background", "0,0,0"), 3), ((), 3)):
        for name in ("a.png", "a.exr"):
            assert render("head.obj", "-o", name, *words).code == 0
            assert read_image(name).shape == (64, 64, channels)
    assert render("head.obj", "-o", "a.png", *HAND).code == 0
    assert render("head.obj", "-o", "a.exr", *HAND).code == 0
    levels, floats = read_image("a.png"), read_image("a.exr")
    assert np.array_equal(levels[..., 3], np.rint(255 * floats[..., 3]))
    assert floats[..., 3].min() == 0.0 and floats[..., 3].max() == 1.0
    assert (floats[floats[..., 3] == 0] == 0).all()


def test_hex_colours_are_srgb(render: Run) -> None:
    assert render("head.obj", "-o", "a.png", "--background", "#336699").code == 0
    assert read_image("a.png")[0, 0].tolist() == [0x33, 0x66, 0x99]


def test_a_clipped_head_is_noted(render: Run) -> None:
    ended = render("head.obj", "-o", "a.png", "--exposure", "50")
    assert ended.code == 0 and ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("note: ") and "of the head is overexposed" in ended.stderr
    assert "--exposure 50" in ended.stderr
    assert render("head.obj", "-o", "a.png").stderr == ""
