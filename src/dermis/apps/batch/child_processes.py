"""Child processes that are spawned with a fresh interpreter and exit with their parent."""

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

_SPAWN_CONTEXT = multiprocessing.get_context("spawn")
_CAN_BLOCK_SIGNALS = hasattr(signal, "pthread_sigmask")
_PARENT_EXIT_TIMEOUT_S = 1.0  # wait for the parent's exit after the pipe has broken
_BLAS_THREAD_VARIABLES = "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"


class LostProcessError(DermisError):
    """Error raised when a child process ended before completing the work; the work can be repeated."""


@dataclass(frozen=True)
class ChildProcess:
    """Child process, and the parent's end of the pipe to the child process."""

    process: SpawnProcess
    pipe: Connection

    def kill(self) -> None:
        """Kill the process immediately and close the pipe."""
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def exit_reason(self) -> str:
        """Wait for the process to exit and describe its exit status or signal."""
        self.process.join()
        code = self.process.exitcode or 0
        if code >= 0:
            return f"it exited with status {code}"
        try:
            return f"it was killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"it was killed by signal {-code}"


def start_process(target: Callable[..., None], *args: object) -> ChildProcess:
    """Start `target(pipe, *args)` in a child process that exits when this process exits.

    The child ignores Ctrl-C, which a terminal sends to all processes, and uses one thread for linear algebra.
    """
    parent_pipe, child_pipe = _SPAWN_CONTEXT.Pipe()
    process = _SPAWN_CONTEXT.Process(target=_run_in_child, args=(target, child_pipe, args))
    with _allow_child_processes(), _block_sigint(), _limit_blas_to_one_thread():
        process.start()
    child_pipe.close()  # the parent's end now breaks when the child dies
    return ChildProcess(process, parent_pipe)


def shared_bytes(byte_count: int) -> ctypes.Array[ctypes.c_ubyte]:
    """Return memory to share with a process from `start_process`, freed when both processes have exited.

    byte_count : size of the memory [bytes]
    """
    return _SPAWN_CONTEXT.RawArray(ctypes.c_ubyte, byte_count)


def _run_in_child(
    child_function: Callable[..., None], pipe: Connection, child_arguments: tuple[object, ...]
) -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_exit_with_parent, args=(parent.sentinel,), daemon=True).start()
    try:
        child_function(pipe, *child_arguments)
    except (EOFError, ConnectionError):
        if connection.wait([parent.sentinel], _PARENT_EXIT_TIMEOUT_S):
            os._exit(1)  # the pipe broke because the parent exited
        raise


def _exit_with_parent(parent_sentinel: int) -> None:
    connection.wait([parent_sentinel])
    os._exit(1)


@contextmanager
def _allow_child_processes() -> Iterator[None]:
    """Allow a daemon process, such as a dask worker, to start children, which multiprocessing forbids."""
    current = multiprocessing.current_process()
    was_daemon = current.daemon
    if was_daemon:
        current.daemon = False
    try:
        yield
    finally:
        if was_daemon:
            current.daemon = True


@contextmanager
def _limit_blas_to_one_thread() -> Iterator[None]:
    """Limit BLAS in child processes to one thread, unless the user has set a number of threads.

    By default, BLAS starts one thread per core in each process. For small linear systems, these threads spend
    most of their time waiting for each other.
    """
    unset = [name for name in _BLAS_THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))
    try:
        yield
    finally:
        for name in unset:
            del os.environ[name]


@contextmanager
def _block_sigint() -> Iterator[None]:
    """Block SIGINT (Ctrl-C) within a with block; children started in the block ignore SIGINT permanently."""
    if not _CAN_BLOCK_SIGNALS:
        yield
        return
    resource_tracker.ensure_running()  # the tracker unblocks SIGINT when it starts, so start it first
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)
