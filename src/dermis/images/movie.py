"""H.264 movies in MP4 files, encoded on another thread so that rendering need not wait."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.errors import format_value, refuse
from dermis.base.extras import import_extra
from dermis.base.quantities import checked_array, checked_integer

MOVIE_SUFFIX = ".mp4"
DEFAULT_CRF = 18
"""Constant rate factor at which rendered skin shows no compression artefacts."""
_MAX_CRF, _VIDEO_ENCODER, _ENCODER_PRESET = 51, "libx264", "medium"
_FFMPEG_BT709, _FFMPEG_LIMITED_RANGE = 1, 1  # H.264's codes of the colour space, and of levels from 16 to 235
_MAX_QUEUED_FRAMES = 8
_MAX_FRAME_SIDE_PIXELS = 1 << 14  # largest side of a frame in H.264
_NTSC_RATES = tuple(Fraction(1000 * rate, 1001) for rate in (24, 30, 48, 60, 120))
_NTSC_TOLERANCE = Fraction(5, 1000)
_FRAME_RATE_PATTERN = re.compile(
    r"\d{1,9}(\.\d{1,20})?(/\d{1,9}|e[-+]?\d{1,2})?"
)  # limits the digits, because exponents of fractions are expensive
_MAX_FRAME_RATE, _MAX_FRAME_RATE_DENOMINATOR = 1000, 1001


def parse_frame_rate(frame_rate: str | float | Fraction, error_subject: object = "rate") -> Fraction:
    """Return a frame rate as an exact fraction, because rounded frame times would drift.

    frame_rate : frame rate such as 30, 12.5 or "24000/1001" [1/s]; 23.976 means 24000/1001, and likewise
        29.97 and 59.94 mean the exact NTSC rates
    error_subject : name of the option or argument, for error messages

    Raises DermisError for values that are not a frame rate above 0 and up to 1000.
    """
    text = (
        str(frame_rate).strip()
        if isinstance(frame_rate, str | float | Fraction)
        else format_value(frame_rate)
    )
    try:
        rate = Fraction(text if _FRAME_RATE_PATTERN.fullmatch(text) else 0)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not 0 < rate <= _MAX_FRAME_RATE:
        expected = f"frames a second up to {_MAX_FRAME_RATE}, such as 30, 23.976 or 24000/1001"
        refuse(error_subject, expected, f"got {format_value(text)}", "Correct it")
    nearest = min(_NTSC_RATES, key=lambda ntsc: abs(ntsc - rate))
    rate = (
        nearest
        if abs(nearest - rate) < _NTSC_TOLERANCE
        else rate.limit_denominator(_MAX_FRAME_RATE_DENOMINATOR)
    )
    return max(rate, Fraction(1, _MAX_FRAME_RATE_DENOMINATOR))


def check_movie(path: str | Path, frame_size: tuple[int, int], crf: int = DEFAULT_CRF) -> Path:
    """Check before a long computation that a movie can be written to a path, and return the path.

    frame_size : width and height of the frames [pixel]
    crf : constant rate factor, from 0 (only the conversion to 8-bit YUV 4:2:0 loses detail) to 51

    Raises DermisError when the path is not writable, a side is odd, the rate factor is invalid, or there is
    no encoder.
    """
    target = check_output(path, (MOVIE_SUFFIX,), f"Give it the suffix {MOVIE_SUFFIX}")
    checked_array("--size", frame_size, (2,), 1, _MAX_FRAME_SIDE_PIXELS, "pixels")
    if frame_size[0] % 2 or frame_size[1] % 2:
        even = f"{frame_size[0] + frame_size[0] % 2}x{frame_size[1] + frame_size[1] % 2}"
        actual = f"got {frame_size[0]}x{frame_size[1]}"
        refuse(
            "--size",
            f"even width and height, which {MOVIE_SUFFIX} requires",
            actual,
            f"Use {even}, or write frames/%05d.png",
        )
    checked_integer("--crf", crf, 0, _MAX_CRF, f"0 is the best quality, {DEFAULT_CRF} the default")
    _check_encoder(path)
    return target


def _check_encoder(path: str | Path) -> None:
    av = import_extra("av", "movies")
    try:
        av.codec.Codec(_VIDEO_ENCODER, "w")
    except ValueError:
        advice = "Install av from PyPI (pip install av), or write frames/%05d.png"
        refuse(path, f"FFmpeg with the encoder {_VIDEO_ENCODER}", "the installed PyAV lacks it", advice)


class MovieWriter:
    """Writer of an H.264 movie, which encodes on another thread and writes the file atomically.

    Frame k is shown at exactly k / rate. Pixels are converted to YCbCr by the matrix of BT.709, and the file
    declares BT.709 as its colour space.

    Parameters
    ----------
    path : str or Path
        File to write, .mp4.
    size : tuple of int
        Width and height of the frames [pixel], both even.
    rate : str, float or Fraction, optional
        Frames per second, such as 30, 23.976 or "24000/1001".
    crf : int, optional
        Constant rate factor, from 0 (best: only the conversion to 8-bit YUV 4:2:0 loses detail) to 51.

    Raises
    ------
    DermisError
        The path is not writable, an argument is invalid, or there is no encoder.

    Examples
    --------
    >>> with MovieWriter("smile.mp4", (1024, 1024)) as movie:  # doctest: +SKIP
    ...     for image in renderer.render_many(scenes):
    ...         movie.write(image)
    """

    def __init__(
        self,
        path: str | Path,
        size: tuple[int, int],
        rate: str | float | Fraction = 30,
        crf: int = DEFAULT_CRF,
    ) -> None:
        self.path, self.size, self.rate = check_movie(path, size, crf), size, parse_frame_rate(rate)
        self._crf, self._count = crf, 0
        self._queue: deque[Future[None]] = deque()
        self._context = self._movie_file_context()

    def __enter__(self) -> Self:
        """Open the movie file."""
        self._context.__enter__()
        return self

    def __exit__(self, *exception: Any) -> None:
        """Finish the movie and close the file; after an error, remove the file."""
        self._context.__exit__(*exception)

    @contextmanager
    def _movie_file_context(self) -> Iterator[None]:
        with atomic_file(self.path) as temporary:
            self._open_movie(temporary)
            try:
                yield
                self._finish()
            finally:
                self._pool.shutdown(cancel_futures=True)
                self._container.close()

    def _open_movie(self, path: Path) -> None:
        import av
        from av.video.reformatter import VideoReformatter

        self._container = av.open(str(path), "w", format="mp4", options={"movflags": "faststart"})
        options = {"crf": str(self._crf), "preset": _ENCODER_PRESET}
        self._stream = self._container.add_stream(_VIDEO_ENCODER, rate=self.rate, options=options)
        self._stream.width, self._stream.height = self.size
        self._stream.pix_fmt = "yuv420p"
        codec = self._stream.codec_context
        codec.time_base, codec.color_range = 1 / self.rate, _FFMPEG_LIMITED_RANGE
        codec.colorspace = codec.color_primaries = codec.color_trc = _FFMPEG_BT709
        self._reformatter = VideoReformatter()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="dermis-movie")

    def write(self, picture: NDArray[np.generic]) -> None:
        """Queue the next frame; the call blocks only while the queue is full.

        Parameters
        ----------
        picture : numpy.ndarray
            (H, W, 3) uint8 sRGB; the array must not be changed afterwards.

        Raises
        ------
        DermisError
            The picture has another shape or type, or an earlier frame could not be written.
        """
        width, height = self.size
        if picture.shape != (height, width, 3) or picture.dtype != np.uint8:
            actual = f"they have shape {picture.shape} and type {picture.dtype}"
            expected = f"pixels ({height}, {width}, 3) of uint8"
            refuse(self.path, expected, actual, "Use the renderer's sRGB picture")
        self._queue.append(self._pool.submit(self._encode, self._count, picture))
        self._count += 1
        while len(self._queue) > _MAX_QUEUED_FRAMES or (self._queue and self._queue[0].done()):
            self._queue.popleft().result()

    def _encode(self, frame_index: int, picture: NDArray[np.generic]) -> None:
        import av
        from av.video.reformatter import ColorRange, Colorspace

        frame = self._reformatter.reformat(
            av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24"),
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            src_color_range=ColorRange.JPEG,
            dst_color_range=ColorRange.MPEG,
        )
        frame.pts, frame.time_base = frame_index, 1 / self.rate
        self._container.mux(self._stream.encode(frame))

    def _finish(self) -> None:
        """Wait until all queued frames are encoded, and flush the encoder."""
        while self._queue:
            self._queue.popleft().result()
        if self._count == 0:
            refuse(self.path, "a movie of at least one frame", "got none", "Write a frame")
        self._container.mux(self._stream.encode(None))
