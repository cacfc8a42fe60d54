"""Writing of numbered pictures on other threads; an interrupted sequence can be continued."""

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

from dermis.base.atomic_write import atomic_file, refuse_output
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
from dermis.images.codecs import png_size
from dermis.images.hdr import decode_exr
from dermis.images.io import OUTPUT_SUFFIXES, check_output, read_bytes, write_exr, write_png

_FAST_ZLIB_LEVEL = 1  # zlib level
_QUEUED_PICTURES_PER_THREAD = 4
_NUMBER_PLACEHOLDER = re.compile(r"%(?:0(\d+))?d")


class ImageWriter:
    """Context manager that encodes and writes pictures on other threads; on exit, it waits for all pictures.

    thread_count : number of threads; by default, one thread per processor core

    Example:

    with ImageWriter() as writer:
        for number, image in enumerate(renderer.render_many(scenes)):
            writer.write(f"{number:04}.png", image)
    """

    def __init__(self, thread_count: int | None = None) -> None:
        count = thread_count or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(count, thread_name_prefix="dermis-images")
        self._max_queued = _QUEUED_PICTURES_PER_THREAD * count
        self._queue: deque[Future[None]] = deque()
        self._checked_folders: set[tuple[Path, str]] = set()

    def write(self, path: str | Path, picture: NDArray[np.generic]) -> None:
        """Queue a picture to be written atomically; the call blocks only while the queue is full.

        picture : (H, W, C) with 3 or 4 channels: uint8 sRGB for .png, linear floats for .exr; the array must
            not be changed afterwards

        Raises DermisError for a path that is not writable, and when an earlier picture could not be written.
        """
        self._check_folder(Path(path))
        is_exr = Path(path).suffix.lower() == ".exr"
        actual = f"they have shape {picture.shape} and type {picture.dtype}"
        if is_exr and not np.issubdtype(picture.dtype, np.floating):
            refuse(path, "linear floats", actual, "Use the renderer's linear picture, or write .png")
        if not is_exr and (picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] not in (3, 4)):
            advice = "Use the renderer's sRGB picture, or write .exr"
            refuse(path, "pixels (H, W, 3 or 4) of uint8", actual, advice)
        write = (
            partial(write_exr, use_run_length_encoding=True)
            if is_exr
            else partial(write_png, zlib_level=_FAST_ZLIB_LEVEL)
        )
        self._queue.append(self._pool.submit(write, path, picture))
        while len(self._queue) > self._max_queued or (self._queue and self._queue[0].done()):
            self._queue.popleft().result()

    def _check_folder(self, path: Path) -> None:
        """Check that a path is writable, but only once per folder and suffix, because checks are slow."""
        key = path.parent, path.suffix
        if key not in self._checked_folders:
            check_output(path)
            self._checked_folders.add(key)

    def finish(self) -> None:
        """Wait until all pictures are written.

        Raises DermisError when a picture could not be written.
        """
        while self._queue:
            self._queue.popleft().result()

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for all pictures unless there was an error, and stop the threads."""
        try:
            if error is None:
                self.finish()
        finally:
            self._pool.shutdown(cancel_futures=True)


@dataclass(frozen=True)
class FrameFiles:
    """Numbered picture files of a sequence, named by a pattern such as frames/%05d.png.

    The content key of a sequence is a text that is equal for sequences with equal frames, such as a hash of
    everything that determines the frames. A hidden file next to the pictures stores the content key of the
    sequence that was started last, so that this sequence can be continued.

    pattern : path of the pictures, with a placeholder such as %05d for the number of the frame
    """

    pattern: Path

    def path(self, frame_number: int) -> Path:
        """Return the path of the picture of a frame.

        frame_number : number of the frame
        """
        name = _NUMBER_PLACEHOLDER.sub(lambda found: f"{frame_number:0{found[1] or 1}d}", self.pattern.name)
        return self.pattern.with_name(name)

    def prepare_folder(self) -> None:
        """Create the folder and check that it is writable.

        Raises DermisError for an invalid pattern, and for a folder that is not writable.
        """
        name = self.pattern.name
        if len(_NUMBER_PLACEHOLDER.findall(name)) != 1 or name.count("%") != 1:
            actual = f"the name is {name!r}"
            refuse(self.pattern, "one placeholder for the number", actual, "Write frames/%05d.png")
        if self.pattern.suffix.lower() not in OUTPUT_SUFFIXES:
            actual = f"the suffix is {self.pattern.suffix!r}"
            refuse(self.pattern, f"frames as {' or '.join(OUTPUT_SUFFIXES)}", actual, "Choose one of them")
        try:
            self.pattern.parent.mkdir(parents=True, exist_ok=True)
        except OSError as fault:
            refuse_output(self.pattern.parent, fault)
        check_output(self.path(0))

    def start_sequence(self, content_key: str, *, force: bool = False) -> None:
        """Start a sequence, or continue the previous one if it has the same content key.

        A sequence that is continued keeps its pictures on disk; for a new sequence, `missing_frames` treats
        them as missing.

        content_key : text that is equal for sequences with equal frames
        force : whether to start a new sequence even if the content keys are equal
        """
        if force or not self._record_matches(content_key):
            with atomic_file(self._record_path) as temporary:
                temporary.write_text(content_key, encoding="utf-8")

    def missing_frames(self, frame_numbers: Iterable[int], picture_size: tuple[int, int]) -> list[int]:
        """Return the frame numbers whose pictures are missing, incomplete, or belong to another sequence.

        frame_numbers : frame numbers to check
        picture_size : width and height of the pictures [pixel]
        """
        start_ns = self._record_path.stat().st_mtime_ns
        return [
            number for number in frame_numbers if not _is_complete(self.path(number), picture_size, start_ns)
        ]

    def _record_matches(self, content_key: str) -> bool:
        """Return whether the hidden file stores the same content key as `content_key`.

        If it does, the pictures on disk belong to a sequence with equal frames.
        """
        text = content_key.encode()
        try:
            return read_file(self._record_path, "a record of frames", len(text)) == text
        except DermisError:
            return False

    @property
    def _record_path(self) -> Path:
        return self.pattern.with_name(f".{self.pattern.name}.made-of")


def _is_complete(picture_path: Path, picture_size: tuple[int, int], start_ns: int) -> bool:
    """Return whether a file is a complete picture of a given size, written after the sequence was started.

    start_ns : time at which the sequence was started, as a file modification time [ns]
    """
    try:
        if not picture_path.is_file() or picture_path.stat().st_mtime_ns < start_ns:
            return False
        if picture_path.suffix.lower() == ".png":
            return png_size(read_bytes(picture_path)) == picture_size
        height, width = decode_exr(read_bytes(picture_path)).shape[:2]
    except (OSError, ValueError, RuntimeError, DermisError):
        return False
    return (width, height) == picture_size
