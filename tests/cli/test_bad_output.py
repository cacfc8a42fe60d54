"""Locations that cannot be written to: no partial files remain, and existing files are kept."""

from __future__ import annotations

import errno
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]
OUTPUTS = {
    "without suffix": ("picture", "no suffix"),
    "gif": ("picture.gif", "'.gif'"),
    "folder missing": ("nowhere/picture.png", "no folder"),
    "folder is a file": ("head.obj/picture.png", "no folder"),
    "a folder": ("folder.png", "something else"),
}


@pytest.mark.parametrize("bad", OUTPUTS.values(), ids=OUTPUTS)
def test_output_is_refused_before_anything_is_loaded(refused: Run, bad: tuple[str, str]) -> None:
    output, actual = bad
    message = refused("nobody.obj", output=output)
    assert message["error_subject"] == output and actual in message[0]


def test_folder_that_may_not_be_written(refused: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "touch", forbidden)
    assert "Permission denied" in refused("nobody.obj")[0]


def test_disk_that_fills_up(
    refused: Run, opened: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out.png").write_bytes(b"the picture of yesterday")
    whole = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        whole(path, data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    message = refused("head.obj")
    assert message["error_subject"].endswith("out.png") and "No space left" in message[0]
    assert (tmp_path / "out.png").read_bytes() == b"the picture of yesterday"


def test_disk_that_fills_up_under_an_exr(
    refused: Run, opened: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: object, path: str) -> None:
        Path(path).write_bytes(b"half")
        raise RuntimeError("cannot write image file")

    monkeypatch.setattr("OpenEXR.File.write", full)
    message = refused("head.obj", output=tmp_path / "out.exr")
    assert message["error_subject"].endswith("out.exr") and "cannot write" in message[0]


def test_interruption_leaves_nothing(
    run: Run, inputs: Path, tmp_path: Path, opened: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(path: Path, data: bytes) -> int:
        path.touch()
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", interrupted)
    ended = run("render", inputs / "head.obj", "-o", tmp_path / "out.png", "--size", "32x32", "--atlas", "64")
    assert (ended.code, ended.stdout, ended.stderr) == (130, "", "")
    assert list(tmp_path.iterdir()) == []
