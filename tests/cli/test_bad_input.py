"""Invalid meshes, maps, numbers and names: the message begins with its subject, as `refused` checks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

Run = Callable[..., Any]


class Bad(NamedTuple):
    """Arguments of a command, the subject of its message, and a part of the message."""

    words: str
    error_subject: str
    actual: str


MESHES = {
    "nobody.obj": Bad("nobody.obj", "nobody.obj", "neither"),
    "an unknown sample": Bad("lee_perry", "lee_perry", "neither"),
    "a sample that is no head": Bad("lebombo", "lebombo", "environment"),
    "an empty name": Bad("''", "head", "''"),
    "a folder": Bad("inputs", "inputs", "neither"),
    "not a mesh": Bad("text.obj", "text.obj", "none"),
    "another format": Bad("head.fbx", "head.fbx", "'.fbx'"),
    "cut short": Bad("short.obj", "short.obj", "indices of its 161 vertices"),
    "uv outside": Bad("far_uv.obj", "far_uv.obj", "to 1.5"),
    "NaN position": Bad("nan.obj", "nan.obj", "NaN"),
    "no triangles in skin": Bad("empty.obj", "empty.obj", "'skin' has no triangles"),
    "too small": Bad("head.obj --unit-mm 0.001", "head.obj", "it is 0.24 mm high"),
    "too large": Bad("head.obj --unit-mm 100", "head.obj", "it is 24 m high"),
    "unit of 0": Bad("head.obj --unit-mm 0", "--unit-mm", "got 0.0"),
    "unit of 0 for a sample": Bad("lee_perry_smith --unit-mm 0", "--unit-mm", "got 0.0"),
    "unit NaN": Bad("head.obj --unit-mm nan", "--unit-mm", "got nan"),
    "subdivided too often": Bad("head.obj --subdivide 4", "subdivide", "got 4"),
    "unknown axis": Bad("head.obj --up w", "--up", "got 'w'"),
    "front along up": Bad("head.obj --up z --front=-z", "--front", "got '-z'"),
}
MAPS = {
    "no such map": Bad("head.obj --colour none.png", "none.png", "No such file"),
    "not a picture": Bad("head.obj --colour text.obj", "text.obj", "first bytes"),
    "truncated JPEG": Bad("head.obj --colour short.jpg", "short.jpg", "cannot be decoded"),
    "truncated PNG": Bad("head.obj --specular-map short.png", "short.png", "cannot be decoded"),
    "bit depth": Bad("head.obj --height deep.tif --height-mm 0.02", "deep.tif", "kind I"),
    "a float out of range": Bad("head.obj --colour bright.exr", "bright.exr", "to 9"),
    "colour for grey": Bad("head.obj --specular-map red.png", "red.png", "differ"),
    "colour for normals": Bad("head.obj --normal red.png", "red.png", "not unit vectors"),
    "height without mm": Bad("head.obj --height grey.png", "grey.png", "it is not set"),
    "mm without height": Bad("head.obj --height-mm 0.02", "height_mm", "without a height map"),
    "negative mm": Bad("head.obj --height grey.png --height-mm -1", "--height-mm", "-1"),
    "NaN mm": Bad("head.obj --height grey.png --height-mm nan", "--height-mm", "nan"),
}
NUMBERS = {
    "size of nothing": Bad("head.obj --size 0x0", "--size", "got 0"),
    "size beyond all": Bad("head.obj --size 100000x100000", "--size", "got 100000"),
    "size of too much memory": Bad("head.obj --size 16384x16384 --samples 64", "--size", "16384"),
    "size in words": Bad("head.obj --size large", "--size", "got 'large'"),
    "atlas under 64": Bad("head.obj --atlas 63", "--atlas", "got 63"),
    "atlas beyond all": Bad("head.obj --atlas 1000000", "--atlas", "got 1000000"),
    "atlas of a half": Bad("head.obj --atlas 64.5", "--atlas", "got '64.5'"),
    "samples 0": Bad("head.obj --samples 0", "--samples", "got 0"),
    "samples 65": Bad("head.obj --samples 65", "--samples", "got 65"),
    "negative roughness": Bad("head.obj --roughness -0.1", "--roughness", "got -0.1"),
    "roughness NaN": Bad("head.obj --roughness nan", "--roughness", "got nan"),
    "negative rho_s": Bad("head.obj --rho-s -1", "--rho-s", "got -1.0"),
    "mix below 0": Bad("head.obj --mix -0.01", "--mix", "got -0.01"),
    "mix above 1": Bad("head.obj --mix 1.01", "--mix", "got 1.01"),
    "mix NaN": Bad("head.obj --mix nan", "--mix", "got nan"),
    "mix in words": Bad("head.obj --mix half", "--mix", "got 'half'"),
    "negative exposure": Bad("head.obj --exposure -1", "--exposure", "got -1.0"),
    "exposure NaN": Bad("head.obj --exposure nan", "--exposure", "got nan"),
    "exposure infinite": Bad("head.obj --exposure inf", "--exposure", "got inf"),
    "background of two": Bad("head.obj --background 0,0", "--background", "got '0,0'"),
    "background NaN": Bad("head.obj --background 0,nan,0", "--background", "got nan"),
}
NAMES = {
    "unknown option": Bad("head.obj --colors red.png", "--colors", "Did you mean --colour"),
    "option without value": Bad("head.obj --colour", "--colour", "none"),
    "option given twice": Bad("head.obj --mix 0 --mix 1", "--mix", "twice"),
    "two heads": Bad("head.obj head.obj", "head.obj", "got this argument"),
    "unknown technique": Bad("head.obj --technique wet", "--technique", "got 'wet'"),
    "unknown profile": Bad("head.obj --profile milk", "profile milk", "no such file"),
    "profile of words": Bad("head.obj --profile words.csv", "profile words.csv", "rows"),
    "profile that decreases": Bad("head.obj --profile falling.csv", "profile falling.csv", "they are"),
    "profile that is a scene": Bad("head.obj --profile red.toml", "red.toml", "rho_s"),
    "unknown lights": Bad("head.obj --lights disco", "disco", "No such file"),
    "unknown camera": Bad("head.obj --camera selfie", "selfie", "No such file"),
    "camera file without one": Bad("head.obj --camera red.toml", "red.toml: camera", "none"),
    "lights file without any": Bad("head.obj --lights red.toml", "red.toml", "none"),
    "head option with a scene": Bad("red.toml --unit-mm 5", "--unit-mm", "it is given"),
}
CASES = {**MESHES, **MAPS, **NUMBERS, **NAMES}


@pytest.mark.parametrize("bad", CASES.values(), ids=CASES)
def test_input_is_refused(refused: Run, opened: None, bad: Bad, request: pytest.FixtureRequest) -> None:
    if "lee_perry_smith" in bad.words:
        request.getfixturevalue("sample_folder")
    message = refused(*(word.strip("'") for word in bad.words.split()))
    assert message["error_subject"].endswith(bad.error_subject) and bad.actual in message[0]


def test_unknown_adapter(refused: Run) -> None:
    message = refused("head.obj", "--adapter", "voodoo")
    assert message["error_subject"] == "adapter 'voodoo'" and "auto, cpu" in message[0]


@pytest.mark.usefixtures("unopened")
def test_no_adapter(refused: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.gpu.adapters.list_adapters", list)
    monkeypatch.setattr("dermis.gpu.adapters.driver_advice", lambda: "On Fedora: sudo dnf install drivers")
    message = refused("head.obj")
    assert message["error_subject"] == "adapter" and message[0].endswith("sudo dnf install drivers.\n")


def test_unknown_command(run: Run) -> None:
    ended = run("paint", "head.obj")
    assert (ended.code, ended.stdout) == (2, "")
    assert ended.stderr.startswith("dermis: paint: expected a command of dermis, but ")
