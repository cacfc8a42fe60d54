"""Uniform data of a frame's passes, collected while passes are recorded and uploaded in one write."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.types import Buffer

CHUNK_BYTES = 1 << 18
_ALIGNMENT = 256  # WebGPU's default alignment of uniforms in a buffer


class Uniforms:
    """Positions of records in the uniform buffers that all frames of a device share.

    The queue orders the writes of a frame after the frames that were submitted before it.

    chunk : function that returns a buffer of CHUNK_BYTES by its index; the device's buffers if None
    """

    def __init__(self, device: Device, chunk: Callable[[int], Buffer] | None = None) -> None:
        self._device = device
        self._chunk = chunk or partial(device.uniform_chunk, size=CHUNK_BYTES)
        self._staged: list[bytearray] = []
        self._end = CHUNK_BYTES
        # The record itself is kept so that its id stays unique.
        self._bytes: dict[int, tuple[bytes, NDArray[np.generic]]] = {}
        self._positions: dict[int, int] = {}

    def bytes_of(self, record: NDArray[np.generic]) -> bytes:
        """Return the bytes of a record, which must not be changed until the frame is submitted."""
        found = self._bytes.get(id(record))
        if found is None:
            found = self._bytes[id(record)] = record.tobytes(), record
        return found[0]

    def position(self, record: NDArray[np.generic]) -> int:
        """Return the position of a record, counted through all buffers [byte]."""
        found = self._positions.get(id(record))
        if found is None:
            found = self._positions[id(record)] = self._add(self.bytes_of(record))
        return found

    def locate(self, position: int) -> tuple[Buffer, int]:
        """Return the buffer that a position is in, and the offset in it [byte]."""
        index, offset = divmod(position, CHUNK_BYTES)
        return self._chunk(index), offset

    def upload(self) -> None:
        """Write all records to their buffers before the next submission."""
        for index, staged in enumerate(self._staged):
            last = index == len(self._staged) - 1
            self._device.write(self._chunk(index), staged, self._end if last else CHUNK_BYTES)

    def finish(self) -> None:
        """Drop all records after the last submission, and keep their host memory for other frames."""
        self._device.spare_chunks.extend(self._staged)
        self.clear()

    def clear(self) -> None:
        """Drop all records."""
        self._staged, self._end = [], CHUNK_BYTES
        self._bytes.clear()
        self._positions.clear()

    def _add(self, record: bytes) -> int:
        size = len(record)
        if self._end + size > CHUNK_BYTES:
            spare = self._device.spare_chunks
            self._staged.append(spare.pop() if spare else bytearray(CHUNK_BYTES))
            self._end = 0
        start = self._end
        self._staged[-1][start : start + size] = record
        self._end += -(-size // _ALIGNMENT) * _ALIGNMENT
        return (len(self._staged) - 1) * CHUNK_BYTES + start
