"""Command list of one frame: passes in order of execution, with GPU times per stage."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from dermis.gpu.dependencies import Access
from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, RenderProgram
from dermis.gpu.readback import BufferReadback
from dermis.gpu.recorder import DrawTarget, Recorder, Workgroups
from dermis.gpu.types import Bindings, Buffer, NativeObject, Texture, TextureOrView, Untyped
from dermis.gpu.uniforms import Uniforms

Timing = bool | Literal["whole"]
"""True times each stage in a pass of its own, "whole" times only the frame, False times nothing."""

TimestampWrites = dict[str, object]
"""The member `timestamp_writes` of wgpu's pass descriptors."""
_MAX_CACHED_DISPATCHES = 16  # for each pass: its record positions depend on which passes run before it


class CommandList(Recorder):
    """Recorder that encodes passes, submits them together and measures the time of each stage.

    Stages that are not timed individually share compute passes. On software adapters, each timed stage is
    submitted separately, and the host waits until it has finished.

    timed : True to time each stage, "whole" to time only the frame, False for no timing; on software
        adapters, "whole" has the effect of True
    uniforms : uniform memory for the records of the passes; None to allocate new memory
    submitted : number of the last submission, for `Device.wait`
    """

    def __init__(self, device: Device, *, timed: Timing = True, uniforms: Uniforms | None = None) -> None:
        self.device = device
        self._open_encoder: Untyped = None
        self._uniforms = uniforms or Uniforms(device)
        self._readbacks: list[BufferReadback] = []
        self.submitted = 0
        self._stage = ""
        self._pass: ComputePass | None = None
        is_software, whole_frame_only = device.adapter.kind == "CPU", timed == "whole"
        self._wall_clock = WallClock() if is_software and timed else None
        has_timestamps = device.has_timestamps and timed and not is_software
        self._timestamps = Timestamps(device, whole_frame_only=whole_frame_only) if has_timestamps else None
        self._splits_stages = self._wall_clock is not None or (has_timestamps and not whole_frame_only)

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
        access: Access | None = None,
    ) -> None:
        """Add a dispatch of a compute program, see `Recorder.dispatch`.

        in_place_resource : ignored; only the frame graph needs it, to find passes with outdated output
        access : `Access` of the program to these resources, which caches the native dispatch for later frames
        """
        key = stage, workgroups, program.uniform_record_positions(resources, self._uniforms)
        known = access.dispatches if access else {}
        found = known.get(key)
        if found is None:
            if len(known) == _MAX_CACHED_DISPATCHES:
                known.clear()
            group, offsets = program.bind_group(resources, self._uniforms)
            found = known[key] = [make_dispatch(stage, program, group, offsets, workgroups)], group
        self.run(found[0])

    def run(self, dispatches: Sequence[Dispatch]) -> None:
        """Add dispatches that `make_dispatch` prepared."""
        if self._splits_stages:
            for one in dispatches:
                self._compute_pass(one.stage).run([one])
        elif dispatches:
            self._compute_pass(dispatches[0].stage).run(dispatches)

    def write(self, stage: str, buffer: Buffer, content: bytes) -> None:
        """Write bytes from the host to the start of a buffer, before the next submission runs."""
        self.device.write(buffer, content, len(content))

    def clear(self, buffer: Buffer) -> None:
        """Add a command that sets all bytes of a buffer to zero."""
        self._end_pass()
        self._encoder.clear_buffer(buffer, 0, buffer.size)

    def copy(self, buffer: Buffer, texture: Texture, *, row_texels: int, layer_count: int) -> None:
        """Add a copy from a buffer to all texels of a texture with 4 bytes per texel.

        row_texels : row length in the buffer [texel]
        layer_count : number of texture layers to copy
        """
        width, height = texture.size[:2]
        self._end_pass()
        self._encoder.copy_buffer_to_texture(
            {"buffer": buffer, "offset": 0, "bytes_per_row": 4 * row_texels, "rows_per_image": height},
            {"texture": texture, "mip_level": 0, "origin": (0, 0, 0)},
            (width, height, layer_count),
        )

    def read_back(self, buffers: Sequence[Buffer], readback: BufferReadback) -> None:
        """Copy buffers, one after another, to a readback, which the CPU can map after submission."""
        self._end_pass()
        start = 0
        for buffer in buffers:
            self._encoder.copy_buffer_to_buffer(buffer, 0, readback.buffer, start, buffer.size)
            start += buffer.size
        self._readbacks.append(readback)

    def draw(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        vertex_count: int,
        target: DrawTarget,
        *,
        index_buffer: Buffer | None = None,
        instance_index: int = 0,
    ) -> None:
        """Add a render pass of triangles, see `Recorder.draw`."""
        depth = {
            "view": target.depth,
            "depth_load_op": "clear",
            "depth_store_op": "store",
            "depth_clear_value": target.clear_depth,
        }
        targets = [] if target.colour is None else [target.colour]
        render_pass = self._render_pass(stage, program, resources, targets, depth)
        if index_buffer is None:
            render_pass.draw(vertex_count, 1, 0, instance_index)
        else:
            render_pass.set_index_buffer(index_buffer, "uint32")
            render_pass.draw_indexed(vertex_count, 1, 0, 0, instance_index)
        render_pass.end()

    def draw_fullscreen(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Add a pass that runs a program once per texel of its targets, see `Recorder.draw_fullscreen`."""
        views = [one.create_view() if hasattr(one, "create_view") else one for one in targets]
        render_pass = self._render_pass(stage, program, resources, views)
        render_pass.draw(3)
        render_pass.end()

    def submit(self) -> None:
        """Submit all passes to the device's queue."""
        self._end_pass()
        if self._wall_clock and self._stage:
            self._end_stage(self._wall_clock)
        else:
            if self._timestamps:
                self._timestamps.end(self._encoder)
            self._flush()
        self._uniforms.finish()

    def wait(self) -> None:
        """Wait until the device has finished the last submission."""
        self.device.wait(self.submitted)

    def stage_ms(self) -> dict[str, float] | None:
        """Return the times of the whole frame ("total") and of its stages, after `submit` [ms].

        Returns None if the frame is not timed.
        """
        clock = self._wall_clock or self._timestamps
        return clock.stage_ms() if clock else None

    def _render_pass(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        targets: Sequence[TextureOrView],
        depth_attachment: Mapping[str, object] | None = None,
    ) -> Untyped:
        """Begin a render pass that clears its targets, set its pipeline and bind group; return its encoder.

        targets : colour attachments, which are cleared to 0
        depth_attachment : wgpu's description of the depth attachment; None for a pass without depth
        """
        cleared = {"load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
        self._end_pass()
        timestamps = self._begin_stage(stage)
        render_pass = self._encoder.begin_render_pass(
            label=stage,
            color_attachments=[{"view": target, **cleared} for target in targets],
            depth_stencil_attachment=depth_attachment,
            timestamp_writes=timestamps,
        )
        render_pass.set_pipeline(program.pipeline)
        render_pass.set_bind_group(0, *program.bind_group(resources, self._uniforms))
        return render_pass

    @property
    def _encoder(self) -> Untyped:
        """Return the open command encoder; create one if none has been opened since the last submission."""
        if self._open_encoder is None:
            self._open_encoder = self.device.command_encoder()
        return self._open_encoder

    def _compute_pass(self, stage: str) -> ComputePass:
        """Return the open compute pass, or begin a pass; each timed stage gets a separate pass."""
        if self._splits_stages and self._pass and stage != self._stage:
            self._end_pass()
        if not self._pass:
            timestamps = self._begin_stage(stage)
            self._pass = ComputePass(self.device, self._encoder, stage, timestamps)
        return self._pass

    def _end_pass(self) -> None:
        if self._pass:
            self._pass.end()
        self._pass = None

    def _begin_stage(self, stage: str) -> TimestampWrites | None:
        """Begin a stage; return wgpu's description of the timestamps that its pass writes, None for none."""
        if self._wall_clock and self._stage not in ("", stage):
            self._end_stage(self._wall_clock)
        self._stage = stage
        return self._timestamps.begin(stage) if self._timestamps else None

    def _end_stage(self, wall_clock: WallClock) -> None:
        started = time.perf_counter()
        self._flush()
        self.wait()
        wall_clock.add_stage_time(self._stage, started)

    def _flush(self) -> None:
        self._uniforms.upload()
        self.submitted = self.device.submit(self._encoder)
        for one in self._readbacks:
            one.start(self.submitted)
        self._readbacks.clear()
        self._open_encoder = None


class Dispatch(NamedTuple):
    """Arguments of a compute dispatch, as native handles.

    stage : name of the stage
    pipeline : native handle of the pipeline
    bind_group : native handle of the bind group
    uniforms : number of dynamic uniform offsets
    offsets : C array of these offsets [byte]
    groups : workgroups along each axis
    """

    stage: str
    pipeline: object
    bind_group: object
    uniforms: int
    offsets: object
    groups: Workgroups


def make_dispatch(
    stage: str,
    program: ComputeProgram,
    bind_group: NativeObject,
    record_offsets: Sequence[int],
    workgroups: Workgroups,
) -> Dispatch:
    """Return the native arguments for a dispatch of a program.

    stage : name of the stage, under which the dispatch is timed
    bind_group : bind group of the program
    record_offsets : offsets of the uniform records in their buffers [byte]
    workgroups : workgroups along each axis
    """
    native_offsets = program.device.ffi.new("uint32_t[]", record_offsets)
    return Dispatch(
        stage,
        program.pipeline._internal,
        bind_group._internal,
        len(record_offsets),
        native_offsets,
        workgroups,
    )


class ComputePass:
    """Compute pass that is encoded by direct calls of the native library, for speed.

    wgpu wraps each call in Python to check for errors. Skipping this wrapper loses no errors, because the
    native library collects the errors of a pass and reports them when the encoder finishes. The native
    library also keeps the bound resources alive.
    """

    def __init__(
        self, device: Device, encoder: Untyped, label: str, timestamps: TimestampWrites | None
    ) -> None:
        self._lib = lib = device.lib
        if timestamps is None:
            handle = lib.wgpuCommandEncoderBeginComputePass(encoder._internal, device.ffi.NULL)
            self._handle = device.ffi.gc(handle, lib.wgpuComputePassEncoderRelease)
        else:
            self._pass = encoder.begin_compute_pass(label=label, timestamp_writes=timestamps)
            self._handle = self._pass._internal

    def run(self, dispatches: Iterable[Dispatch]) -> None:
        """Encode dispatches in order."""
        handle, set_pipeline = self._handle, self._lib.wgpuComputePassEncoderSetPipeline
        set_bind_group = self._lib.wgpuComputePassEncoderSetBindGroup
        dispatch_workgroups = self._lib.wgpuComputePassEncoderDispatchWorkgroups
        for _, pipeline, bind_group, uniforms, offsets, (x, y, z) in dispatches:
            set_pipeline(handle, pipeline)
            set_bind_group(handle, 0, bind_group, uniforms, offsets)
            dispatch_workgroups(handle, x, y, z)

    def end(self) -> None:
        """End the pass, after which no dispatch can be added."""
        self._lib.wgpuComputePassEncoderEnd(self._handle)


class Timestamps:
    """GPU timestamps at the start of each pass, from which the times of stages are computed.

    The time of a pass extends to the start of the next pass, so that the times of the stages sum to the
    total.

    whole_frame_only : whether to take only the first and the last timestamp of a frame, which takes less time
        than one for each pass
    """

    def __init__(self, device: Device, *, whole_frame_only: bool = False) -> None:
        self._device, self._whole_frame_only = device, whole_frame_only
        self._queries, self._resolved = device.timestamp_pool()
        self._stages: list[str] = []

    def begin(self, stage: str) -> TimestampWrites | None:
        """Reserve the timestamp at the start of a pass, and return its description for wgpu.

        Returns None if the pass gets no timestamp. This is so if the pool has no timestamps left, and, with
        `whole_frame_only`, for all passes except the first.

        stage : name of the stage to which the time of the pass is added
        """
        is_full = len(self._stages) >= self._queries.count - 1  # the last one is for the end
        if is_full or (self._whole_frame_only and self._stages):
            return None
        return self._add_timestamp(stage)

    def _add_timestamp(self, stage: str) -> TimestampWrites:
        self._stages.append(stage)
        return {"query_set": self._queries, "beginning_of_pass_write_index": len(self._stages) - 1}

    def end(self, encoder: Untyped) -> None:
        """Encode the final timestamp and the copy of all timestamps to a buffer."""
        if self._stages:
            encoder.begin_compute_pass(label="end", timestamp_writes=self._add_timestamp("end")).end()
            encoder.resolve_query_set(self._queries, 0, len(self._stages), self._resolved, 0)

    def stage_ms(self) -> dict[str, float]:
        """Return the time of the frame ("total"), and of each stage unless `whole_frame_only` is set [ms]."""
        if not self._stages:
            return {"total": 0.0}
        raw = self._device.handle.queue.read_buffer(self._resolved, 0, 8 * len(self._stages))
        ticks = np.frombuffer(raw, dtype=np.uint64).astype(np.int64)
        tick_ms = 1e-6 * self._device.timestamp_period_ns
        times: dict[str, float] = {}
        for stage, duration in zip(self._stages, np.diff(ticks), strict=False):
            times[stage] = times.get(stage, 0.0) + float(duration) * tick_ms
        times = {} if self._whole_frame_only else times
        times["total"] = float(ticks[-1] - ticks[0]) * tick_ms
        return times


class WallClock:
    """Host time from the submission of each stage to its end, for software adapters.

    Timestamps are unsuitable, because Mesa writes the timestamps of compute passes before their work is done.
    Waiting for each stage does not slow down rendering in software.
    """

    def __init__(self) -> None:
        self._times: dict[str, float] = {}

    def add_stage_time(self, stage: str, start_time: float) -> None:
        """Add the time since `start_time`, a result of time.perf_counter, to the time of a stage."""
        self._times[stage] = self._times.get(stage, 0.0) + 1e3 * (time.perf_counter() - start_time)

    def stage_ms(self) -> dict[str, float]:
        """Return the time of each stage and their sum ("total") [ms]."""
        return self._times | {"total": sum(self._times.values())}
