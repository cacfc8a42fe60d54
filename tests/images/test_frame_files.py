"""Frames of a folder that need not be rendered again."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.images.codecs import encode_png, png_size
from dermis.images.io import write_exr, write_png
from dermis.images.writer import FrameFiles

SIZE = (6, 4)
PICTURE = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)


def _files(folder: Path, name: str = "%03d.png") -> FrameFiles:
    files = FrameFiles(folder / "frames" / name)
    files.prepare_folder()
    return files


def test_frame_names_are_numbered() -> None:
    assert FrameFiles(Path("a/%05d.png")).path(7) == Path("a/00007.png")
    assert FrameFiles(Path("a%b/face-%d.exr")).path(12) == Path("a%b/face-12.exr")


@pytest.mark.parametrize("name", ["%s.png", "%02d-%02d.png", "%5d.png", "100%-%d.png", "%d.jpg", "%d"])
def test_invalid_patterns_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(DermisError):
        FrameFiles(tmp_path / "new" / name).prepare_folder()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["%03d.png", "%d.exr"])
def test_complete_frames_of_the_same_run_are_kept(tmp_path: Path, name: str) -> None:
    files = _files(tmp_path, name)
    files.start_sequence("a smile")
    assert files.missing_frames(range(4), SIZE) == [0, 1, 2, 3]
    for k in range(4):
        if name.endswith("png"):
            write_png(files.path(k), PICTURE)
        else:
            write_exr(files.path(k), PICTURE.astype(np.float32))
    data = files.path(2).read_bytes()
    files.path(2).write_bytes(data[: 3 * len(data) // 4])
    files.path(0).write_bytes(b"")
    files.start_sequence("a smile")
    assert files.missing_frames(range(5), SIZE) == [0, 2, 4]
    assert files.missing_frames([1, 3], (4, 6)) == [1, 3]


def test_frames_of_other_runs_are_drawn_again(tmp_path: Path) -> None:
    files = _files(tmp_path)
    files.start_sequence("a smile")
    for k in range(2):
        write_png(files.path(k), PICTURE)
        os.utime(files.path(k), (1e9, 1e9 + k))
    os.utime(files.pattern.with_name(".%03d.png.made-of"), (1e9, 1e9))
    assert files.missing_frames(range(2), SIZE) == []
    files.start_sequence("a frown")
    write_png(files.path(1), PICTURE)
    files.start_sequence("a frown")
    assert files.missing_frames(range(2), SIZE) == [0]
    os.utime(files.path(1), (1e9, 1e9))
    files.start_sequence("a frown", force=True)
    assert files.missing_frames(range(2), SIZE) == [0, 1]


@pytest.mark.parametrize("damage", ["no text", "empty", "large", "a pipe"])
def test_damaged_record_is_ignored(tmp_path: Path, damage: str) -> None:
    files = _files(tmp_path)
    files.start_sequence("a smile")
    write_png(files.path(0), PICTURE)
    record = files.pattern.with_name(".%03d.png.made-of")
    if damage == "a pipe":
        record.unlink()
        os.mkfifo(record)
    else:
        record.write_bytes({"no text": b"\xff\xfe", "empty": b"", "large": b"a smile" * 99}[damage])
    files.start_sequence("a smile")
    assert record.read_bytes() == b"a smile"
    os.utime(files.path(0), (1e9, 1e9))
    assert files.missing_frames([0], SIZE) == [0]


def test_pipe_is_not_a_frame(tmp_path: Path) -> None:
    files = _files(tmp_path)
    files.start_sequence("a smile")
    os.mkfifo(files.path(0))
    assert files.missing_frames([0], SIZE) == [0]


def test_png_is_checked_without_decoding() -> None:
    data = encode_png(PICTURE)
    assert png_size(data) == SIZE
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    for bad in (data[:-1], data[:40], data[:8], b"", b"GIF89a", bytes(damaged)):
        with pytest.raises(ValueError):
            png_size(bad)
