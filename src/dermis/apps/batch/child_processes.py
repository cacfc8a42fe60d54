"""Child processes that are spawned without the parent's state and end with their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from multiprocessing.context import SpawnProcess
from typing import Any

from dermis.base.errors import DermisError

_CONTEXT = multiprocessing.get_context("spawn")
_BLOCKS = hasattr(signal, "pthread_sigmask")
_ENDING_S = 1.0  # that a process may take to end after its pipe has broken
_BLAS_THREADS = "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"


@dataclass(frozen=True)
class Child:
    """A process and the end of the pipe that leads to it."""

    process: SpawnProcess
    pipe: Any

    def end(self) -> None:
        """End it at once, whatever it does: what it has not finished is nowhere."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def fate(self) -> str:
        """How a process ended that did not say why."""
        self.process.join()
        code = self.process.exitcode or 0
        if code >= 0:
            return f"it ended with status {code}"
        try:
            return f"it was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"it was ended by signal {-code}"


def start(target: Callable[..., None], *args: Any) -> Child:
    """Start `target(pipe, *args)` in a process of its own, which ends when this one does.

    Ctrl-C, which the terminal sends to all, is left to this one. NumPy has one thread in it.
    """
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_begin, args=(target, theirs, args))
    with _may_start(), _without_interrupts(), _one_thread():
        process.start()
    theirs.close()  # only its process holds it now: when that ends, our end tells
    return Child(process, ours)


def shared_bytes(size: int) -> Any:
    """Memory to be handed to a child at its start, which neither of them has to release."""
    return _CONTEXT.RawArray("B", size)


def _begin(target: Callable[..., None], pipe: Any, args: tuple[Any, ...]) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_leave_with, args=(parent.sentinel,), daemon=True).start()
    try:
        target(pipe, *args)
    except (EOFError, ConnectionError):
        if connection.wait([parent.sentinel], _ENDING_S):
            os._exit(1)  # its pipe broke as it ended: nobody is left to be told
        raise


def _leave_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def _may_start() -> Iterator[None]:
    """Processes of dask are daemons, which multiprocessing denies children; ours end with them anyway."""
    here = multiprocessing.current_process()
    was = here.daemon
    if was:
        here.daemon = False
    try:
        yield
    finally:
        if was:
            here.daemon = True


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let NumPy's linear algebra have one thread, unless the user says how many.

    Of its own it has one for each core, in each process: for the small systems of a person these wait for
    each other in loops, and took twice the processor time of all else.
    """
    ours = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(ours, "1"))
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back: a process that is started meanwhile never gets it, this one gets it afterwards."""
    if not _BLOCKS:
        yield
        return
    resource_tracker.ensure_running()  # which would let them through again when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class LostProcessError(DermisError):
    """A process that ended before its work did."""
