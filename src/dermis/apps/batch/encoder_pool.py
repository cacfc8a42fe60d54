"""Processes that encode the images of a worker, a few images ahead, in order."""

from __future__ import annotations

import ctypes
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection
from typing import Self

from dermis.apps.batch.child_processes import ChildProcess, LostProcessError, shared_bytes, start
from dermis.base.errors import DermisError

EncodedImage = tuple[int, dict[str, bytes]]
Job = tuple[object, ...]
_JOBS_IN_FLIGHT = 2  # jobs in flight of each process
_PAGE_BYTES = 4096
_SIZE_MARGIN = 1 << 18  # bytes by which a job may be larger than the first one


class EncoderPool:
    """Pool of processes that call `encode(*job)` in turn.

    count : number of processes; 0 encodes in this one
    encode : a function that can be pickled
    """

    def __init__(self, count: int, encode: Callable[..., EncodedImage]) -> None:
        self._count, self._encode, self._size = count, encode, 0
        self._lanes: list[_EncoderProcess] = []

    def encoded(self, jobs: Iterable[Job]) -> Iterator[EncodedImage]:
        """Return the results of `encode` in the order of the jobs, which are taken a few ahead.

        Raises LostProcessError where one of the processes ends, and errors of `encode`.
        """
        if not self._count:
            yield from (self._encode(*job) for job in jobs)
            return
        waiting: deque[_EncoderProcess] = deque()
        try:
            for turn, job in enumerate(jobs):
                parts = _parts(job)
                if (size := sum(_page_aligned(part.nbytes) for part in parts)) > self._size or not self._lanes:
                    while waiting:
                        yield waiting.popleft().take()
                    self._open(size + _SIZE_MARGIN)
                if len(waiting) == _JOBS_IN_FLIGHT * self._count:
                    yield waiting.popleft().take()
                lane = self._lanes[turn % self._count]
                waiting.append(lane)
                lane.give(parts)
            while waiting:
                yield waiting.popleft().take()
        finally:
            if waiting:  # their results will not be read
                self.close()

    def close(self) -> None:
        """End the processes; they are started again when needed."""
        while self._lanes:
            self._lanes.pop().child.end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _open(self, size: int) -> None:
        """Start the processes for jobs of at most `size` bytes."""
        self.close()
        self._size = size
        for _ in range(self._count):
            self._lanes.append(_EncoderProcess(size, self._encode))


class _EncoderProcess:
    """Process with shared memory for its jobs, whose places go through the pipe.

    Jobs do not go through the pipe, where both ends could wait for each other to read.
    """

    def __init__(self, size: int, encode: Callable[..., EncodedImage]) -> None:
        memory = shared_bytes(_JOBS_IN_FLIGHT * size)
        self._size, self._turn, self._memory = size, 0, memoryview(memory).cast("B")
        self.child: ChildProcess = start(_serve, memory, encode)

    def give(self, parts: list[memoryview]) -> None:
        begin, spans = self._turn % _JOBS_IN_FLIGHT * self._size, []
        self._turn += 1
        for part in parts:
            spans.append((begin, begin + part.nbytes))
            self._memory[begin : begin + part.nbytes] = part
            begin += _page_aligned(part.nbytes)
        try:
            self.child.pipe.send(spans)
        except OSError as fault:
            raise self._lost() from fault

    def take(self) -> EncodedImage:
        try:
            encoded, refusal = self.child.pipe.recv()
        except (EOFError, OSError) as fault:
            raise self._lost() from fault
        if encoded is None:
            raise DermisError(refusal)
        return encoded  # type: ignore[no-any-return]

    def _lost(self) -> LostProcessError:
        return LostProcessError(f"a process that encodes images: {self.child.fate()}")


def _parts(job: Job) -> list[memoryview]:
    """Return the pickle of a job without its arrays, and the bytes of these."""
    arrays: list[pickle.PickleBuffer] = []
    head = pickle.dumps(job, protocol=5, buffer_callback=arrays.append)
    return [memoryview(head), *(array.raw() for array in arrays)]


def _page_aligned(size: int) -> int:
    return -(-size // _PAGE_BYTES) * _PAGE_BYTES


def _serve(pipe: Connection, memory: ctypes.Array[ctypes.c_ubyte], encode: Callable[..., EncodedImage]) -> None:
    """Encode jobs from the pipe, in a process of the pool."""
    view = memoryview(memory).cast("B")
    while True:
        try:
            head, *arrays = [view[begin:end] for begin, end in pipe.recv()]
        except EOFError:
            return
        job = pickle.loads(head, buffers=arrays)
        try:
            pipe.send((encode(*job), ""))
        except DermisError as fault:
            pipe.send((None, str(fault)))
