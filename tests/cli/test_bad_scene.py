"""Invalid scene files: the message names the file and the part at fault."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]
SCENE = '[head]\nname = "head.obj"\n'
SCENES = {
    "no scene": (None, "scene.toml", "No such file"),
    "not TOML": ("head == 5", "scene.toml", "line 1"),
    "not text": ("\udcff", "scene.toml", "cannot be understood"),
    "no head": ("[skin]\n", "scene.toml: head", "there is none"),
    "head without name": ("[head]\n", "scene.toml: head", "there is none"),
    "head's name a number": ("[head]\nname = 5", "scene.toml: head", "got 5"),
    "head that is not there": ('[head]\nname = "x.obj"', "scene.toml: x.obj", "neither"),
    "unknown part": (SCENE + "[lamp]\n", "scene.toml", "got 'lamp'"),
    "unknown key of head": (SCENE + "units = 1", "scene.toml: head", "unknown"),
    "unknown key of skin": (SCENE + "[skin]\nrough = 1", "scene.toml: skin", "unknown"),
    "unknown key of render": (SCENE + "[render]\nwidth = 1", "scene.toml: render", "unknown"),
    "unknown key of camera": (
        SCENE + "[camera]\nposition = [0, 0, 900]\nfov = 1",
        "scene.toml: camera",
        "unknown",
    ),
    "unknown key of a light": (
        SCENE + "[[lights]]\nposition = [0, 0, 900]\nwatt = 1",
        "scene.toml: light 1",
        "unknown",
    ),
    "unit in words": (SCENE + 'unit_mm = "inch"', "scene.toml: head", "got 'inch'"),
    "skin a number": ("skin = 5\n" + SCENE, "scene.toml: skin", "got 5"),
    "mix too large": (SCENE + "[skin]\nmix = 2", "scene.toml: skin", "got 2"),
    "size in words": (SCENE + '[render]\nsize = "64x64"', "scene.toml: render", "got '64x64'"),
    "light at its target": (SCENE + "[[lights]]\nposition = [0, 0, 0]", "scene.toml: light 1", "[0, 0, 0]"),
    "light of no kind": (SCENE + '[[lights]]\nkind = "moon"', "scene.toml: light 1", "got 'moon'"),
    "light nowhere": (SCENE + "[[lights]]\nposition = [0, 0, nan]", "scene.toml: light 1", "got nan"),
    "light too far": (SCENE + "[[lights]]\nposition = [0, 0, 1e30]", "scene.toml: light 1", "got 1e+30"),
    "light without direction": (
        SCENE + '[[lights]]\nkind = "directional"\ndirection = [0, 0, 0]',
        "scene.toml: light 1",
        "got [0, 0, 0]",
    ),
    "negative light": (
        SCENE + "[[lights]]\nposition = [0, 0, 900]\nirradiance = [-1, 0, 0]",
        "scene.toml: light 1",
        "got -1",
    ),
    "light inside the head": (SCENE + "[[lights]]\nposition = [0, 0, 10]", "light 1", "[0, 0, 10]"),
    "cone inside out": (
        SCENE + '[[lights]]\nkind = "spot"\nposition = [0, 0, 900]\ninner_degrees = 50',
        "scene.toml: light 1",
        "50",
    ),
    "no lights": ("lights = []\n" + SCENE, "scene.toml", "got none"),
    "camera at its target": (SCENE + "[camera]\nposition = [0, 0, 0]", "scene.toml: camera", "[0, 0, 0]"),
    "camera along up": (SCENE + "[camera]\nposition = [0, 900, 0]", "scene.toml: camera", "[0, 900, 0]"),
    "camera of no size": (
        SCENE + "[camera]\nposition = [0, 0, 900]\nframe_mm = 0",
        "scene.toml: camera",
        "got 0",
    ),
    "camera of a number": ("camera = 5\n" + SCENE, "scene.toml: camera", "got 5"),
}


@pytest.mark.parametrize("bad", SCENES.values(), ids=SCENES)
def test_scene_is_refused(refused: Run, opened: None, inputs: Path, bad: tuple[str | None, str, str]) -> None:
    text, error_subject, actual = bad
    (inputs / "scene.toml").unlink(missing_ok=True)
    if text is not None:
        (inputs / "scene.toml").write_bytes(text.encode("utf-8", "surrogateescape"))
    message = refused("scene.toml")
    assert message["error_subject"].startswith(error_subject) and actual in message[0]
