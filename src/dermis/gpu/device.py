"""An opened adapter, with what every pass needs: limits, uniform buffers, samplers."""

from __future__ import annotations

import contextlib
import logging
import os
import weakref
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu.adapters import Adapter, check_limits, device_limits, select_adapters
from dermis.gpu.memory import allocation, check_software
from dermis.gpu.types import Bindable, Buffer, Sampler, Untyped

if TYPE_CHECKING:
    from dermis.gpu.dependencies import Slot
    from dermis.gpu.readback import BufferReadback

T = TypeVar("T")

_TIMED_PASSES = 2048
_STAGING_STEP = 4096
_LOSS_NOTES = "DEVICE LOST!", "The WGPU device was lost"  # in wgpu's log; DeviceLostError says so too
_RAISED_LIMITS = ("max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size")


def open_device(adapter: str = "auto", *, bare: bool = False) -> Device:
    """Open "auto" (the best), "cpu" (software) or the first adapter whose name contains the text.

    bare : True requests nothing beyond what WebGPU guarantees everywhere

    Raises DermisError when there is no such adapter or when it does not open.
    """
    (*others, last), reason = select_adapters(adapter)
    for one in others:
        with contextlib.suppress(DermisError):  # listed, but it does not open
            return Device(one, reason, bare=bare)
    return Device(last, reason, bare=bare)


class Device:
    """A logical device; devices share no state.

    It has WebGPU's default limits, so that a program that needs more fails on every machine alike; only the
    largest sizes of textures and buffers are the adapter's own. It has those of `OPTIONAL_FEATURES` that the
    adapter offers.

    bare : True keeps the default sizes too, and requests no feature
    executor : threads for work outside Python (compiling, reading, copying); jobs that have not started are
        cancelled when the device is dropped
    ffi, lib, checked : the native library, called directly in each frame to save the overhead of wgpu's
        Python; calls of `checked` raise the library's errors, for passes when their encoder is submitted
    slots : what textures, buffers and views hold, see access.py
    programs : compiled shaders, see program.py
    spare_records : memory for records that no frame uses at the moment; allocating it takes longer
    """

    def __init__(self, adapter: Adapter, reason: str, *, bare: bool = False) -> None:
        from wgpu.backends.wgpu_native import GPUCommandEncoder, ffi, lib
        from wgpu.backends.wgpu_native._api import libf

        self.ffi, self.lib, self.checked, self._encoder = ffi, lib, libf, GPUCommandEncoder
        self.adapter = adapter
        self.reason = reason
        logging.getLogger("wgpu").addFilter(_is_news)
        if adapter.kind == "CPU":
            check_software()
        check_limits(adapter.name, adapter.handle.limits)
        features = [] if bare else list(adapter.features)
        limits = device_limits(adapter.handle.limits, () if bare else _RAISED_LIMITS)
        try:
            self.handle: Untyped = adapter.handle.request_device_sync(
                label="dermis", required_features=features, required_limits=limits
            )
            self._unwritten = self.handle.create_buffer(size=4, usage="COPY_DST")
        except Exception as error:
            raise DermisError(
                f"adapter {adapter.name}: expected it to open, but its driver says: {error}. "
                "Close other programs that use the GPU or choose --adapter cpu."
            ) from error
        raised = (int(limits[name]) for name in _RAISED_LIMITS)
        self.max_texture_size, self.max_storage_bytes, self.max_buffer_bytes = raised
        self.has_timestamps = "timestamp-query" in features
        self.executor = ThreadPoolExecutor(os.cpu_count())
        weakref.finalize(self, self.executor.shutdown, wait=False, cancel_futures=True)
        self._timestamps: tuple[Untyped, Buffer] | None = None
        self._uniform_chunks: list[Buffer] = []
        self.spare_records: list[bytearray] = []
        self.slots: weakref.WeakKeyDictionary[Bindable, Slot] = weakref.WeakKeyDictionary()
        self.programs: dict[Hashable, Any] = {}  # as many types as there are kinds of programs
        self._shared: dict[str, Any] = {}  # of the types that their makers return
        self._staging: dict[int, list[Buffer]] = {}
        self.fetching: set[BufferReadback] = set()
        self._samplers: dict[tuple[tuple[str, str], ...], Sampler] = {}

    def shared(self, name: str, make: Callable[[], T]) -> T:
        """A small object by its name, made on first use and kept as long as the device."""
        if name not in self._shared:
            self._shared[name] = make()
        found: T = self._shared[name]
        return found

    def write(self, buffer: Buffer, data: bytearray | bytes, size: int) -> None:
        """Put the first `size` bytes of the data into a buffer before the next submit."""
        start = self.ffi.from_buffer(data)
        self.checked.wgpuQueueWriteBuffer(self.handle.queue._internal, buffer._internal, 0, start, size)

    def command_encoder(self) -> Untyped:
        """wgpu's encoder, without the description that it would make of no label."""
        made = self.checked.wgpuDeviceCreateCommandEncoder(self.handle._internal, self.ffi.NULL)
        return self._encoder("", made, self.handle)

    def submit(self, encoder: Untyped) -> int:
        """Submit what an encoder has recorded; returns the number of the submission, for `wait`.

        Raises GPUError, of a device that is lost too: the library would end the process.
        """
        done = self.checked.wgpuCommandEncoderFinish(encoder._internal, self.ffi.NULL)
        commands = self.ffi.gc(done, self.lib.wgpuCommandBufferRelease)
        listed = self.ffi.new("WGPUCommandBuffer[]", [commands])
        self._touch()
        # wgpu's own submit returns no number, without which one can only wait for all submissions.
        return int(self.checked.wgpuQueueSubmitForIndex(self.handle.queue._internal, 1, listed))

    def wait(self, submitted: int | None = None) -> None:
        """Wait for all submissions up to the one with this number from `submit`, or for all."""
        number = self.ffi.NULL if submitted is None else self.ffi.new("WGPUSubmissionIndex *", submitted)
        self.checked.wgpuDevicePoll(self.handle._internal, True, number)

    @property
    def is_lost(self) -> bool:
        """Whether its driver lost it, or it was destroyed."""
        import wgpu

        try:
            self._touch()
        except wgpu.GPUError:
            return True
        return False

    def _touch(self) -> None:
        """Write nothing, which the library refuses where the device is lost."""
        self.write(self._unwritten, b"", 0)

    @cached_property
    def timestamp_period_ns(self) -> float:
        """Length of a timestamp's tick [ns]; wgpu returns the native API's ticks."""
        return float(self.lib.wgpuQueueGetTimestampPeriod(self.handle.queue._internal))

    def uniform_chunk(self, index: int, size: int) -> Buffer:
        """One of the frames' uniform buffers, of `size` bytes; made on first use."""
        while len(self._uniform_chunks) <= index:
            self._uniform_chunks.append(self.uniform_buffer(size))
        return self._uniform_chunks[index]

    def uniform_buffer(self, size: int) -> Buffer:
        """A new uniform buffer of `size` bytes."""
        return self.buffer(np.zeros(size, np.uint8), "UNIFORM")

    def staging(self, size: int) -> Buffer:
        """A staging buffer of at least `size` bytes, one given back if there is any."""
        size = -(-size // _STAGING_STEP) * _STAGING_STEP
        spare = self._staging.get(size)
        if spare:
            return spare.pop()
        return self._buffer(
            "copy for reading", size, "MAP_READ", partial(self.handle.create_buffer, size=size)
        )

    def give_back(self, buffer: Buffer) -> None:
        """Keep a buffer from `staging` for reuse at its size; the first of another size drops the others."""
        if buffer.size not in self._staging:
            self._staging.clear()
        self._staging.setdefault(buffer.size, []).append(buffer)

    def buffer(self, data: NDArray[np.generic], usage: str, name: str = "buffer") -> Buffer:
        """A new buffer with the array's bytes.

        usage : wgpu's name ("STORAGE", "UNIFORM")
        name : to be told where there is no room for it, as of `space`
        """
        data = np.ascontiguousarray(data)
        create = partial(self.handle.create_buffer_with_data, data=data)
        return self._buffer(name, data.nbytes, usage, create)

    def space(self, size: int, name: str = "buffer") -> Buffer:
        """A new buffer of zeros that shaders write [byte]."""
        return self._buffer(name, size, "STORAGE", partial(self.handle.create_buffer, size=size))

    def _buffer(self, name: str, size: int, usage: str, create: Callable[..., Buffer]) -> Buffer:
        import wgpu

        flags = getattr(wgpu.BufferUsage, usage) | wgpu.BufferUsage.COPY_DST
        flags |= 0 if usage == "MAP_READ" else wgpu.BufferUsage.COPY_SRC
        most = self.max_storage_bytes if usage == "STORAGE" else self.max_buffer_bytes
        with allocation(self.adapter.name, name, size, most):
            return create(usage=flags)

    def sampler(self, **options: str) -> Sampler:
        """A sampler with wgpu's options; made once for each set of them."""
        key = tuple(sorted(options.items()))
        if key not in self._samplers:
            self._samplers[key] = self.handle.create_sampler(**options)
        return self._samplers[key]

    def sampler_options(self, sampler: Sampler) -> dict[str, str]:
        """The options that a sampler was made with."""
        return next(dict(key) for key, made in self._samplers.items() if made is sampler)

    def timestamp_pool(self) -> tuple[Untyped, Buffer]:
        """The query set for a frame's timestamps and the buffer that they are resolved into."""
        import wgpu

        if self._timestamps is None:
            queries = self.handle.create_query_set(type="timestamp", count=_TIMED_PASSES)
            usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
            self._timestamps = queries, self.handle.create_buffer(size=8 * _TIMED_PASSES, usage=usage)
        return self._timestamps


def _is_news(record: logging.LogRecord) -> bool:
    return not record.getMessage().startswith(_LOSS_NOTES)
