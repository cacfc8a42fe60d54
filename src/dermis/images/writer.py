"""Pictures written on other threads, so that rendering need not wait."""

from __future__ import annotations

import os
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.images.io import check_output, write_exr, write_png

_FAST = 1  # effort of compression
_WAITING_PER_THREAD = 4


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
        self._most = _WAITING_PER_THREAD * count
        self._waiting: deque[Future[None]] = deque()
        self._tried: set[tuple[Path, str]] = set()

    def write(self, path: str | Path, picture: NDArray[Any]) -> None:
        """Queue a picture to be written, whole or not at all; waits only while the queue is full.

        picture : (H, W, 3 or 4) uint8 sRGB for .png, or linear floats for .exr; do not change it afterwards

        Raises DermisError for a path that cannot be written to, or when an earlier picture failed.
        """
        self._try(Path(path))
        exr = Path(path).suffix.lower() == ".exr"
        came = f"they have shape {picture.shape} and type {picture.dtype}"
        if exr and not np.issubdtype(picture.dtype, np.floating):
            refuse(path, "linear floats", came, "Take the renderer's linear picture, or write .png")
        if not exr and (picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] not in (3, 4)):
            refuse(path, "pixels (H, W, 3 or 4) of uint8", came, "Take the renderer's bytes, or write .exr")
        write = partial(write_exr, swift=True) if exr else partial(write_png, effort=_FAST)
        self._waiting.append(self._pool.submit(write, path, picture))
        while len(self._waiting) > self._most or (self._waiting and self._waiting[0].done()):
            self._waiting.popleft().result()

    def _try(self, path: Path) -> None:
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
