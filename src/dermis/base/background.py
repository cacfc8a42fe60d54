"""Functions that run in background threads while a page or a window stays responsive."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, NoReturn, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

T = TypeVar("T")
_THREAD_NAME = "dermis-background"


def run_in_thread(task: Callable[[], T]) -> Future[T]:
    """Run a function in a daemon thread, and return a future for its result."""
    from concurrent.futures import Future  # imported here because every command imports this module

    future: Future[T] = Future()
    future.set_running_or_notify_cancel()

    def run_task() -> None:
        try:
            future.set_result(task())
        except Exception as error:
            future.set_exception(error)

    threading.Thread(target=run_task, name=_THREAD_NAME, daemon=True).start()
    return future


def exit_process(code: int) -> NoReturn:
    """Exit the process, even while a function of `run_in_thread` is running.

    In that case, Python's own shutdown is skipped: it would end the thread at its next Python instruction,
    which aborts the process if that instruction is in a callback of a C++ or Rust library.

    code : exit status
    """
    if any(thread.name == _THREAD_NAME for thread in threading.enumerate()):
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                with suppress(OSError):  # the reader of a pipe may have closed it
                    stream.flush()
        os._exit(code)
    sys.exit(code)
