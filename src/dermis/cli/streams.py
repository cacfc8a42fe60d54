"""Standard streams that cannot fail where they are used: what went wrong is told once, at the end."""

from __future__ import annotations

import io
import os
import select
import sys
from types import TracebackType
from typing import Any, Self, TextIO

_USES = (os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)  # of what takes the place of a closed stdin, stdout, stderr


class Streams:
    """Guards stdout and stderr, where they are the process's own, inside a `with` block.

    A stream that was closed is as one that cannot be written to; its number is taken, or the next file that
    is opened would get it, and what libraries print would land in there.
    """

    def __enter__(self) -> Self:
        for number, use in enumerate(_USES):
            _occupy(number, use)
        self._usual = sys.stdout, sys.stderr
        self._raw: list[_Guarded] = []
        if sys.stdout is sys.__stdout__:
            sys.stdout = self._guarded(sys.stdout, 1)
        if sys.stderr is sys.__stderr__:
            sys.stderr = self._guarded(sys.stderr, 2)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream, usual in zip((sys.stdout, sys.stderr), self._usual, strict=True):
            if stream is not usual:
                stream.flush()
        sys.stdout, sys.stderr = self._usual

    def fault(self) -> OSError | None:
        """Why something on stdout was lost; a reader that left, as `head` does, is no fault."""
        sys.stdout.flush()
        faults = [raw.fault for raw in self._raw if raw.number == 1]
        return next((one for one in faults if not isinstance(one, BrokenPipeError)), None)

    def drop(self) -> None:
        """Write no more to stdout: it may be held up, and nobody wants the rest of an interrupted command."""
        for raw in self._raw:
            if raw.number == 1:
                raw.fault = raw.fault or BrokenPipeError()

    def _guarded(self, usual: TextIO | None, number: int) -> TextIO:
        inner: Any = usual.buffer if usual else io.FileIO(number, "w", closefd=False)
        raw = _Guarded(getattr(inner, "raw", inner), number)
        self._raw.append(raw)
        return io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=usual.encoding if usual else "utf-8",
            errors="backslashreplace",  # of what the encoding lacks, and of names that are no text
            line_buffering=number == 2 or raw.isatty(),
        )


class _Guarded(io.RawIOBase):
    """Writes to a stream until that fails, and drops the rest.

    fault : the first failure
    """

    def __init__(self, inner: io.RawIOBase, number: int) -> None:
        self._inner, self.number = inner, number
        self.fault: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Take all of it, or as much as goes at once."""
        while self.fault is None:
            try:
                if (written := self._inner.write(data)) is not None:
                    return written
                select.select([], [self.number], [])  # it does not block, and is full
            except OSError as fault:
                self.fault = fault
        return len(data)

    def writable(self) -> bool:
        """Yes, as far as its user can tell."""
        return True

    def fileno(self) -> int:
        """The stream's number."""
        return self.number

    def isatty(self) -> bool:
        """Whether somebody may be looking."""
        return self._inner.isatty()


def _occupy(number: int, use: int) -> None:
    """Take the number of a stream if it is closed."""
    try:
        os.fstat(number)
    except OSError:
        empty = os.open(os.devnull, use)
        if empty != number:
            os.dup2(empty, number)
            os.close(empty)
        else:
            os.set_inheritable(number, True)
