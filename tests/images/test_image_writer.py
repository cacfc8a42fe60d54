"""Pictures written on other threads, and errors of writing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.images import writer as writing
from dermis.images.codecs import decode_with_pillow, encode_png
from dermis.images.io import read_image
from dermis.images.writer import ImageWriter


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 9, 1), (13, 7, 3), (40, 61, 4)])
@pytest.mark.parametrize("effort", [1, 6])
def test_png_keeps_every_byte(shape: tuple[int, int, int], effort: int) -> None:
    levels = np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8)
    decoded = decode_with_pillow(encode_png(levels, effort))
    assert np.array_equal(decoded.reshape(shape), levels)


def test_smooth_pictures_are_compressed() -> None:
    ramp = np.linspace(0, 255, 256).astype(np.uint8)
    assert len(encode_png(np.broadcast_to(ramp[:, None, None], (256, 256, 3)).copy())) < 3000


def test_many_pictures_are_all_written(tmp_path: Path) -> None:
    pictures = [np.full((20, 30, 3), k, np.uint8) for k in range(40)]
    with ImageWriter(thread_count=2) as writer:
        for k, picture in enumerate(pictures):
            writer.write(tmp_path / f"{k:02}.png", picture)
        writer.write(tmp_path / "linear.exr", pictures[1].astype(np.float32) / 7)
    for k, picture in enumerate(pictures):
        assert np.array_equal(read_image(tmp_path / f"{k:02}.png"), picture)
    assert np.array_equal(read_image(tmp_path / "linear.exr"), pictures[1].astype(np.float32) / 7)
    assert len(list(tmp_path.iterdir())) == 41  # and nothing half-written


def test_output_folder_is_checked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Checking a folder creates and deletes a file, which takes longer than a frame."""
    tried: list[Path] = []
    check = writing.check_output
    monkeypatch.setattr(writing, "check_output", lambda path: tried.append(path) or check(path))
    picture = np.zeros((2, 2, 3), np.uint8)
    with ImageWriter(thread_count=1) as writer:
        for name in ("a.png", "b.png", "c.exr"):
            writer.write(tmp_path / name, picture.astype(np.float32) if name[0] == "c" else picture)
        with pytest.raises(DermisError, match="no folder"):
            writer.write(tmp_path / "missing" / "d.png", picture)
    assert [path.name for path in tried] == ["a.png", "c.exr", "d.png"]


def test_occupied_path_is_reported_later(tmp_path: Path) -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    (tmp_path / "b.png").mkdir()
    with pytest.raises(DermisError, match=r"b\.png"), ImageWriter(thread_count=1) as writer:
        for name in ("a.png", "b.png"):
            writer.write(tmp_path / name, picture)
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "b.png"}  # and nothing half-written


def test_write_errors_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.zeros((2, 2, 3), np.uint8)
    with ImageWriter(thread_count=1) as writer:
        with pytest.raises(DermisError, match=r"\.jpg: expected"):
            writer.write(tmp_path / "a.jpg", picture)
        for other in (picture.astype(np.float32), picture[..., :2], picture[..., 0]):
            with pytest.raises(DermisError, match="uint8"):
                writer.write(tmp_path / "a.png", other)
        with pytest.raises(DermisError, match="linear floats"):
            writer.write(tmp_path / "a.exr", picture)

    def full(path: Path, levels: object, zlib_level: int) -> None:
        raise DermisError("no space")

    monkeypatch.setattr(writing, "write_png", full)
    with pytest.raises(DermisError, match="no space"), ImageWriter(thread_count=1) as writer:
        writer.write(tmp_path / "a.png", picture)


def test_an_error_of_the_caller_is_not_hidden(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), ImageWriter(thread_count=1) as writer:
        writer.write(tmp_path / "a.png", np.zeros((2, 2, 3), np.uint8))
        raise ZeroDivisionError
