"""Uniform data of one frame's passes: gathered while passes are recorded, uploaded in one write."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.types import Buffer

CHUNK_BYTES = 1 << 18
_STEP = 256  # WebGPU's default alignment of uniforms in a buffer


class Uniforms:
    """Places for records in the uniform buffers that all frames of a device share.

    What a frame writes there the queue keeps from the frames submitted before it.

    chunk : gives the buffers by number, CHUNK_BYTES each; those of the device when left out
    """

    def __init__(self, device: Device, chunk: Callable[[int], Buffer] | None = None) -> None:
        self._device = device
        self._chunk = chunk or partial(device.uniform_chunk, size=CHUNK_BYTES)
        self._staged: list[bytearray] = []
        self._end = CHUNK_BYTES
        self._taken: dict[int, tuple[bytes, NDArray[np.generic]]] = {}  # which keeps the records' names
        self._placed: dict[int, int] = {}

    def bytes_of(self, record: NDArray[np.generic]) -> bytes:
        """A record as it is when it comes first; it must not be changed until the frame is submitted."""
        found = self._taken.get(id(record))
        if found is None:
            found = self._taken[id(record)] = record.tobytes(), record
        return found[0]

    def place(self, record: NDArray[np.generic]) -> int:
        """Where the record will be, counted through all buffers [byte]."""
        found = self._placed.get(id(record))
        if found is None:
            found = self._placed[id(record)] = self._add(self.bytes_of(record))
        return found

    def at(self, place: int) -> tuple[Buffer, int]:
        """The buffer of a place, and the offset in it."""
        number, offset = divmod(place, CHUNK_BYTES)
        return self._chunk(number), offset

    def upload(self) -> None:
        """Write all records for the next submit."""
        for index, staged in enumerate(self._staged):
            last = index == len(self._staged) - 1
            self._device.write(self._chunk(index), staged, self._end if last else CHUNK_BYTES)

    def finish(self) -> None:
        """Begin anew after the last submit."""
        self._device.spare_records.extend(self._staged)
        self.clear()

    def clear(self) -> None:
        """Forget all records."""
        self._staged, self._end = [], CHUNK_BYTES
        self._taken.clear()
        self._placed.clear()

    def _add(self, record: bytes) -> int:
        size = len(record)
        if self._end + size > CHUNK_BYTES:
            spare = self._device.spare_records
            self._staged.append(spare.pop() if spare else bytearray(CHUNK_BYTES))
            self._end = 0
        start = self._end
        self._staged[-1][start : start + size] = record
        self._end += -(-size // _STEP) * _STEP
        return (len(self._staged) - 1) * CHUNK_BYTES + start
