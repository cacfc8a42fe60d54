"""Errors of devices as the package's own, and devices that are reopened when they are lost."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from dermis.base.errors import DermisError, notify
from dermis.gpu.device import Device, open_device

T = TypeVar("T")
_ADVICE = "Close other programs that use the GPU, or try --adapter cpu"


class DeviceError(DermisError):
    """Failure of a device, after which the same work may succeed on another one, or later."""


class DeviceLostError(DeviceError):
    """Loss of a device with all that was on it: its driver was reset or updated, or failed."""

    def __init__(self, device: Device) -> None:
        self.name = device.adapter.name
        super().__init__(f"{self.name}: expected the device to last, but its driver lost it. {_ADVICE}.")

    def lost_twice(self) -> DeviceError:
        """Return the error for the case that the reopened device is lost too."""
        return DeviceError(
            f"device: expected {self.name} to last for a frame, but it was lost twice. {_ADVICE}."
        )


@contextlib.contextmanager
def gpu_failures(device: Device) -> Iterator[None]:
    """Turn errors of the driver (out of memory, invalid call) into DeviceError.

    Raises DeviceLostError if the device is lost, whichever error that caused.
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
    """A device that is opened again when it is lost.

    open_device : function that opens a device
    on_open : function that is called with each opened device, to create the resources on it
    reopens : False raises DeviceLostError instead, for callers that keep resources of their own on the device
    """

    def __init__(
        self, open_device: Callable[[], Device], on_open: Callable[[Device], None], *, reopens: bool = True
    ) -> None:
        self._open_device, self._on_open, self._reopens = open_device, on_open, reopens
        self._device: Device | None = None
        self.run(lambda: None)

    def run(self, job: Callable[[], T]) -> T:
        """Return `job()`, which is run a second time on a reopened device if this one is lost.

        Raises DermisError if both are lost, and as `gpu_failures` does.
        """
        try:
            return self._run(job)
        except DeviceLostError as lost:
            if not self._reopens:
                raise
            notify(f"{lost.name} was lost by its driver; it is opened again, and the frame is restarted")
        try:
            return self._run(job)
        except DeviceLostError as lost:
            raise lost.lost_twice() from lost

    def _run(self, job: Callable[[], T]) -> T:
        device = self._device or self._open_device()
        try:
            with gpu_failures(device):
                if self._device is None:
                    self._on_open(device)
                    self._device = device
                return job()
        except DeviceLostError:
            self._device = None
            raise


class LazyDevice:
    """A device for several jobs, opened for the first of them and reopened when it is lost.

    adapter : as for `open_device`
    """

    def __init__(self, adapter: str) -> None:
        self._adapter = adapter
        self._open: list[Device] = []
        self._reopening: ReopeningDevice | None = None

    def run(self, job: Callable[[Device], T]) -> T:
        """Return `job(device)`.

        Raises DermisError as `open_device` and `ReopeningDevice.run`.
        """
        if self._reopening is None:
            self._reopening = ReopeningDevice(partial(open_device, self._adapter), self._on_open)
        return self._reopening.run(lambda: job(self._open[0]))

    def _on_open(self, device: Device) -> None:
        self._open[:] = [device]


def run_on_device(adapter: str, job: Callable[[Device], T]) -> T:
    """Return `job(device)` on a device that is opened for it and reopened when it is lost.

    Raises DermisError as `open_device` and `ReopeningDevice.run`.
    """
    return LazyDevice(adapter).run(job)
