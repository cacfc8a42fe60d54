"""Standard streams and signal handling of the process that runs a command.

A failed write to stdout or stderr does not raise an exception; the failure is reported once, when the command
ends. Ctrl-C and signals that ask the process to end raise KeyboardInterrupt, so that no file is left
half-written.
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

# modes of null devices that replace closed standard streams
_STREAM_OPEN_MODES = os.O_RDONLY, os.O_RDONLY, os.O_WRONLY


class StandardStreams:
    """Context manager that replaces stdout and stderr by streams whose write methods never raise.

    If a stream is already closed at the start, all writes to it fail. The file descriptor of such a stream is
    reserved; otherwise the next opened file would get this descriptor, and libraries would print into that
    file.
    """

    def __enter__(self) -> Self:
        """Replace sys.stdout and sys.stderr."""
        for descriptor, mode in enumerate(_STREAM_OPEN_MODES):
            _reserve_descriptor(descriptor, mode)
        self._original = sys.stdout, sys.stderr
        self._raw: list[_GuardedStream] = []
        if sys.stdout is sys.__stdout__:
            sys.stdout = self._guarded_stream(sys.stdout, 1)
        if sys.stderr is sys.__stderr__:
            sys.stderr = self._guarded_stream(sys.stderr, 2)
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Flush the replacement streams and restore the original ones."""
        for stream, original in zip((sys.stdout, sys.stderr), self._original, strict=True):
            if stream is not original:
                stream.flush()
        sys.stdout, sys.stderr = self._original

    def stdout_error(self) -> OSError | None:
        """Return the first error of a write to stdout, or None; a closed pipe does not count as an error."""
        sys.stdout.flush()
        faults = [raw.fault for raw in self._raw if raw.descriptor == 1]
        return next((fault for fault in faults if not isinstance(fault, BrokenPipeError)), None)

    def discard_stdout(self) -> None:
        """Discard all further output to stdout, as its reader may have been interrupted as well."""
        for raw in self._raw:
            if raw.descriptor == 1:
                raw.fault = raw.fault or BrokenPipeError()

    def _guarded_stream(self, original_stream: TextIO | None, descriptor: int) -> TextIO:
        inner: Any = original_stream.buffer if original_stream else io.FileIO(descriptor, "w", closefd=False)
        raw = _GuardedStream(getattr(inner, "raw", inner), descriptor)
        self._raw.append(raw)
        return io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=original_stream.encoding if original_stream else "utf-8",
            errors="backslashreplace",  # for characters outside the encoding, and undecodable file names
            line_buffering=descriptor == 2 or raw.isatty(),
        )


class _GuardedStream(io.RawIOBase):
    """Raw output stream that discards all data after the first failed write.

    inner : raw stream that receives the data
    descriptor : file descriptor of the stream
    fault : error of the first failed write; None until then
    """

    def __init__(self, raw_stream: io.RawIOBase, descriptor: int) -> None:
        self._inner, self.descriptor = raw_stream, descriptor
        self.fault: OSError | None = None

    def write(self, data: ReadableBuffer, /) -> int:
        """Write as many bytes as possible and return their number."""
        while self.fault is None:
            try:
                if (written := self._inner.write(data)) is not None:
                    return written
                select.select([], [self.descriptor], [])  # wait: the stream is non-blocking and full
            except OSError as fault:
                self.fault = fault
        return memoryview(data).nbytes

    def writable(self) -> bool:
        """Return True: the stream accepts data even after a failed write."""
        return True

    def fileno(self) -> int:
        """Return the file descriptor of the stream."""
        return self.descriptor

    def isatty(self) -> bool:
        """Return whether the stream is a terminal."""
        return self._inner.isatty()


def _reserve_descriptor(descriptor: int, open_mode: int) -> None:
    """Open the null device at a file descriptor, 0 to 2, unless that descriptor is already open."""
    try:
        os.fstat(descriptor)
    except OSError:
        null_device = os.open(os.devnull, open_mode)
        if null_device != descriptor:
            os.dup2(null_device, descriptor)
            os.close(null_device)
        else:
            os.set_inheritable(descriptor, True)


_HANDLED_SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
# earlier repetitions are ignored: intermediate programs may send a signal twice
_MIN_SECOND_SIGNAL_DELAY_S = 0.5
_SIGNAL_RETRY_S = 0.02
# exceptions leave half-imported modules or half-created event loops, or are lost in Rust
_UNINTERRUPTIBLE_PACKAGES = {"importlib", "asyncio", "pydantic"}
_DRIVER_PACKAGES = {"wgpu", "glfw"}
_RETRY_BYTE, _END_BYTE = b"\0", b"\xff"  # bytes that are not signal numbers
_SIGNAL_EXIT_BASE = 128  # exit status after a signal, minus the number of the signal


class Interruption:
    """Context manager that raises KeyboardInterrupt once, after Ctrl-C, SIGTERM or SIGHUP.

    A second signal ends the process immediately, even while the main thread is inside a driver or another
    library. A signal whose handler was already replaced, by the parent process or by a library, keeps that
    handler.

    code : exit status for the received signal; 0 without a signal
    """

    def __init__(self) -> None:
        self.code = 0
        self._is_raised = self._is_postponed = False
        self._original: dict[int, Handler] = {}
        self._resent = 0  # signals that this object sent again

    def __enter__(self) -> Self:
        """Install the signal handlers; do nothing outside the main thread."""
        if threading.current_thread() is not threading.main_thread():
            return self
        for signal_number in _HANDLED_SIGNALS:
            handler = signal.getsignal(signal_number)
            if handler in (signal.SIG_DFL, signal.default_int_handler):
                self._original[signal_number] = handler
                signal.signal(signal_number, self._handle_signal)
        self._original_hook, sys.unraisablehook = sys.unraisablehook, self._on_unraisable
        self._reading, self._writing = socket.socketpair()
        self._writing.setblocking(False)
        self._original_fd = signal.set_wakeup_fd(self._writing.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._watch_signals, daemon=True, name="dermis-signals")
        self._thread.start()
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the previous signal handlers."""
        if threading.current_thread() is not threading.main_thread():
            return
        for signal_number, handler in self._original.items():
            signal.signal(signal_number, signal.SIG_DFL if self.code else handler)
        signal.set_wakeup_fd(self._original_fd)
        sys.unraisablehook = self._original_hook
        self._writing.send(_END_BYTE)
        self._thread.join()
        self._writing.close()

    def _handle_signal(self, signal_number: int, stack_frame: FrameType | None) -> None:
        self.code = self.code or _SIGNAL_EXIT_BASE + signal_number
        if self._is_raised:
            return
        if (loop := _running_loop()) is not None:  # raised inside a task, asyncio would print it
            self._is_raised = True
            loop.call_soon_threadsafe(_raise_keyboard_interrupt)
        elif _caller_swallows_exceptions(stack_frame):
            self._raise_interrupt_later()
        else:
            self._is_raised = True
            _raise_keyboard_interrupt()

    def _raise_interrupt_later(self) -> None:
        self._is_raised, self._is_postponed = False, True
        self._writing.send(_RETRY_BYTE)

    def _on_unraisable(self, error: sys.UnraisableHookArgs) -> None:
        """Raise a KeyboardInterrupt again later if Python has discarded it, as in a destructor."""
        if self.code and issubclass(error.exc_type, KeyboardInterrupt):
            self._raise_interrupt_later()
        else:
            self._original_hook(error)

    def _watch_signals(self) -> None:
        """Wait for signals in a thread: end the process after a second signal, and repeat a postponed signal.

        A separate thread is needed because the main thread handles signals only between Python instructions,
        not inside a library.
        """
        first_signal_s = 0.0
        with self._reading:
            while True:
                if not select.select(
                    [self._reading], [], [], _SIGNAL_RETRY_S if self._is_postponed else None
                )[0]:
                    self._is_postponed = False
                    self._send_signal_again()
                    continue
                received = self._reading.recv(1)
                if received == _END_BYTE:
                    return
                if received[0] not in self._original or signal.getsignal(received[0]) != self._handle_signal:
                    continue  # a server has installed its own handler
                if self._resent:
                    self._resent -= 1
                elif not first_signal_s:
                    first_signal_s = time.monotonic()
                elif time.monotonic() - first_signal_s > _MIN_SECOND_SIGNAL_DELAY_S:
                    os._exit(_SIGNAL_EXIT_BASE + received[0])

    def _send_signal_again(self) -> None:
        self._resent += 1
        signal_number = self.code - _SIGNAL_EXIT_BASE
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(threading.main_thread().ident or 0, signal_number)
        else:
            signal.raise_signal(signal_number)


def _raise_keyboard_interrupt() -> None:
    raise KeyboardInterrupt


def _running_loop() -> AbstractEventLoop | None:
    """Return the asyncio event loop that runs in the main thread, or None."""
    if (asyncio := sys.modules.get("asyncio")) is None:
        return None
    try:
        loop: AbstractEventLoop = asyncio.get_running_loop()
    except RuntimeError:
        return None
    return loop


def _caller_swallows_exceptions(stack_frame: FrameType | None) -> bool:
    """Return whether a library on the call stack would swallow an exception that is raised now.

    This is the case during callbacks of a graphics driver, during imports, and while asyncio creates a loop.

    stack_frame : innermost frame of the call stack
    """
    while stack_frame is not None:
        package, name = (
            str(stack_frame.f_globals.get("__name__")).partition(".")[0],
            stack_frame.f_code.co_name,
        )
        if package in _UNINTERRUPTIBLE_PACKAGES or (package in _DRIVER_PACKAGES and "callback" in name):
            return True
        stack_frame = stack_frame.f_back
    return False
