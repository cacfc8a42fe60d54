"""An opened adapter, with what every pass needs: limits, the uniform pool, the sampler."""

from __future__ import annotations

import contextlib
from collections import OrderedDict
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import DermisError
from dermis.gpu.adapters import Adapter, fitting_adapters

_POOLED_UNIFORMS = 512
_TIMED_PASSES = 2048
_RAISED_LIMITS = ("max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size")


def open_device(adapter: str = "auto") -> Device:
    """Open "auto" (the best), "cpu" (software) or the first adapter whose name contains the text.

    Raises DermisError when there is no such adapter or when it does not open.
    """
    (*others, last), reason = fitting_adapters(adapter)
    for one in others:
        with contextlib.suppress(DermisError):  # listed, but it does not open
            return Device(one, reason)
    return Device(last, reason)


class Device:
    """A logical device; nothing here is shared between two of them."""

    def __init__(self, adapter: Adapter, reason: str) -> None:
        self.adapter = adapter
        self.reason = reason
        try:
            limits = {name: adapter.handle.limits[name] for name in _RAISED_LIMITS}
            self.handle: Any = adapter.handle.request_device_sync(
                label="dermis", required_features=list(adapter.features), required_limits=limits
            )
        except Exception as error:
            raise DermisError(
                f"adapter {adapter.name}: expected it to open, but its driver says: {error}. "
                "Close other programs that use the GPU or choose --adapter cpu."
            ) from error
        self.max_texture_size, self.max_storage_bytes = (int(limits[name]) for name in _RAISED_LIMITS[:2])
        self.has_timestamps = "timestamp-query" in adapter.features
        self._timestamps: tuple[Any, Any] | None = None
        self._uniforms: OrderedDict[bytes, Any] = OrderedDict()
        self._fence = self.buffer(np.zeros(1, np.uint32), "UNIFORM")
        self._samplers: dict[tuple[tuple[str, str], ...], Any] = {}

    def wait(self) -> None:
        """Return when the device has done all that was submitted."""
        # wgpu 0.32's own wait for submitted work raises TypeError; a read waits for all that came before it.
        self.handle.queue.read_buffer(self._fence)

    @cached_property
    def timestamp_period_ns(self) -> float:
        """Length of a timestamp's tick [ns]; wgpu hands out the native API's ticks."""
        from wgpu.backends.wgpu_native import lib

        return float(lib.wgpuQueueGetTimestampPeriod(self.handle.queue._internal))

    def uniform(self, record: NDArray[Any]) -> Any:
        """A uniform buffer that holds `record`; the same bytes give the same buffer."""
        key = record.tobytes()
        found = self._uniforms.pop(key, None)
        if found is None:
            found = self.buffer(record, "UNIFORM")
            while len(self._uniforms) >= _POOLED_UNIFORMS:
                self._uniforms.popitem(last=False)
        self._uniforms[key] = found
        return found

    def buffer(self, data: NDArray[Any], usage: str) -> Any:
        """A new buffer with the array's bytes; usage is wgpu's name ("STORAGE", "UNIFORM")."""
        import wgpu

        flags = getattr(wgpu.BufferUsage, usage) | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.COPY_SRC
        return self.handle.create_buffer_with_data(data=np.ascontiguousarray(data), usage=flags)

    def sampler(self, **options: str) -> Any:
        """A sampler with wgpu's options; made once for each set of them."""
        key = tuple(sorted(options.items()))
        if key not in self._samplers:
            self._samplers[key] = self.handle.create_sampler(**options)
        return self._samplers[key]

    def timestamp_pool(self) -> tuple[Any, Any]:
        """The query set for a frame's timestamps and the buffer that they are resolved into."""
        import wgpu

        if self._timestamps is None:
            queries = self.handle.create_query_set(type="timestamp", count=_TIMED_PASSES)
            usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
            self._timestamps = queries, self.handle.create_buffer(size=8 * _TIMED_PASSES, usage=usage)
        return self._timestamps


@contextlib.contextmanager
def gpu_failures(device: Device) -> Iterator[None]:
    """Turn what the driver reports (memory used up, device lost, a refused call) into a DermisError."""
    import wgpu

    try:
        yield
    except (wgpu.GPUError, MemoryError) as error:
        raise DermisError(
            f"{device.adapter.name}: expected the frame to run, but the driver says: {error}. "
            "Lower --size, --samples or --atlas, close other programs that use the GPU, or try --adapter cpu."
        ) from error
