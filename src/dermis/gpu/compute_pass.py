"""A compute pass that is quick to record: its calls go straight to the native library."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from dermis.gpu.device import Device


class Step(NamedTuple):
    """A dispatch as the native library takes it.

    bound, uniforms, offsets : the bind group, how many uniforms it has, and their offsets
    groups : workgroups along each axis
    """

    stage: str
    pipeline: Any
    bound: Any
    uniforms: int
    offsets: Any
    groups: tuple[int, int, int]


class ComputePass:
    """Dispatches in order.

    wgpu wraps each call in Python to catch its errors. Here they are caught all the same: the library keeps
    what is wrong in a pass until the encoder finishes. It also holds on to what a pass binds.
    """

    def __init__(self, device: Device, encoder: Any, label: str, timestamps: Any) -> None:
        self._lib = lib = device.lib
        if timestamps is None:
            begun = lib.wgpuCommandEncoderBeginComputePass(encoder._internal, device.ffi.NULL)
            self._handle = device.ffi.gc(begun, lib.wgpuComputePassEncoderRelease)
        else:
            self._pass = encoder.begin_compute_pass(label=label, timestamp_writes=timestamps)
            self._handle = self._pass._internal

    def run(self, steps: Iterable[Step]) -> None:
        """Run pipelines one after the other."""
        handle, set_pipeline = self._handle, self._lib.wgpuComputePassEncoderSetPipeline
        set_bind_group = self._lib.wgpuComputePassEncoderSetBindGroup
        dispatch = self._lib.wgpuComputePassEncoderDispatchWorkgroups
        for _, pipeline, bound, uniforms, offsets, (x, y, z) in steps:
            set_pipeline(handle, pipeline)
            set_bind_group(handle, 0, bound, uniforms, offsets)
            dispatch(handle, x, y, z)

    def end(self) -> None:
        """Close the pass."""
        self._lib.wgpuComputePassEncoderEnd(self._handle)
