"""What goes wrong on a device, told in the package's own errors; and devices that are lost, opened again."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from dermis.base.errors import DermisError, notify
from dermis.gpu.device import Device, open_device

T = TypeVar("T")
_REMEDY = "Close other programs that use the GPU, or try --adapter cpu"


class DeviceError(DermisError):
    """The device failed, or has no room: another one, or this one later, may do the same work."""


class DeviceLostError(DeviceError):
    """A device that is gone, with all that was on it: its driver was reset, updated, or gave up."""

    def __init__(self, device: Device) -> None:
        self.name = device.adapter.name
        super().__init__(f"{self.name}: expected the device to last, but its driver lost it. {_REMEDY}.")

    def again(self) -> DeviceError:
        """What to say when the device that was opened after it is lost too."""
        return DeviceError(
            f"device: expected {self.name} to last for a frame, but it was lost twice. {_REMEDY}."
        )


@contextlib.contextmanager
def gpu_failures(device: Device) -> Iterator[None]:
    """Turn the driver's errors (out of memory, invalid call) into a DermisError.

    Raises DeviceLostError where the device is lost, whatever was the first to fail for it.
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
            f"{device.adapter.name}: expected the frame to run, but the driver says: {error}. "
            "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu."
        ) from error


class ReopeningDevice:
    """A device that is opened again when it is lost.

    opening : opens one
    adopt : told of each that is opened, to make anew what was on the one before
    reopens : False leaves a lost device to the caller, for those who keep things on it
    """

    def __init__(
        self, opening: Callable[[], Device], adopt: Callable[[Device], None], *, reopens: bool = True
    ) -> None:
        self._opening, self._adopt, self._reopens = opening, adopt, reopens
        self._device: Device | None = None
        self.run(lambda: None)

    def run(self, job: Callable[[], T]) -> T:
        """What `job()` returns; it is done once more on another device where it loses this one.

        Raises DermisError when it loses both, and for what `gpu_failures` tells.
        """
        try:
            return self._run(job)
        except DeviceLostError as lost:
            if not self._reopens:
                raise
            notify(f"{lost.name} was lost by its driver; it is opened again, and the frame begun anew")
        try:
            return self._run(job)
        except DeviceLostError as lost:
            raise lost.again() from lost

    def _run(self, job: Callable[[], T]) -> T:
        device = self._device or self._opening()
        try:
            with gpu_failures(device):
                if self._device is None:
                    self._adopt(device)
                    self._device = device
                return job()
        except DeviceLostError:
            self._device = None
            raise


class LazyDevice:
    """A device for several jobs, opened for the first of them, and once more where it is lost.

    adapter : as `open_device` takes it
    """

    def __init__(self, adapter: str) -> None:
        self._adapter = adapter
        self._opened: list[Device] = []
        self._kept: ReopeningDevice | None = None

    def run(self, job: Callable[[Device], T]) -> T:
        """What a job returns on the device.

        Raises DermisError as `open_device` and `ReopeningDevice.run`.
        """
        if self._kept is None:
            self._kept = ReopeningDevice(partial(open_device, self._adapter), self._adopt)
        return self._kept.run(lambda: job(self._opened[0]))

    def _adopt(self, device: Device) -> None:
        self._opened[:] = [device]


def run_on_device(adapter: str, job: Callable[[Device], T]) -> T:
    """What a job returns on a device that is opened for it, and once more where it is lost.

    Raises DermisError as `open_device` and `ReopeningDevice.run`.
    """
    return LazyDevice(adapter).run(job)
