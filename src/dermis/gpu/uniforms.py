"""Uniform records of a frame's passes, collected while passes are recorded and uploaded together."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.types import Buffer

UNIFORM_CHUNK_BYTES = 1 << 18
_RECORD_ALIGNMENT_BYTES = 256  # WebGPU's default alignment of uniforms in a buffer


class Uniforms:
    """Allocator of uniform records in buffers that all frames of a device share.

    Sharing is safe because the queue orders the writes of a frame after the submissions of earlier frames.

    make_chunk : function from an index to a buffer of UNIFORM_CHUNK_BYTES; None for the device's buffers
    """

    def __init__(self, device: Device, make_chunk: Callable[[int], Buffer] | None = None) -> None:
        self._device = device
        self._chunk = make_chunk or partial(device.uniform_chunk, chunk_bytes=UNIFORM_CHUNK_BYTES)
        self._staged: list[bytearray] = []
        self._end = UNIFORM_CHUNK_BYTES
        # The record itself is kept so that its id stays unique.
        self._bytes: dict[int, tuple[bytes, NDArray[np.generic]]] = {}
        self._positions: dict[int, int] = {}

    def bytes_of(self, record: NDArray[np.generic]) -> bytes:
        """Return the bytes of a record, which must not change until the frame is submitted."""
        found = self._bytes.get(id(record))
        if found is None:
            found = self._bytes[id(record)] = record.tobytes(), record
        return found[0]

    def position(self, record: NDArray[np.generic]) -> int:
        """Return the position of a record in uniform memory, placing the record on first use [byte].

        Positions are counted across all buffers; `locate` converts a position to a buffer and an offset.
        """
        found = self._positions.get(id(record))
        if found is None:
            found = self._positions[id(record)] = self._add_record(self.bytes_of(record))
        return found

    def locate(self, uniform_position: int) -> tuple[Buffer, int]:
        """Return the buffer for a position in uniform memory, and the offset in this buffer [byte]."""
        index, offset = divmod(uniform_position, UNIFORM_CHUNK_BYTES)
        return self._chunk(index), offset

    def upload(self) -> None:
        """Write all collected uniform records to their buffers, so that the next submission reads them."""
        for index, staged in enumerate(self._staged):
            last = index == len(self._staged) - 1
            self._device.write(self._chunk(index), staged, self._end if last else UNIFORM_CHUNK_BYTES)

    def finish(self) -> None:
        """Forget all records after the last submission; keep their host memory for later frames."""
        self._device.spare_chunks.extend(self._staged)
        self.clear()

    def clear(self) -> None:
        """Forget all records."""
        self._staged, self._end = [], UNIFORM_CHUNK_BYTES
        self._bytes.clear()
        self._positions.clear()

    def _add_record(self, record: bytes) -> int:
        size = len(record)
        if self._end + size > UNIFORM_CHUNK_BYTES:
            spare = self._device.spare_chunks
            self._staged.append(spare.pop() if spare else bytearray(UNIFORM_CHUNK_BYTES))
            self._end = 0
        start = self._end
        self._staged[-1][start : start + size] = record
        self._end += -(-size // _RECORD_ALIGNMENT_BYTES) * _RECORD_ALIGNMENT_BYTES
        return (len(self._staged) - 1) * UNIFORM_CHUNK_BYTES + start
