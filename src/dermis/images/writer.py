"""Pictures written by other threads, so that the next one need not wait."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dermis import outputs
from dermis.errors import refuse
from dermis.images.codecs import encode_png8
from dermis.images.io import check_output, write_exr

_SWIFT = 1  # effort of compression: a picture of a sequence is one of many
_WAITING_PER_THREAD = 4


class ImageWriter:
    """Encodes and writes pictures on threads while the caller goes on; leaving the context waits for all.

    threads : as many as there are cores when left out

    with ImageWriter() as writer:
        for number, image in enumerate(renderer.render_many(scenes)):
            writer.write(f"{number:04}.png", image)
    """

    def __init__(self, threads: int | None = None) -> None:
        count = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(count, thread_name_prefix="dermis-images")
        self._most = _WAITING_PER_THREAD * count
        self._waiting: deque[Future[None]] = deque()
        self._tried: set[tuple[Path, str]] = set()

    def write(self, path: str | Path, picture: NDArray[Any]) -> None:
        """Write a picture some time soon, whole or not at all; waits only when too many are waiting already.

        picture : (H, W, 3) uint8 sRGB for .png, or linear floats for .exr; not to be changed afterwards

        Raises DermisError when the path cannot be, or when an earlier picture could not be written.
        """
        self._try(Path(path))
        exr = Path(path).suffix.lower() == ".exr"
        came = f"they have shape {picture.shape} and type {picture.dtype}"
        if exr and not np.issubdtype(picture.dtype, np.floating):
            refuse(path, "linear floats", came, "Take the renderer's linear picture, or write .png")
        if not exr and (picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3):
            refuse(path, "pixels (H, W, 3) of uint8", came, "Take the renderer's bytes, or write .exr")
        work: Callable[..., None] = _write_exr if exr else _write_png
        self._waiting.append(self._pool.submit(work, path, picture))
        while len(self._waiting) > self._most or (self._waiting and self._waiting[0].done()):
            self._waiting.popleft().result()

    def _try(self, path: Path) -> None:
        """Refuse what cannot be; a folder is tried once, for that takes longer than a frame."""
        place = path.parent, path.suffix
        if place not in self._tried:
            check_output(path)
            self._tried.add(place)

    def finish(self) -> None:
        """Wait until all is written.

        Raises DermisError when something could not be.
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


def _write_png(path: str | Path, levels: NDArray[np.uint8]) -> None:
    with outputs.replacing(path) as temporary:
        temporary.write_bytes(encode_png8(levels, _SWIFT))


def _write_exr(path: str | Path, linear: NDArray[np.floating[Any]]) -> None:
    write_exr(path, linear, swift=True)
