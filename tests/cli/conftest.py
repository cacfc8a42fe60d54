"""The command `dermis`, run inside the test process, and invalid files of all kinds."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from small_head import obj_text, without_colour_note, write_head

from dermis.images.io import write_exr, write_png


class Outcome(NamedTuple):
    """Exit status and output of a command."""

    code: int
    stdout: str
    stderr: str


Run = Callable[..., Outcome]
FORM = re.compile(r"dermis: (?P<error_subject>.+?): expected .+, but .+\. \S.+[.?]\n")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Return a function that runs the command with the given arguments; it must end with an exit status.

    The note that a head has no colour, as most heads of tests, is left out of stderr.
    """
    from dermis.cli import main

    def call(*words: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["dermis", *map(str, words)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capfd.readouterr()
        assert isinstance(ended.value.code, int)
        return Outcome(ended.value.code, out, without_colour_note(err))

    return call


@pytest.fixture(autouse=True)
def plainly_exposed(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace exposure, background and rig by those of Python, except for tests marked `photographed`."""
    if not request.node.get_closest_marker("photographed"):
        monkeypatch.setattr("dermis.cli.scene_options.DEFAULT_RIG", "studio")
        monkeypatch.setattr("dermis.cli.scene_options.PHOTOGRAPHIC_SETTINGS", {"background": (0.0, 0.0, 0.0)})


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, device: object) -> None:
    """Make commands use the device of the test session."""
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)


@pytest.fixture
def unopened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make commands open a device themselves, instead of the one that tests share."""
    from dermis.gpu.device import open_device

    monkeypatch.setattr("dermis.frame.renderer.open_device", open_device)
    monkeypatch.setattr("dermis.gpu.failures.open_device", open_device)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with head.obj that is also the current folder."""
    write_head(tmp_path / "head.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def render(run: Run, folder: Path, opened: None) -> Run:
    """Return a function that runs `dermis render` at a tiny size, given the head and options."""
    return lambda head, *words: run("render", head, "--size", "64x64", "--atlas", "64", *words)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a valid head and with invalid files of all kinds."""
    folder = tmp_path_factory.mktemp("inputs")
    for name, text in _texts().items():
        (folder / name).write_text(text)
    rng = np.random.default_rng(1)
    colours = rng.integers(0, 255, (64, 64, 3), dtype=np.uint8)
    write_png(folder / "grey.png", colours[..., 0])
    write_png(folder / "red.png", colours * np.uint8([1, 0, 0]))
    write_exr(folder / "bright.exr", np.full((32, 32, 3), 9.0))
    _save(folder / "whole.jpg", colours)
    _save(folder / "deep.tif", colours[..., 0].astype(np.int32))
    for whole, short in (("whole.jpg", "short.jpg"), ("grey.png", "short.png")):
        data = (folder / whole).read_bytes()
        (folder / short).write_bytes(data[: len(data) // 2])
    (folder / "folder.png").mkdir()
    (folder / "inputs").mkdir()
    return folder


def _texts() -> dict[str, str]:
    good = obj_text()
    lines = good.splitlines()
    vertices = [k for k, line in enumerate(lines) if line.startswith("v ")]
    return {
        "head.obj": good,
        "text.obj": "This is a letter.\n",
        "head.fbx": "Kaydara",
        "short.obj": "\n".join(lines[: len(vertices) // 2] + lines[-3:]),
        "no_uv.obj": re.sub(r"/\d+", "", re.sub("(?m)^vt .*\n", "", good)),
        "far_uv.obj": re.sub("(?m)^vt .*$", "vt 1.5 0.5", good, count=1),
        "nan.obj": re.sub("(?m)^v .*$", "v nan 0 0", good, count=1),
        "empty.obj": good.replace("usemtl skin", "usemtl skin\nusemtl eyes"),
        "metres.obj": "\n".join(_in_metres(line) for line in lines),
        "words.csv": "variance_mm2,red,green,blue\none,two,three,four\n",
        "falling.csv": "variance_mm2,red,green,blue\n2,1,1,1\n1,1,1,1\n",
        "red.toml": "[skin]\nrho_s = 0\n",
    }


def _in_metres(line: str) -> str:
    if not line.startswith("v "):
        return line
    return "v " + " ".join(str(float(cell) / 1000) for cell in line.split()[1:])


def _save(path: Path, pixels: np.ndarray) -> None:
    from PIL import Image

    Image.fromarray(pixels).save(path)


@pytest.fixture
def refused(
    run: Run, inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., re.Match[str]]:
    """Return a function that runs `dermis render`, checks its clean refusal, and returns the message."""
    monkeypatch.chdir(inputs)

    def call(*words: str, output: str | Path = tmp_path / "out.png") -> re.Match[str]:
        before = {path: path.stat().st_mtime_ns for path in (*inputs.iterdir(), *tmp_path.iterdir())}
        sizes = () if "--size" in words else ("--size", "32x32")
        ended = run(
            "render", *words, "-o", output, *sizes, *(() if "--atlas" in words else ("--atlas", "64"))
        )
        after = {path: path.stat().st_mtime_ns for path in (*inputs.iterdir(), *tmp_path.iterdir())}
        assert (ended.code, ended.stdout, after) == (2, "", before)
        assert "Traceback" not in ended.stderr
        message = FORM.fullmatch(ended.stderr)
        assert message, ended.stderr
        return message

    return call
