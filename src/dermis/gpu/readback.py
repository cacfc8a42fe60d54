"""Asynchronous readback: copies of buffers that the CPU reads while the device works on."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import DermisError
from dermis.gpu.device import Device


class Fetched:
    """A copy of a buffer that becomes readable when a submit is done.

    wgpu's own mapping has a thread wait for the newest submit; here only the one that fills the copy is
    waited for, and by who wants the bytes.
    """

    def __init__(self, device: Device, size: int) -> None:
        self._device, self._size, self._submitted = device, size, 0
        self._status: int | None = None
        self._name: Any = None  # by which the driver knows it
        self.buffer = device.staging(size)

    def begin(self, submitted: int) -> None:
        """Ask for the copy to be readable when the submit of that number is done."""
        ffi, lib = self._device.ffi, self._device.lib
        info = ffi.new("WGPUBufferMapCallbackInfo *")
        info.mode, info.callback = lib.WGPUCallbackMode_AllowProcessEvents, _when_mapped()
        self._submitted, self._name = submitted, ffi.new_handle(self)
        info.userdata1 = self._name
        self._device.fetching.add(self)  # the driver calls back even when nobody wants the bytes any more
        asked = self.buffer._internal, lib.WGPUMapMode_Read, 0, self.buffer.size, info[0]
        self._device.checked.wgpuBufferMapAsync(*asked)

    def arrive(self, status: int) -> None:
        """The driver's answer to `begin`."""
        self._status, self._name = status, None
        self._device.fetching.discard(self)

    def array(self) -> NDArray[np.uint8]:
        """The bytes; waits until they are here. To be called once.

        Raises DermisError when the device fails.
        """
        ffi, checked = self._device.ffi, self._device.checked
        self._device.wait(self._submitted)
        if self._status != self._device.lib.WGPUMapAsyncStatus_Success:
            name = self._device.adapter.name
            raise DermisError(
                f"{name}: expected to read what it computed, but its driver refuses. Try again."
            )
        start = checked.wgpuBufferGetConstMappedRange(self.buffer._internal, 0, self.buffer.size)
        copied = np.frombuffer(ffi.buffer(start, self._size), np.uint8).copy()
        checked.wgpuBufferUnmap(self.buffer._internal)
        self._device.give_back(self.buffer)
        return copied


@cache
def _when_mapped() -> Any:
    """What the driver calls: one function for all, for making one takes as long as a stage of a frame."""
    from wgpu.backends.wgpu_native import ffi

    @ffi.callback("void(WGPUMapAsyncStatus, WGPUStringView, void *, void *)")  # type: ignore[untyped-decorator]
    def mapped(status: int, _: Any, fetched: Any, __: Any) -> None:
        ffi.from_handle(fetched).arrive(status)

    return mapped
