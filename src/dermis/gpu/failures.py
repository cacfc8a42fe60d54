"""Conversion of device errors to errors of this package, and devices that are reopened when lost."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from dermis.base.errors import DermisError, notify
from dermis.gpu.device import Device, open_device

T = TypeVar("T")
_LOST_DEVICE_ADVICE = "Close other programs that use the GPU, or try --adapter cpu"


class DeviceError(DermisError):
    """Failure of a device; the same work may succeed later or on another device."""


class DeviceLostError(DeviceError):
    """Loss of a device and all its resources, because its driver failed, was reset or updated."""

    def __init__(self, device: Device) -> None:
        self.name = device.adapter.name
        super().__init__(
            f"{self.name}: expected the device to last, but its driver lost it. {_LOST_DEVICE_ADVICE}."
        )

    def lost_twice_error(self) -> DeviceError:
        """Return the error to raise when the reopened device is lost as well."""
        return DeviceError(
            f"device: expected {self.name} to last for a frame, but it was lost twice. {_LOST_DEVICE_ADVICE}."
        )


@contextlib.contextmanager
def converted_gpu_failures(device: Device) -> Iterator[None]:
    """Convert driver errors (out of memory, invalid call) raised in this context to DeviceError.

    Raises DeviceLostError for any error on a device that is lost.
    """
    import wgpu

    try:
        yield
    except DeviceLostError:
        raise
    except Exception as error:
        if device.is_lost:
            raise DeviceLostError(device) from error
        if not isinstance(error, wgpu.GPUError | MemoryError):
            raise
        raise DeviceError(
            f"{device.adapter.name}: expected the frame to run, but the driver reports: {error}. "
            "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu."
        ) from error


class ReopeningDevice:
    """Device that is opened again when it is lost, after which the interrupted work is repeated.

    open_device : function that opens a device
    on_open : function that is called with each opened device and creates the resources of the caller on it
    reopens_lost_device : whether a lost device is opened again; if False, its loss raises DeviceLostError.
        Pass False if the device also holds resources that `on_open` does not create
    """

    def __init__(
        self,
        open_device: Callable[[], Device],
        on_open: Callable[[Device], None],
        *,
        reopens_lost_device: bool = True,
    ) -> None:
        self._open_device, self._on_open, self._reopens_lost_device = (
            open_device,
            on_open,
            reopens_lost_device,
        )
        self._device: Device | None = None
        self.run(lambda: None)

    def run(self, job: Callable[[], T]) -> T:
        """Return the result of `job()`; if the device is lost, repeat the job on the reopened device.

        Raises DermisError if the reopened device is lost as well, and DeviceError for other driver errors.
        """
        try:
            return self._run_job(job)
        except DeviceLostError as lost:
            if not self._reopens_lost_device:
                raise
            notify(f"{lost.name} was lost by its driver; it is opened again, and the frame is restarted")
        try:
            return self._run_job(job)
        except DeviceLostError as lost:
            raise lost.lost_twice_error() from lost

    def _run_job(self, job: Callable[[], T]) -> T:
        device = self._device or self._open_device()
        try:
            with converted_gpu_failures(device):
                if self._device is None:
                    self._on_open(device)
                    self._device = device
                return job()
        except DeviceLostError:
            self._device = None
            raise


class LazyDevice:
    """Device that is opened for the first job and reopened when it is lost.

    adapter : selector of the adapter, see `open_device`
    """

    def __init__(self, adapter: str) -> None:
        self._adapter = adapter
        self._open: list[Device] = []
        self._reopening: ReopeningDevice | None = None

    def run(self, job: Callable[[Device], T]) -> T:
        """Return the result of `job(device)`, opening or reopening the device as needed.

        Raises DermisError if no device opens, if the device is lost twice, and for other errors of the
        driver.
        """
        if self._reopening is None:
            self._reopening = ReopeningDevice(partial(open_device, self._adapter), self._on_open)
        return self._reopening.run(lambda: job(self._open[0]))

    def _on_open(self, device: Device) -> None:
        self._open[:] = [device]


def run_on_device(adapter: str, job: Callable[[Device], T]) -> T:
    """Return the result of `job(device)` on a device that is opened for this job, and reopened if lost.

    adapter : selector of the adapter, see `open_device`

    Raises DermisError if no device opens, if the device is lost twice, and for other errors of the driver.
    """
    return LazyDevice(adapter).run(job)
