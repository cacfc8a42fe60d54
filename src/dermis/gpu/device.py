"""Devices: opened adapters, with their limits, buffers, samplers and queue."""

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
from dermis.base.renamed import renamed_keywords
from dermis.gpu.adapters import Adapter, check_limits, device_limits, select_adapters
from dermis.gpu.memory import check_software_address_space, checked_allocation
from dermis.gpu.types import Bindable, Buffer, Sampler, Untyped

if TYPE_CHECKING:
    from dermis.gpu.dependencies import ResourceState
    from dermis.gpu.readback import BufferReadback

T = TypeVar("T")

_MAX_TIMED_PASSES = 2048
_STAGING_STEP_BYTES = 4096
# Starts of wgpu's log messages that are dropped, as DeviceLostError reports the same.
_DEVICE_LOSS_LOG_MESSAGES = "DEVICE LOST!", "The WGPU device was lost"
_LIMITS_RAISED_TO_ADAPTER = ("max-texture-dimension-2d", "max-storage-buffer-binding-size", "max-buffer-size")


@renamed_keywords(bare="guaranteed_capabilities_only")
def open_device(adapter: str = "auto", *, guaranteed_capabilities_only: bool = False) -> Device:
    """Open an adapter as a device; if the best matching adapter does not open, try the next match.

    adapter : "auto" (the best), "cpu" (software), part of an adapter's name, or "#" and the adapter's number
    guaranteed_capabilities_only : whether to request only the limits that WebGPU guarantees everywhere, and
        no optional feature

    Raises DermisError if no adapter matches or none opens.
    """
    (*others, last), selection_reason = select_adapters(adapter)
    for one in others:
        with contextlib.suppress(DermisError):  # listed, but it does not open
            return Device(one, selection_reason, guaranteed_capabilities_only=guaranteed_capabilities_only)
    return Device(last, selection_reason, guaranteed_capabilities_only=guaranteed_capabilities_only)


class Device:
    """Logical device with its queue, which holds all resources and programs of a renderer.

    The device has WebGPU's default limits, even if the adapter offers more, so that a program that exceeds
    them fails on every machine. Only the maximum sizes of textures and buffers are the adapter's own. The
    device has the features in `OPTIONAL_FEATURES` that the adapter supports.

    adapter : opened adapter
    selection_reason : reason for the choice of the adapter, for users
    guaranteed_capabilities_only : whether the maximum sizes are also WebGPU's defaults, and no optional
        feature is requested
    executor : threads for work outside Python (compiling, reading, copying); jobs that have not started are
        cancelled when the device is dropped
    ffi : cffi interface of wgpu's native library
    lib : functions of the native library, called directly to save the overhead of wgpu's Python code; errors
        in a pass are raised when its encoder is submitted
    checked : the same functions, wrapped so that they raise the errors that the library reports
    resource_states : versions of the content of textures, buffers and views, see dependencies.py
    programs : compiled shaders, see program.py
    spare_chunks : unused host memory for uniforms, kept for later frames because allocation is slow
    """

    def __init__(
        self, adapter: Adapter, selection_reason: str, *, guaranteed_capabilities_only: bool = False
    ) -> None:
        from wgpu.backends.wgpu_native import GPUCommandEncoder, ffi, lib
        from wgpu.backends.wgpu_native._api import libf

        self.ffi, self.lib, self.checked, self._encoder = ffi, lib, libf, GPUCommandEncoder
        self.adapter = adapter
        self.selection_reason = selection_reason
        logging.getLogger("wgpu").addFilter(_is_not_loss_message)
        if adapter.kind == "CPU":
            check_software_address_space()
        check_limits(adapter.name, adapter.handle.limits)
        features = [] if guaranteed_capabilities_only else list(adapter.features)
        limits = device_limits(
            adapter.handle.limits, () if guaranteed_capabilities_only else _LIMITS_RAISED_TO_ADAPTER
        )
        try:
            self.handle: Untyped = adapter.handle.request_device_sync(
                label="dermis", required_features=features, required_limits=limits
            )
            self._unwritten = self.handle.create_buffer(size=4, usage="COPY_DST")
        except Exception as error:
            raise DermisError(
                f"adapter {adapter.name}: expected it to open, but its driver reports: {error}. "
                "Close other programs that use the GPU or choose --adapter cpu."
            ) from error
        raised = (int(limits[name]) for name in _LIMITS_RAISED_TO_ADAPTER)
        self.max_texture_size, self.max_storage_bytes, self.max_buffer_bytes = raised
        self.has_timestamps = "timestamp-query" in features
        self.executor = ThreadPoolExecutor(os.cpu_count())
        weakref.finalize(self, self.executor.shutdown, wait=False, cancel_futures=True)
        self._timestamps: tuple[Untyped, Buffer] | None = None
        self._uniform_chunks: list[Buffer] = []
        self.spare_chunks: list[bytearray] = []
        self.resource_states: weakref.WeakKeyDictionary[Bindable, ResourceState] = weakref.WeakKeyDictionary()
        self.programs: dict[Hashable, Any] = {}  # programs of different types
        self._cached: dict[str, Any] = {}
        self._staging: dict[int, list[Buffer]] = {}
        self.pending_readbacks: set[BufferReadback] = set()
        self._samplers: dict[tuple[tuple[str, str], ...], Sampler] = {}

    def cached(self, object_name: str, make_object: Callable[[], T]) -> T:
        """Return an object that is cached by name on this device; `make_object` creates it on first use."""
        if object_name not in self._cached:
            self._cached[object_name] = make_object()
        found: T = self._cached[object_name]
        return found

    def write(self, buffer: Buffer, content: bytearray | bytes, byte_count: int) -> None:
        """Write the first `byte_count` bytes of `content` to a buffer, before the next submission runs."""
        start = self.ffi.from_buffer(content)
        self.checked.wgpuQueueWriteBuffer(self.handle.queue._internal, buffer._internal, 0, start, byte_count)

    def command_encoder(self) -> Untyped:
        """Return a new command encoder without a label, created faster than by wgpu's own method."""
        handle = self.checked.wgpuDeviceCreateCommandEncoder(self.handle._internal, self.ffi.NULL)
        return self._encoder("", handle, self.handle)

    def submit(self, encoder: Untyped) -> int:
        """Submit the commands of an encoder and return the number of the submission, for `wait`.

        Raises GPUError if a command is invalid, or if the device is lost; submitting to a lost device would
        abort the process.
        """
        finished = self.checked.wgpuCommandEncoderFinish(encoder._internal, self.ffi.NULL)
        commands = self.ffi.gc(finished, self.lib.wgpuCommandBufferRelease)
        command_list = self.ffi.new("WGPUCommandBuffer[]", [commands])
        self._check_alive()
        # wgpu's own submit returns no number, without which one can only wait for all submissions.
        return int(self.checked.wgpuQueueSubmitForIndex(self.handle.queue._internal, 1, command_list))

    def wait(self, submission: int | None = None) -> None:
        """Wait until a submission and all earlier submissions have finished.

        submission : number of the submission, from `submit`; None for the latest submission
        """
        number = self.ffi.NULL if submission is None else self.ffi.new("WGPUSubmissionIndex *", submission)
        self.checked.wgpuDevicePoll(self.handle._internal, True, number)

    @property
    def is_lost(self) -> bool:
        """Return whether the device was lost by its driver or destroyed."""
        import wgpu

        try:
            self._check_alive()
        except wgpu.GPUError:
            return True
        return False

    def _check_alive(self) -> None:
        """Raise GPUError if the device is lost; this is tested by writing zero bytes to a buffer."""
        self.write(self._unwritten, b"", 0)

    @cached_property
    def timestamp_period_ns(self) -> float:
        """Return the duration of a timestamp tick [ns]."""
        return float(self.lib.wgpuQueueGetTimestampPeriod(self.handle.queue._internal))

    def uniform_chunk(self, chunk_index: int, chunk_bytes: int) -> Buffer:
        """Return the uniform buffer at an index, created on first use; all frames share these buffers.

        chunk_index : index of the buffer
        chunk_bytes : size of a new buffer [byte]
        """
        while len(self._uniform_chunks) <= chunk_index:
            self._uniform_chunks.append(self.make_uniform_buffer(chunk_bytes))
        return self._uniform_chunks[chunk_index]

    def make_uniform_buffer(self, byte_count: int) -> Buffer:
        """Create a uniform buffer of `byte_count` bytes."""
        return self.buffer(np.zeros(byte_count, np.uint8), "UNIFORM")

    def acquire_staging(self, min_bytes: int) -> Buffer:
        """Return a mappable buffer of at least `min_bytes` for a readback; released buffers are reused."""
        min_bytes = -(-min_bytes // _STAGING_STEP_BYTES) * _STAGING_STEP_BYTES
        spare = self._staging.get(min_bytes)
        if spare:
            return spare.pop()
        return self._allocate_buffer(
            "copy for reading", min_bytes, "MAP_READ", partial(self.handle.create_buffer, size=min_bytes)
        )

    def release_staging(self, buffer: Buffer) -> None:
        """Keep a staging buffer for later readbacks.

        The first buffer of a new size replaces the kept buffers of other sizes.
        """
        if buffer.size not in self._staging:
            self._staging.clear()
        self._staging.setdefault(buffer.size, []).append(buffer)

    def buffer(self, content: NDArray[np.generic], usage: str, buffer_name: str = "buffer") -> Buffer:
        """Create a buffer from the bytes of an array.

        usage : name of the main flag in `wgpu.BufferUsage`, "STORAGE" or "UNIFORM"
        buffer_name : name of the buffer, for the error if it does not fit into memory
        """
        content = np.ascontiguousarray(content)
        create = partial(self.handle.create_buffer_with_data, data=content)
        return self._allocate_buffer(buffer_name, content.nbytes, usage, create)

    def storage_buffer(self, byte_count: int, buffer_name: str = "buffer") -> Buffer:
        """Create a storage buffer of `byte_count` bytes, all zero."""
        return self._allocate_buffer(
            buffer_name, byte_count, "STORAGE", partial(self.handle.create_buffer, size=byte_count)
        )

    def _allocate_buffer(
        self, buffer_name: str, byte_count: int, usage: str, create_buffer: Callable[..., Buffer]
    ) -> Buffer:
        import wgpu

        flags = getattr(wgpu.BufferUsage, usage) | wgpu.BufferUsage.COPY_DST
        flags |= 0 if usage == "MAP_READ" else wgpu.BufferUsage.COPY_SRC
        limit = self.max_storage_bytes if usage == "STORAGE" else self.max_buffer_bytes
        with checked_allocation(self.adapter.name, buffer_name, byte_count, limit):
            return create_buffer(usage=flags)

    def sampler(self, **options: str) -> Sampler:
        """Return a sampler with options of wgpu, such as its filters; samplers are cached."""
        key = tuple(sorted(options.items()))
        if key not in self._samplers:
            self._samplers[key] = self.handle.create_sampler(**options)
        return self._samplers[key]

    def sampler_options(self, sampler: Sampler) -> dict[str, str]:
        """Return the wgpu options that a sampler was created with."""
        return next(dict(key) for key, made in self._samplers.items() if made is sampler)

    def timestamp_pool(self) -> tuple[Untyped, Buffer]:
        """Return the query set for a frame's timestamps, and the buffer into which they are resolved."""
        import wgpu

        if self._timestamps is None:
            queries = self.handle.create_query_set(type="timestamp", count=_MAX_TIMED_PASSES)
            usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
            self._timestamps = queries, self.handle.create_buffer(size=8 * _MAX_TIMED_PASSES, usage=usage)
        return self._timestamps


def _is_not_loss_message(log_record: logging.LogRecord) -> bool:
    return not log_record.getMessage().startswith(_DEVICE_LOSS_LOG_MESSAGES)
