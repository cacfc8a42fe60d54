"""Standard streams and signals of the process that runs a command.

Writing to stdout or stderr never fails where it is used: the fault is reported once, at the end. Ctrl-C and
signals that ask the process to end raise an exception, so that no file is left half-written.
"""

from __future__ import annotations

import io
import os
import select
import signal
import socket
import sys
import threading
import time
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from collections.abc import Callable

    from _typeshed import ReadableBuffer

    Handler = Callable[[int, FrameType | None], Any] | int | signal.Handlers | None

_OPEN_MODES = (os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)  # of what takes the place of a closed stdin, stdout, stderr


class StandardStreams:
    """Guards stdout and stderr, where they are the process's own, inside a `with` block.

    A closed stream is treated as one that cannot be written to. Its number is occupied, as the next file that
    is opened would get it otherwise, and libraries would print into that file.
    """

    def __enter__(self) -> Self:
        for number, use in enumerate(_OPEN_MODES):
            _reserve_descriptor(number, use)
        self._usual = sys.stdout, sys.stderr
        self._raw: list[_GuardedStream] = []
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
        """Return why output on stdout was lost; a reader that closes the pipe is no fault."""
        sys.stdout.flush()
        faults = [raw.fault for raw in self._raw if raw.number == 1]
        return next((one for one in faults if not isinstance(one, BrokenPipeError)), None)

    def drop(self) -> None:
        """Discard the rest of stdout: its reader may block, and the command was interrupted."""
        for raw in self._raw:
            if raw.number == 1:
                raw.fault = raw.fault or BrokenPipeError()

    def _guarded(self, usual: TextIO | None, number: int) -> TextIO:
        inner: Any = usual.buffer if usual else io.FileIO(number, "w", closefd=False)
        raw = _GuardedStream(getattr(inner, "raw", inner), number)
        self._raw.append(raw)
        return io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=usual.encoding if usual else "utf-8",
            errors="backslashreplace",  # of what the encoding lacks, and of names that are no text
            line_buffering=number == 2 or raw.isatty(),
        )


class _GuardedStream(io.RawIOBase):
    """Writes to a stream until that fails, and drops the rest.

    fault : the first failure
    """

    def __init__(self, inner: io.RawIOBase, number: int) -> None:
        self._inner, self.number = inner, number
        self.fault: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        """Write as many bytes as possible at once; return their number."""
        while self.fault is None:
            try:
                if (written := self._inner.write(data)) is not None:
                    return written
                select.select([], [self.number], [])  # it does not block, and is full
            except OSError as fault:
                self.fault = fault
        return memoryview(data).nbytes

    def writable(self) -> bool:
        """Return True: faults are reported at the end only."""
        return True

    def fileno(self) -> int:
        """Return the file descriptor."""
        return self.number

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._inner.isatty()


def _reserve_descriptor(number: int, use: int) -> None:
    """Open the null device under a stream's number if the stream is closed."""
    try:
        os.fstat(number)
    except OSError:
        empty = os.open(os.devnull, use)
        if empty != number:
            os.dup2(empty, number)
            os.close(empty)
        else:
            os.set_inheritable(number, True)


_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_SECOND_SIGNAL_S = 0.5  # a second one so late is another; programs in between send the same one twice
_RETRY_S = 0.02
_UNSAFE_PACKAGES = {"importlib", "pydantic"}  # modules half imported, and what calls back from Rust
_DRIVERS = {"wgpu", "glfw"}
_RETRY, _END = b"\0", b"\xff"  # no signals
_SIGNAL_EXIT_BASE = 128  # a shell's status of what a signal ended, less the signal's number


class Interruption:
    """Raises KeyboardInterrupt once for Ctrl-C, SIGTERM or SIGHUP inside a `with` block.

    At a second signal the process ends at once, also while the main thread is in a driver or another library.
    Signals that the caller ignores or handles are left alone.

    code : the exit status that follows; 0 before any signal
    """

    def __init__(self) -> None:
        self.code = 0
        self._is_raised = self._is_late = False
        self._usual: dict[int, Handler] = {}
        self._sent = 0  # by ourselves

    def __enter__(self) -> Self:
        if threading.current_thread() is not threading.main_thread():
            return self
        for number in _SIGNALS:
            usual = signal.getsignal(number)
            if usual in (signal.SIG_DFL, signal.default_int_handler):
                self._usual[number] = usual
                signal.signal(number, self._handle)
        self._usual_hook, sys.unraisablehook = sys.unraisablehook, self._on_unraisable
        self._reading, self._writing = socket.socketpair()
        self._writing.setblocking(False)
        self._before = signal.set_wakeup_fd(self._writing.fileno(), warn_on_full_buffer=False)
        self._watching = threading.Thread(target=self._watch, daemon=True, name="dermis-signals")
        self._watching.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        for number, usual in self._usual.items():
            signal.signal(number, signal.SIG_DFL if self.code else usual)
        signal.set_wakeup_fd(self._before)
        sys.unraisablehook = self._usual_hook
        self._writing.send(_END)
        self._watching.join()
        self._writing.close()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.code = self.code or _SIGNAL_EXIT_BASE + number
        if self._is_raised:
            return
        if (loop := _running_loop()) is not None:  # from one of its tasks asyncio would print it
            self._is_raised = True
            loop.call_soon_threadsafe(_interrupt)
        elif _would_be_swallowed(frame):
            self._raise_later()
        else:
            self._is_raised = True
            _interrupt()

    def _raise_later(self) -> None:
        self._is_raised, self._is_late = False, True
        self._writing.send(_RETRY)

    def _on_unraisable(self, lost: sys.UnraisableHookArgs) -> None:
        """Handle an exception that Python cannot raise, as in a destructor."""
        if self.code and issubclass(lost.exc_type, KeyboardInterrupt):
            self._raise_later()
        else:
            self._usual_hook(lost)

    def _watch(self) -> None:
        """Receive signals, which the main thread does only between two steps of Python."""
        asked_s = 0.0
        with self._reading:
            while True:
                if not select.select([self._reading], [], [], _RETRY_S if self._is_late else None)[0]:
                    self._is_late = False
                    self._send_again()
                    continue
                arrived = self._reading.recv(1)
                if arrived == _END:
                    return
                if arrived[0] not in self._usual or signal.getsignal(arrived[0]) != self._handle:
                    continue  # a server shuts down by its own rules
                if self._sent:
                    self._sent -= 1
                elif not asked_s:
                    asked_s = time.monotonic()
                elif time.monotonic() - asked_s > _SECOND_SIGNAL_S:
                    os._exit(_SIGNAL_EXIT_BASE + arrived[0])

    def _send_again(self) -> None:
        self._sent += 1
        number = self.code - _SIGNAL_EXIT_BASE
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(threading.main_thread().ident or 0, number)
        else:
            signal.raise_signal(number)


def _interrupt() -> None:
    raise KeyboardInterrupt


def _running_loop() -> AbstractEventLoop | None:
    """Return the event loop of asyncio in which the main thread runs, if any."""
    if (asyncio := sys.modules.get("asyncio")) is None:
        return None
    try:
        loop: AbstractEventLoop = asyncio.get_running_loop()
    except RuntimeError:
        return None
    return loop


def _would_be_swallowed(frame: FrameType | None) -> bool:
    """Return whether libraries between the frame and its callers would swallow an exception."""
    while frame is not None:
        package, name = str(frame.f_globals.get("__name__")).partition(".")[0], frame.f_code.co_name
        if package in _UNSAFE_PACKAGES or (package in _DRIVERS and "callback" in name):
            return True
        frame = frame.f_back
    return False
