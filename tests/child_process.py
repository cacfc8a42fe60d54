"""Processes started by tests with the default actions of signals.

Children inherit ignored signals: a test run under nohup ignores SIGHUP, a background job of a shell SIGINT.
"""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def start(command: list[str], **options: Any) -> subprocess.Popen[Any]:
    """Start a process as `subprocess.Popen` does, with no signal of ENDING ignored."""
    with default_signals():
        return subprocess.Popen(command, **options)


@contextmanager
def default_signals() -> Iterator[None]:
    """Handle the signals of ENDING as Python does in the foreground."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in ENDING}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)


@contextmanager
def ignored_signals() -> Iterator[None]:
    """Ignore the signals of ENDING, as for a background process started by `nohup`."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in ENDING}
    try:
        yield
    finally:
        for number, action in before.items():
            signal.signal(number, action)
