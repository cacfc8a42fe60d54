"""A compute pass that is quick to record: a frame's hundred calls go straight to the native library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


class ComputePass:
    """Dispatches in order.

    wgpu wraps each call in Python to catch its errors. Here they are caught all the same: the library keeps
    what is wrong in a pass until the encoder finishes.
    """

    def __init__(self, encoder: Any, label: str, timestamps: Any) -> None:
        from wgpu.backends.wgpu_native import lib

        self._lib = lib
        self._pass = encoder.begin_compute_pass(label=label, timestamp_writes=timestamps)
        self._handle = self._pass._internal
        self._pipeline: Any = None
        self._kept: list[Any] = []  # until the pass ends

    def set_pipeline(self, pipeline: Any) -> None:
        """Choose what the next dispatches run."""
        if pipeline is not self._pipeline:
            self._lib.wgpuComputePassEncoderSetPipeline(self._handle, pipeline._internal)
            self._pipeline = pipeline
            self._kept.append(pipeline)

    def set_bind_group(self, index: int, group: Any, offsets: Sequence[int]) -> None:
        """Choose what the next dispatches read and write; `offsets` of its uniforms."""
        self._lib.wgpuComputePassEncoderSetBindGroup(
            self._handle, index, group._internal, len(offsets), offsets
        )
        self._kept.append(group)

    def dispatch(self, groups: tuple[int, int, int]) -> None:
        """Run a number of workgroups along each axis."""
        self._lib.wgpuComputePassEncoderDispatchWorkgroups(self._handle, *groups)

    def end(self) -> None:
        """Close the pass."""
        self._pass.end()
        self._kept.clear()
