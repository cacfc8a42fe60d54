"""Asynchronous readback: copies of buffers that the CPU reads while the device keeps working."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu.device import Device
from dermis.gpu.failures import DeviceLostError


class BufferReadback:
    """A copy of a buffer that becomes readable when a submission is done.

    wgpu's own mapping makes a thread wait for the newest submission; here only the reader waits, and only for
    the submission that fills the copy.
    """

    def __init__(self, device: Device, size: int) -> None:
        self.device, self._size, self._submitted = device, size, 0
        self._status: int | None = None
        self._name: object = None  # what the driver's callback gets
        self.buffer = device.staging(size)

    def begin(self, submitted: int) -> None:
        """Map the copy for reading once the submission of that number is done."""
        ffi, lib = self.device.ffi, self.device.lib
        info = ffi.new("WGPUBufferMapCallbackInfo *")
        info.mode, info.callback = lib.WGPUCallbackMode_AllowProcessEvents, _when_mapped()
        self._submitted, self._name = submitted, ffi.new_handle(self)
        info.userdata1 = self._name
        self.device.fetching.add(self)  # has to live until the driver calls back
        asked = self.buffer._internal, lib.WGPUMapMode_Read, 0, self.buffer.size, info[0]
        self.device.checked.wgpuBufferMapAsync(*asked)

    def arrive(self, status: int) -> None:
        """Take the driver's answer to `begin`."""
        self._status, self._name = status, None
        self.device.fetching.discard(self)

    def array(self) -> NDArray[np.uint8]:
        """The bytes; waits for them. To be called once.

        Raises DeviceLostError without a device, DermisError when it fails otherwise.
        """
        ffi, checked = self.device.ffi, self.device.checked
        self._check()
        self.device.wait(self._submitted)
        self._check()
        if self._status != self.device.lib.WGPUMapAsyncStatus_Success:
            name = self.device.adapter.name
            raise DermisError(
                f"{name}: expected to read what it computed, but its driver refuses. Try again."
            )
        start = checked.wgpuBufferGetConstMappedRange(self.buffer._internal, 0, self.buffer.size)
        copied = np.frombuffer(ffi.buffer(start, self._size), np.uint8).copy()
        checked.wgpuBufferUnmap(self.buffer._internal)
        self.device.give_back(self.buffer)
        return copied

    def _check(self) -> None:
        """Raise DeviceLostError without a device, for whose buffers the library ends the process."""
        if self.device.is_lost:
            raise DeviceLostError(self.device)


@cache
def _when_mapped() -> object:
    """The driver's callback, one for all copies: making one takes as long as a stage of a frame."""
    from wgpu.backends.wgpu_native import ffi

    @ffi.callback("void(WGPUMapAsyncStatus, WGPUStringView, void *, void *)")  # type: ignore[untyped-decorator]
    def mapped(status: int, _: object, fetched: object, __: object) -> None:
        ffi.from_handle(fetched).arrive(status)

    return mapped
