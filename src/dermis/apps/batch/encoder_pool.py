"""Pool of processes that encode rendered images as files, and return the files in the order of the images."""

from __future__ import annotations

import ctypes
import pickle
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection

from dermis.apps.batch.child_processes import ChildProcess, LostProcessError, shared_bytes, start_process
from dermis.base.errors import DermisError

EncodedImage = tuple[int, dict[str, bytes]]
EncoderJob = tuple[object, ...]
_JOBS_IN_FLIGHT_PER_PROCESS = 2
_MEMORY_PAGE_BYTES = 4096
_SPARE_MEMORY_BYTES = 1 << 18  # spare bytes, so that slightly larger jobs do not restart the processes


class EncoderPool:
    """Pool of processes that encode images as files; the images are assigned to the processes in turn.

    process_count : number of processes; if 0, the calling process encodes the images
    encode : picklable function that encodes an image. It is called with the elements of an encoder job as
        arguments, and returns the image's number and a dictionary from file suffix to the bytes of the file
    """

    def __init__(self, process_count: int, encode: Callable[..., EncodedImage]) -> None:
        self._count, self._encode, self._size = process_count, encode, 0
        self._processes: list[_EncoderProcess] = []

    def encode_all(self, jobs: Iterable[EncoderJob]) -> Iterator[EncodedImage]:
        """Yield the encoded images in the order of the jobs, reading a few jobs ahead.

        jobs : arguments of `encode` for each image

        Raises LostProcessError if a process dies, and any DermisError that `encode` raises.
        """
        if not self._count:
            yield from (self._encode(*job) for job in jobs)
            return
        pending: deque[_EncoderProcess] = deque()
        try:
            for index, job in enumerate(jobs):
                parts = _job_buffers(job)
                size = sum(_round_up_to_page(part.nbytes) for part in parts)
                if size > self._size or not self._processes:
                    while pending:
                        yield pending.popleft().result()
                    self._start_processes(size + _SPARE_MEMORY_BYTES)
                if len(pending) == _JOBS_IN_FLIGHT_PER_PROCESS * self._count:
                    yield pending.popleft().result()
                process = self._processes[index % self._count]
                pending.append(process)
                process.submit(parts)
            while pending:
                yield pending.popleft().result()
        finally:
            if pending:  # results that will not be read
                self.close()

    def close(self) -> None:
        """Kill the processes; `encode_all` starts new ones."""
        while self._processes:
            self._processes.pop().child.kill()

    def _start_processes(self, job_bytes: int) -> None:
        """Start the processes with shared memory for jobs of up to `job_bytes` bytes."""
        self.close()
        self._size = job_bytes
        for _ in range(self._count):
            self._processes.append(_EncoderProcess(job_bytes, self._encode))


class _EncoderProcess:
    """Encoder process that receives jobs through shared memory.

    A job is the tuple of arguments with which one image is encoded. The pipe carries only the offsets of the
    jobs in the shared memory, and the encoded images in return. If the pipe carried the jobs, parent and
    child could block, each waiting for the other process to read.

    memory_bytes : largest size of a job [bytes]
    encode : function that encodes an image, see `EncoderPool`
    """

    def __init__(self, memory_bytes: int, encode: Callable[..., EncodedImage]) -> None:
        memory = shared_bytes(_JOBS_IN_FLIGHT_PER_PROCESS * memory_bytes)
        self._size, self._submitted, self._memory = memory_bytes, 0, memoryview(memory).cast("B")
        self.child: ChildProcess = start_process(_run_encoder, memory, encode)

    def submit(self, job_buffers: list[memoryview]) -> None:
        begin, spans = self._submitted % _JOBS_IN_FLIGHT_PER_PROCESS * self._size, []
        self._submitted += 1
        for part in job_buffers:
            spans.append((begin, begin + part.nbytes))
            self._memory[begin : begin + part.nbytes] = part
            begin += _round_up_to_page(part.nbytes)
        try:
            self.child.pipe.send(spans)
        except OSError as fault:
            raise self._lost_error() from fault

    def result(self) -> EncodedImage:
        try:
            encoded, message = self.child.pipe.recv()
        except (EOFError, OSError) as fault:
            raise self._lost_error() from fault
        if encoded is None:
            raise DermisError(message)
        return encoded  # type: ignore[no-any-return]

    def _lost_error(self) -> LostProcessError:
        return LostProcessError(f"an encoder process: {self.child.exit_reason()}")


def _job_buffers(job: EncoderJob) -> list[memoryview]:
    """Return a job as buffers for shared memory: a pickle without arrays, then the bytes of each array."""
    arrays: list[pickle.PickleBuffer] = []
    pickled = pickle.dumps(job, protocol=5, buffer_callback=arrays.append)
    return [memoryview(pickled), *(array.raw() for array in arrays)]


def _round_up_to_page(byte_count: int) -> int:
    return -(-byte_count // _MEMORY_PAGE_BYTES) * _MEMORY_PAGE_BYTES


def _run_encoder(
    pipe: Connection, shared_memory: ctypes.Array[ctypes.c_ubyte], encode: Callable[..., EncodedImage]
) -> None:
    """Encode jobs until the pipe is closed; an encoder process runs this function.

    pipe : pipe that delivers the byte ranges of each job in shared memory, and returns the encoded images
    shared_memory : memory shared with the parent process, which writes the jobs into it
    encode : function that encodes an image, see `EncoderPool`
    """
    view = memoryview(shared_memory).cast("B")
    while True:
        try:
            pickled, *arrays = [view[begin:end] for begin, end in pipe.recv()]
        except EOFError:
            return
        job = pickle.loads(pickled, buffers=arrays)
        try:
            pipe.send((encode(*job), ""))
        except DermisError as fault:
            pipe.send((None, str(fault)))
