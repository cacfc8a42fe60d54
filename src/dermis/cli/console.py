"""What the commands print: results on stdout, progress and notes on stderr."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from dermis.errors import refuse


def print_json(value: Any) -> None:
    """One JSON value and nothing else on stdout; numbers that JSON cannot have, such as NaN, are null."""
    print_lines(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_lines(*lines: str) -> None:
    """Lines of a result on stdout; a reader that leaves early, as `head` does, is no fault."""
    try:
        sys.stdout.write("\n".join(lines) + "\n")
        sys.stdout.flush()
    except OSError as fault:
        # What is left over goes nowhere, or Python would try again as it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(fault, BrokenPipeError):
            refuse("stdout", "a place to write to", f"it fails ({fault.strerror})", "Write it elsewhere")


def note(text: str) -> None:
    """A remark on stderr."""
    sys.stderr.write(text + "\n")


@contextmanager
def progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr, moved by how much is done of how much; silent when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield lambda done, of: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what)
        yield lambda done, of: bar.update(task, completed=done, total=of)


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """A check to be called between two frames, which raises KeyboardInterrupt once Ctrl-C was pressed.

    Raised right away it could land in a callback of the driver and be lost; pressed again, it is.
    """
    pressed = threading.Event()

    def remember(*_: object) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    def check() -> None:
        if pressed.is_set():
            raise KeyboardInterrupt

    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not usual or threading.current_thread() is not threading.main_thread():
        yield check
        return
    signal.signal(signal.SIGINT, remember)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def working_on(what: str) -> Iterator[None]:
    """A spinner on stderr while something takes its time; silent when stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(what):
        yield
