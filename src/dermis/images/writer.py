"""Numbered pictures written on other threads, and which of them are there already."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dermis.base import atomic_write as outputs
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
from dermis.images.codecs import png_size
from dermis.images.hdr import decode_exr
from dermis.images.io import OUTPUT_SUFFIXES, check_output, read_bytes, write_exr, write_png

_FAST_COMPRESSION = 1  # effort of compression
_QUEUE_PER_THREAD = 4
_NUMBER = re.compile(r"%(?:0(\d+))?d")


class ImageWriter:
    """Encodes and writes pictures on other threads; leaving the context waits for all of them.

    threads : one for each core when left out

    with ImageWriter() as writer:
        for number, image in enumerate(renderer.render_many(scenes)):
            writer.write(f"{number:04}.png", image)
    """

    def __init__(self, threads: int | None = None) -> None:
        count = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(count, thread_name_prefix="dermis-images")
        self._most = _QUEUE_PER_THREAD * count
        self._waiting: deque[Future[None]] = deque()
        self._tried: set[tuple[Path, str]] = set()

    def write(self, path: str | Path, picture: NDArray[np.generic]) -> None:
        """Queue a picture to be written, whole or not at all; waits only while the queue is full.

        picture : (H, W, 3 or 4) uint8 sRGB for .png, or linear floats for .exr; do not change it afterwards

        Raises DermisError for a path that cannot be written to, or when an earlier picture failed.
        """
        self._check_folder(Path(path))
        exr = Path(path).suffix.lower() == ".exr"
        actual = f"they have shape {picture.shape} and type {picture.dtype}"
        if exr and not np.issubdtype(picture.dtype, np.floating):
            refuse(path, "linear floats", actual, "Take the renderer's linear picture, or write .png")
        if not exr and (picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] not in (3, 4)):
            refuse(path, "pixels (H, W, 3 or 4) of uint8", actual, "Take the renderer's bytes, or write .exr")
        write = partial(write_exr, swift=True) if exr else partial(write_png, effort=_FAST_COMPRESSION)
        self._waiting.append(self._pool.submit(write, path, picture))
        while len(self._waiting) > self._most or (self._waiting and self._waiting[0].done()):
            self._waiting.popleft().result()

    def _check_folder(self, path: Path) -> None:
        """Refuse a path that cannot be written to; each folder is tried once, as that outlasts a frame."""
        place = path.parent, path.suffix
        if place not in self._tried:
            check_output(path)
            self._tried.add(place)

    def finish(self) -> None:
        """Wait until all is written.

        Raises DermisError when a picture could not be.
        """
        while self._waiting:
            self._waiting.popleft().result()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is None:
                self.finish()
        finally:
            self._pool.shutdown(cancel_futures=True)


@dataclass(frozen=True)
class FrameFiles:
    """Files named by a pattern such as frames/%05d.png.

    Beside them a hidden file says what they are made of.
    """

    pattern: Path

    def path(self, number: int) -> Path:
        """The file of a frame."""
        name = _NUMBER.sub(lambda found: f"{number:0{found[1] or 1}d}", self.pattern.name)
        return self.pattern.with_name(name)

    def prepare(self) -> None:
        """Make the folder and try it.

        Raises DermisError for another pattern, and for a folder that cannot be written to.
        """
        name = self.pattern.name
        if len(_NUMBER.findall(name)) != 1 or name.count("%") != 1:
            refuse(self.pattern, "one place for numbers", f"the name is {name!r}", "Write frames/%05d.png")
        if self.pattern.suffix.lower() not in OUTPUT_SUFFIXES:
            actual = f"the suffix is {self.pattern.suffix!r}"
            refuse(self.pattern, f"frames as {' or '.join(OUTPUT_SUFFIXES)}", actual, "Choose one of them")
        try:
            self.pattern.parent.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            outputs.refuse_output(self.pattern.parent, fault)
        check_output(self.path(0))

    def start(self, made_of: str, *, anew: bool = False) -> None:
        """Frames from before count no more if they are made of something else, or if all are wanted anew.

        made_of : a text that two frames of one number share if they look the same
        """
        if anew or not self._record_matches(made_of):
            with outputs.atomic_file(self._record_path) as trial:
                trial.write_text(made_of, encoding="utf-8")

    def missing(self, numbers: Iterable[int], size: tuple[int, int]) -> list[int]:
        """Those of the frames that are to be drawn: all but files that count, are whole and of this size."""
        begun_ns = self._record_path.stat().st_mtime_ns
        return [number for number in numbers if not _is_complete(self.path(number), size, begun_ns)]

    def _record_matches(self, made_of: str) -> bool:
        """Whether frames are there of which the record says this; a damaged one says nothing."""
        text = made_of.encode()
        try:
            return read_file(self._record_path, "a record of frames", len(text)) == text
        except DermisError:
            return False

    @property
    def _record_path(self) -> Path:
        return self.pattern.with_name(f".{self.pattern.name}.made-of")


def _is_complete(path: Path, size: tuple[int, int], begun_ns: int) -> bool:
    """Whether a picture of this size lies there whole, written since a time."""
    try:
        if not path.is_file() or path.stat().st_mtime_ns < begun_ns:
            return False
        if path.suffix.lower() == ".png":
            return png_size(read_bytes(path)) == size
        height, width = decode_exr(read_bytes(path)).shape[:2]
    except (OSError, ValueError, RuntimeError, DermisError):
        return False
    return (width, height) == size
