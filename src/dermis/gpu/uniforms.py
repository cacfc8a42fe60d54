"""The numbers of one frame's passes: gathered while it is recorded, handed over in one write."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:
    from dermis.gpu.device import Device

CHUNK_BYTES = 1 << 18
_STEP = 256  # WebGPU's default alignment of uniforms in a buffer


class Uniforms:
    """Places for records in the uniform buffers that all frames of a device share.

    What a frame writes there the queue keeps from the frames submitted before it.

    chunk : gives the buffers by number, CHUNK_BYTES each; those of the device when left out
    """

    def __init__(self, device: Device, chunk: Callable[[int], Any] | None = None) -> None:
        self._device = device
        self._chunk = chunk or device.uniform_chunk
        self._staged: list[bytearray] = []
        self._end = CHUNK_BYTES
        self._placed: dict[bytes, tuple[Any, int]] = {}

    def place(self, record: NDArray[Any]) -> tuple[Any, int]:
        """The buffer and the offset [byte] at which the record will be; equal records share a place."""
        data = record.tobytes()
        found = self._placed.get(data)
        if found is None:
            found = self._placed[data] = self._add(data)
        return found

    def upload(self) -> None:
        """Write all records for the next submit."""
        for index, staged in enumerate(self._staged):
            last = index == len(self._staged) - 1
            part = memoryview(staged)[: self._end if last else CHUNK_BYTES]
            self._device.handle.queue.write_buffer(self._chunk(index), 0, part)

    def _add(self, data: bytes) -> tuple[Any, int]:
        size = -(-len(data) // _STEP) * _STEP
        if self._end + size > CHUNK_BYTES:
            self._staged.append(bytearray(CHUNK_BYTES))
            self._end = 0
        start = self._end
        self._staged[-1][start : start + len(data)] = data
        self._end += size
        return self._chunk(len(self._staged) - 1), start
