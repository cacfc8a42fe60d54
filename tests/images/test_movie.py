"""Movies have all frames, at exact times and in known colours, or there is no file."""

from __future__ import annotations

import errno
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.images.movie import MovieWriter, check_movie, parse_frame_rate

SIZE = (64, 48)
COLOURS = np.random.default_rng(3).integers(0, 256, (30, 3))


def _plain(colour: Any) -> np.ndarray:
    return np.full((SIZE[1], SIZE[0], 3), colour, np.uint8)


def _write(path: Path, rate: Any = 30, crf: int = 18) -> Path:
    with MovieWriter(path, SIZE, rate, crf) as movie:
        for colour in COLOURS:
            movie.write(_plain(colour))
    return path


@pytest.mark.parametrize("rate", [30, "24000/1001", 12.5, 59.94])
def test_frame_times_are_multiples_of_the_frame_time(tmp_path: Path, rate: Any) -> None:
    exact = parse_frame_rate(rate)
    with av.open(str(_write(tmp_path / "a.mp4", rate))) as file:
        stream = file.streams.video[0]
        times = [frame.pts * frame.time_base for frame in file.decode(stream)]
        assert stream.average_rate == exact and stream.duration * stream.time_base == len(COLOURS) / exact
    assert times == [k / exact for k in range(len(COLOURS))]


def test_colours_survive_and_are_tagged(tmp_path: Path) -> None:
    with av.open(str(_write(tmp_path / "a.mp4"))) as file:
        stream = file.streams.video[0]
        codec = stream.codec_context
        tags = (codec.color_primaries, codec.color_trc, codec.colorspace, codec.color_range)
        assert tags == (1, 1, 1, 1) and (codec.name, codec.pix_fmt) == ("h264", "yuv420p")
        images = [frame.to_ndarray(format="rgb24", src_colorspace=1) for frame in file.decode(stream)]
    for image, colour in zip(images, COLOURS, strict=True):
        assert np.abs(image.astype(int) - colour).max() <= 5  # 8-bit YUV, and the encoder's own error


def test_lower_quality_factor_gives_smaller_error(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (SIZE[1], SIZE[0], 3), dtype=np.uint8)
    for name, crf in (("good", 5), ("bad", 45)):
        with MovieWriter(tmp_path / f"{name}.mp4", SIZE, crf=crf) as movie:
            movie.write(noise)
    assert (tmp_path / "good.mp4").stat().st_size > 2 * (tmp_path / "bad.mp4").stat().st_size


@pytest.mark.parametrize(
    ("given", "exact"),
    [
        ("30", Fraction(30)),
        (23.976, Fraction(24000, 1001)),
        ("23.98", Fraction(24000, 1001)),
        (30000 / 1001, Fraction(30000, 1001)),
        ("59.94", Fraction(60000, 1001)),
        ("25", Fraction(25)),
        ("12.5", Fraction(25, 2)),
        ("1/3", Fraction(1, 3)),
        (24.0, Fraction(24)),
    ],
)
def test_rates_are_ratios(given: Any, exact: Fraction) -> None:
    assert parse_frame_rate(given) == exact


@pytest.mark.parametrize("given", ["", "0", "-30", "nan", "inf", "fast", "30/0", "1e9"])
def test_invalid_rates_are_refused(given: str) -> None:
    with pytest.raises(DermisError, match=r"^--fps: expected frames a second .*24000/1001"):
        parse_frame_rate(given, "--fps")


def test_error_leaves_the_existing_movie(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(b"yesterday's")
    for fault in (KeyboardInterrupt, ZeroDivisionError):
        with pytest.raises(fault), MovieWriter(path, SIZE) as movie:
            for colour in COLOURS:
                movie.write(_plain(colour))
            raise fault
    assert path.read_bytes() == b"yesterday's" and list(tmp_path.iterdir()) == [path]


def test_full_disk_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(MovieWriter, "_encode", full)
    with pytest.raises(DermisError, match=r"a\.mp4: expected a writable path.*No space left"):
        _write(tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


def test_invalid_movie_options_are_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mp4"
    with pytest.raises(DermisError, match=r"--size: expected even width and height.*got 63x48\. Use 64x48"):
        check_movie(path, (63, 48))
    with pytest.raises(DermisError, match=r"--crf: expected a whole number from 0 to 51 .*, but got 52"):
        check_movie(path, SIZE, 52)
    with pytest.raises(DermisError, match=r"ends in \.mp4"):
        check_movie(tmp_path / "a.avi", SIZE)
    with pytest.raises(DermisError, match="at least one frame"), MovieWriter(path, SIZE):
        pass
    with pytest.raises(DermisError, match=r"pixels \(48, 64, 3\)"), MovieWriter(path, SIZE) as movie:
        movie.write(np.zeros((64, 48, 3), np.uint8))
    monkeypatch.setattr("dermis.images.movie._VIDEO_ENCODER", "no such encoder")
    with pytest.raises(DermisError, match=r"no such encoder.*Install av"):
        check_movie(path, SIZE)
    assert list(tmp_path.iterdir()) == []
