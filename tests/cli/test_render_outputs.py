"""`dermis render --outputs`: separate files or parts of the image with equal values, and refusals."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from dermis.frame.output_files import encode_output, quantise
from dermis.images.io import read_image
from dermis.scene.outputs import OUTPUTS

Run = Callable[..., Any]


def parts(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the channels of each part of an OpenEXR file."""
    file = OpenEXR.File(str(path), separate_channels=True)
    return {one.name(): {name: found.pixels for name, found in one.channels.items()} for one in file.parts}


def test_one_exr_and_separate_files_have_equal_outputs(render: Run, folder: Path) -> None:
    names = ["depth", "normal", "triangle", "uv", "alpha"]
    asked = ("--samples", "1", "--outputs", ",".join(names))
    ended = render("head.obj", *asked, "-o", "all.exr", "--json")
    assert ended.code == 0 and json.loads(ended.stdout)["outputs"] == dict.fromkeys(names, "all.exr")
    found = parts(folder / "all.exr")
    assert list(found) == ["rgba", *names]
    assert set(found["rgba"]) == {"R", "G", "B"} and set(found["depth"]) == {"depth.Z"}
    assert set(found["normal"]) == {"normal.X", "normal.Y", "normal.Z"} and set(found["uv"]) == {
        "uv.U",
        "uv.V",
    }
    assert read_image(folder / "all.exr").shape == (64, 64, 3)  # what other readers show
    assert {path.name for path in folder.iterdir()} == {"head.obj", "all.exr"}
    for kind in ("exr", "npy"):
        ended = render("head.obj", *asked, "-o", "f.png", "--outputs-format", kind, "--json")
        written = json.loads(ended.stdout)["outputs"]
        assert written == {name: f"f.{name}.{kind}" for name in names}
    beside = parts(folder / "f.normal.exr")["normal"]
    assert all(np.array_equal(beside[name], found["normal"][name]) for name in beside)
    depth, triangle = np.load(folder / "f.depth.npy"), np.load(folder / "f.triangle.npy")
    assert np.array_equal(depth, found["depth"]["depth.Z"]) and depth.max() > 500
    assert triangle.dtype == np.int32 and np.array_equal(triangle, found["triangle"]["triangle.I"])
    assert ((triangle < 0) == (depth == 0)).all() and np.load(folder / "f.normal.npy").shape == (64, 64, 3)


def test_png_outputs_are_quantised(render: Run, folder: Path) -> None:
    ended = render(
        "head.obj", "--outputs", "depth,normal_camera,uv", "-o", "a.png", "--outputs-format", "png"
    )
    assert ended.code == 0
    render("head.obj", "--outputs", "depth,normal_camera,uv", "-o", "a.png", "--outputs-format", "npy")
    for name in ("depth", "normal_camera", "uv"):
        true, levels = np.load(folder / f"a.{name}.npy"), read_image(folder / f"a.{name}.png")
        step, zero = OUTPUTS[name].quantisation or (0, 0)
        assert levels.dtype == np.uint16
        told = (levels.astype(float) - zero) * step
        assert np.abs(told[..., : np.atleast_3d(true).shape[2]] - np.atleast_3d(true)).max() <= 0.51 * step
    assert read_image(folder / "a.depth.png").shape == (64, 64, 1)
    assert not read_image(folder / "a.uv.png")[..., 2].any()


def test_an_exr_with_separate_outputs_has_one_part(render: Run, folder: Path) -> None:
    ended = render("head.obj", "--outputs", "depth", "-o", "f.exr", "--outputs-format", "png")
    assert ended.code == 0 and list(parts(folder / "f.exr")) != ["rgba", "depth"]
    assert {path.name for path in folder.iterdir()} == {"head.obj", "f.exr", "f.depth.png"}


def test_motion_of_a_single_picture_is_noted(render: Run, folder: Path) -> None:
    ended = render("head.obj", "--outputs", "motion", "-o", "f.png", "--outputs-format", "npy")
    assert "note: motion is 0 in a single picture" in ended.stderr
    assert not np.load(folder / "f.motion.npy").any()


@pytest.mark.parametrize("kind", ["exr", "png", "npy"])
def test_files_are_the_same_to_the_byte(kind: Any) -> None:
    values = np.random.default_rng(0).random((9, 7, 3)).astype(np.float32)
    assert encode_output("normal", values, kind) == encode_output("normal", values.copy(), kind)


def test_numbers_of_any_channels_are_encoded() -> None:
    """One channel per light, and integers of one byte."""
    many = np.random.default_rng(0).random((5, 4, 2)).astype(np.float32)
    assert np.array_equal(np.load(io.BytesIO(encode_output("uv", many, "npy"))), many)
    levels = np.arange(20, dtype=np.uint8).reshape(4, 5)
    assert np.array_equal(quantise("triangle", levels), levels)
    assert quantise("depth", np.array([[-1.0, 1e9]], np.float32)).tolist() == [[0, 65535]]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--outputs", "depth,deep"], r"output: expected one of depth, position, .* but got 'deep'"),
        (["--outputs", ""], "output: expected one of depth"),
        (["--outputs", "triangle", "--outputs-format", "png"], "output triangle: expected exr or npy"),
        (["--outputs-format", "png"], "--outputs-format: expected the option --outputs"),
    ],
)
def test_impossible_outputs_are_refused_before_rendering(
    refused: Callable[..., Any], words: list[str], said: str
) -> None:
    assert re.search(said, refused("head.obj", *words)[0])


def test_unwritable_outputs_are_refused_before_rendering(render: Run, folder: Path) -> None:
    (folder / "f.depth.exr").mkdir()
    ended = render("head.obj", "--outputs", "normal,depth", "-o", "f.png")
    assert ended.code == 2 and "f.depth.exr: expected a file or a free name" in ended.stderr
    assert {path.name for path in folder.iterdir()} == {"head.obj", "f.depth.exr"}
