"""Asynchronous readback: copies of buffers that the CPU reads while the device continues to work."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu.device import Device
from dermis.gpu.failures import DeviceLostError


class BufferReadback:
    """Copy of a buffer in staging memory, which becomes readable when a submission has finished.

    In wgpu's own mapping, another thread waits for the newest submission. Here, only the reader waits, and
    only for the submission that fills the staging buffer.

    size : size of the copied buffer [byte]
    """

    def __init__(self, device: Device, size: int) -> None:
        self.device, self._size, self._submitted = device, size, 0
        self._status: int | None = None
        self._handle: object = None  # argument of the driver's callback, which has to stay alive
        self.buffer = device.acquire_staging(size)

    def start(self, submission: int) -> None:
        """Request that the staging buffer be mapped to host memory when a submission has finished.

        submission : number, returned by `Device.submit`, of the submission that fills the staging buffer
        """
        ffi, lib = self.device.ffi, self.device.lib
        info = ffi.new("WGPUBufferMapCallbackInfo *")
        info.mode, info.callback = lib.WGPUCallbackMode_AllowProcessEvents, _map_callback()
        self._submitted, self._handle = submission, ffi.new_handle(self)
        info.userdata1 = self._handle
        self.device.pending_readbacks.add(self)  # has to live until the callback
        arguments = self.buffer._internal, lib.WGPUMapMode_Read, 0, self.buffer.size, info[0]
        self.device.checked.wgpuBufferMapAsync(*arguments)

    def on_mapped(self, map_status: int) -> None:
        """Store the status of the mapping; called by the driver."""
        self._status, self._handle = map_status, None
        self.device.pending_readbacks.discard(self)

    def array(self) -> NDArray[np.uint8]:
        """Wait for the copy and return its bytes; this can be called once.

        Raises DeviceLostError if the device is lost, and DermisError for other failures.
        """
        ffi, checked = self.device.ffi, self.device.checked
        self._check_device()
        self.device.wait(self._submitted)
        self._check_device()
        if self._status != self.device.lib.WGPUMapAsyncStatus_Success:
            name = self.device.adapter.name
            raise DermisError(f"{name}: expected to read its results, but its driver refuses. Try again.")
        start = checked.wgpuBufferGetConstMappedRange(self.buffer._internal, 0, self.buffer.size)
        copied = np.frombuffer(ffi.buffer(start, self._size), np.uint8).copy()
        checked.wgpuBufferUnmap(self.buffer._internal)
        self.device.release_staging(self.buffer)
        return copied

    def _check_device(self) -> None:
        """Raise DeviceLostError if the device is lost, as touching its buffers would abort the process."""
        if self.device.is_lost:
            raise DeviceLostError(self.device)


@cache
def _map_callback() -> object:
    """Return the C callback for finished mappings; all readbacks share it, because creating it is slow."""
    from wgpu.backends.wgpu_native import ffi

    @ffi.callback("void(WGPUMapAsyncStatus, WGPUStringView, void *, void *)")  # type: ignore[untyped-decorator]
    def on_mapped(status: int, _: object, readback: object, __: object) -> None:
        ffi.from_handle(readback).on_mapped(status)

    return on_mapped
