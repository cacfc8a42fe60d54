"""Child processes that are spawned without the parent's state and end with their parent."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from dermis.base.errors import DermisError

_CONTEXT = multiprocessing.get_context("spawn")
_CAN_BLOCK_SIGNALS = hasattr(signal, "pthread_sigmask")
_PARENT_EXIT_S = 1.0  # that a process may take to end after its pipe has broken
_BLAS_THREADS = "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"


class LostProcessError(DermisError):
    """A process that ended before its work was complete; another one does it again."""


@dataclass(frozen=True)
class ChildProcess:
    """Child process and the parent's end of the pipe to it."""

    process: SpawnProcess
    pipe: Connection

    def end(self) -> None:
        """Kill it at once, whatever it does."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def fate(self) -> str:
        """Describe how a process ended that did not say why."""
        self.process.join()
        code = self.process.exitcode or 0
        if code >= 0:
            return f"it ended with status {code}"
        try:
            return f"it was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"it was ended by signal {-code}"


def start(target: Callable[..., None], *args: object) -> ChildProcess:
    """Start `target(pipe, *args)` in a child process, which ends when this one does.

    Ctrl-C, which the terminal sends to all processes, is left to this one. NumPy has one thread in the child.
    """
    ours, theirs = _CONTEXT.Pipe()
    process = _CONTEXT.Process(target=_begin, args=(target, theirs, args))
    with _children_allowed(), _sigint_blocked(), _single_threaded_blas():
        process.start()
    theirs.close()  # only the child holds it now, so that our end reports its death
    return ChildProcess(process, ours)


def shared_bytes(size: int) -> ctypes.Array[ctypes.c_ubyte]:
    """Return shared memory for an argument of `start`, which neither process has to release."""
    return _CONTEXT.RawArray(ctypes.c_ubyte, size)


def _begin(target: Callable[..., None], pipe: Connection, args: tuple[object, ...]) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_exit_with_parent, args=(parent.sentinel,), daemon=True).start()
    try:
        target(pipe, *args)
    except (EOFError, ConnectionError):
        if connection.wait([parent.sentinel], _PARENT_EXIT_S):
            os._exit(1)  # the pipe broke because the parent ended
        raise


def _exit_with_parent(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def _children_allowed() -> Iterator[None]:
    """Allow children of dask's daemon processes, which multiprocessing forbids; ours end with them anyway."""
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
def _single_threaded_blas() -> Iterator[None]:
    """Limit NumPy's linear algebra to one thread in children, unless the user sets a number.

    The default is one for each core in each process: for the small systems of a person these spin, and took
    twice the processor time of everything else.
    """
    ours = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(ours, "1"))
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Block SIGINT: a process that is started meanwhile never gets it, this one gets it afterwards."""
    if not _CAN_BLOCK_SIGNALS:
        yield
        return
    resource_tracker.ensure_running()  # which would let them through again when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
