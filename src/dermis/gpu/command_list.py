"""One frame's command list: passes in order, each timed under the name of its stage."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from dermis.gpu.dependencies import Access
from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, FragmentProgram, RasterProgram
from dermis.gpu.readback import BufferReadback
from dermis.gpu.recorder import DrawTarget, Groups, Recorder
from dermis.gpu.types import Bindings, Buffer, Native, Texture, TextureOrView, Untyped
from dermis.gpu.uniforms import Uniforms

Timing = bool | Literal["whole"]
"""Whether stages are timed, each in a pass of its own, or the frame as it is when nobody asks, as a whole."""

Stamp = dict[str, object]
"""Where a pass writes its timestamp, as wgpu takes it."""
_MOST_STEPS = 16  # of a pass: its records lie elsewhere when other passes before it run


class CommandList(Recorder):
    """Records passes, submits them together, then knows how long each stage took.

    On software adapters each stage is submitted and waited for by itself, to time it.

    timed : False leaves the stages' times out; dispatches then share passes across stages, as they do in
        frames that are timed as a "whole", from the start of their first pass to the end of the last one.
        Software adapters can only time stages
    uniforms : for the passes' records, its own when left out
    submitted : number of the last submit, for `Device.wait`
    """

    def __init__(self, device: Device, *, timed: Timing = True, uniforms: Uniforms | None = None) -> None:
        self.device = device
        self._open: Untyped = None
        self._uniforms = uniforms or Uniforms(device)
        self._fetched: list[BufferReadback] = []
        self.submitted = 0
        self._stage = ""
        self._pass: ComputePass | None = None
        software, whole = device.adapter.kind == "CPU", timed == "whole"
        self._wall = WallClock() if software and timed else None
        stamped = device.has_timestamps and timed and not software
        self._stamps = Timestamps(device, whole=whole) if stamped else None
        self._divided = self._wall is not None or (stamped and not whole)  # into a pass for each stage

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        groups: Groups,
        completes: str = "",
        access: Access | None = None,
    ) -> None:
        """Add a pass, see `Recorder.dispatch`.

        completes : ignored, as all passes run
        access : access of these resources, where it is known
        """
        key = stage, groups, program.places(resources, self._uniforms)
        known = access.steps if access else {}
        found = known.get(key)
        if found is None:
            if len(known) == _MOST_STEPS:
                known.clear()
            group, offsets = program.bind_group(resources, self._uniforms)
            found = known[key] = [step_of(stage, program, group, offsets, groups)], group
        self.run(found[0])

    def run(self, steps: Sequence[Step]) -> None:
        """Run dispatches whose bind groups are known."""
        if self._divided:
            for step in steps:
                self._compute_pass(step.stage).run([step])
        elif steps:
            self._compute_pass(steps[0].stage).run(steps)

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Put bytes into the start of a buffer, before what is submitted next."""
        self.device.write(buffer, data, len(data))

    def clear(self, buffer: Buffer) -> None:
        """Fill a buffer with zeros."""
        self._end_pass()
        self._encoder.clear_buffer(buffer, 0, buffer.size)

    def copy(self, buffer: Buffer, texture: Texture, *, pitch: int, layers: int) -> None:
        """Copy rows of `pitch` 4-byte pixels, layer after layer, from a buffer into a texture."""
        width, height = texture.size[:2]
        self._end_pass()
        self._encoder.copy_buffer_to_texture(
            {"buffer": buffer, "offset": 0, "bytes_per_row": 4 * pitch, "rows_per_image": height},
            {"texture": texture, "mip_level": 0, "origin": (0, 0, 0)},
            (width, height, layers),
        )

    def fetch(self, buffers: Sequence[Buffer], fetched: BufferReadback) -> None:
        """Send the bytes of buffers on their way, one after the other, as the passes so far leave them."""
        self._end_pass()
        start = 0
        for buffer in buffers:
            self._encoder.copy_buffer_to_buffer(buffer, 0, fetched.buffer, start, buffer.size)
            start += buffer.size
        self._fetched.append(fetched)

    def draw(
        self,
        stage: str,
        program: RasterProgram,
        resources: Bindings,
        vertices: int,
        target: DrawTarget,
        *,
        indices: Buffer | None = None,
        layer: int = 0,
    ) -> None:
        """Add a pass that rasterises, see `Recorder.draw`."""
        attached = {
            "view": target.depth,
            "depth_load_op": "clear",
            "depth_store_op": "store",
            "depth_clear_value": target.far,
        }
        targets = [] if target.colour is None else [target.colour]
        one = self._render_pass(stage, program, resources, targets, attached)
        if indices is None:
            one.draw(vertices, 1, 0, layer)
        else:
            one.set_index_buffer(indices, "uint32")
            one.draw_indexed(vertices, 1, 0, 0, layer)
        one.end()

    def fill(
        self, stage: str, program: FragmentProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Run `program` for each texel of its targets, textures or views of them, in a render pass."""
        views = [one.create_view() if hasattr(one, "create_view") else one for one in targets]
        one = self._render_pass(stage, program, resources, views)
        one.draw(3)
        one.end()

    def submit(self) -> None:
        """Hand the passes to the device."""
        self._end_pass()
        if self._wall and self._stage:
            self._finish_stage(self._wall)
        elif self._stamps:
            self._stamps.end(self._encoder)
            self._flush()
        else:
            self._flush()
        self._uniforms.finish()

    def wait(self) -> None:
        """Return when the device has done what was submitted."""
        self.device.wait(self.submitted)

    def stage_ms(self) -> dict[str, float] | None:
        """Time of each stage after `submit` [ms], with "total"; None when the device cannot tell."""
        clock = self._wall or self._stamps
        return clock.stage_ms() if clock else None

    def _render_pass(
        self,
        stage: str,
        program: RasterProgram | FragmentProgram,
        resources: Bindings,
        targets: Sequence[TextureOrView],
        depth: Mapping[str, object] | None = None,
    ) -> Untyped:
        """A pass over cleared targets in which `program` is about to draw."""
        cleared = {"load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
        self._end_pass()
        stamps = self._begin(stage)
        one = self._encoder.begin_render_pass(
            label=stage,
            color_attachments=[{"view": target, **cleared} for target in targets],
            depth_stencil_attachment=depth,
            timestamp_writes=stamps,
        )
        one.set_pipeline(program.pipeline)
        one.set_bind_group(0, *program.bind_group(resources, self._uniforms))
        return one

    @property
    def _encoder(self) -> Untyped:
        """Takes commands; made for the first one after each submit."""
        if self._open is None:
            self._open = self.device.command_encoder()
        return self._open

    def _compute_pass(self, stage: str) -> ComputePass:
        """The open pass, or a new one where a stage begins whose time is taken."""
        if self._divided and self._pass and stage != self._stage:
            self._end_pass()
        if not self._pass:
            stamps = self._begin(stage)
            self._pass = ComputePass(self.device, self._encoder, stage, stamps)
        return self._pass

    def _end_pass(self) -> None:
        if self._pass:
            self._pass.end()
        self._pass = None

    def _begin(self, stage: str) -> Stamp | None:
        """Enter a stage; returns what its pass writes as timestamps."""
        if self._wall and self._stage not in ("", stage):
            self._finish_stage(self._wall)
        self._stage = stage
        return self._stamps.begin(stage) if self._stamps else None

    def _finish_stage(self, wall: WallClock) -> None:
        started = time.perf_counter()
        self._flush()
        self.wait()
        wall.measure(self._stage, started)

    def _flush(self) -> None:
        self._uniforms.upload()
        self.submitted = self.device.submit(self._encoder)
        for one in self._fetched:
            one.begin(self.submitted)
        self._fetched.clear()
        self._open = None


class Step(NamedTuple):
    """A dispatch as the native library takes it.

    bound, uniforms, offsets : the bind group, how many uniforms it has, and their offsets
    groups : workgroups along each axis
    """

    stage: str
    pipeline: object
    bound: object
    uniforms: int
    offsets: object
    groups: Groups


def step_of(
    stage: str, program: ComputeProgram, group: Native, offsets: Sequence[int], groups: Groups
) -> Step:
    """A dispatch of a bind group with the offsets of its uniforms."""
    # as the native library takes them, so that no frame needs to convert them
    kept = program.device.ffi.new("uint32_t[]", offsets)
    return Step(stage, program.pipeline._internal, group._internal, len(offsets), kept, groups)


class ComputePass:
    """Dispatches in order.

    wgpu wraps each call in Python to catch its errors. Here they are caught all the same: the library keeps
    what is wrong in a pass until the encoder finishes. It also holds on to what a pass binds.
    """

    def __init__(self, device: Device, encoder: Untyped, label: str, timestamps: Stamp | None) -> None:
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


class Timestamps:
    """A timestamp at the start of each pass; a pass lasts until the next one begins, so stages add up.

    whole : True takes only the first and the last, as each takes time itself
    """

    def __init__(self, device: Device, *, whole: bool = False) -> None:
        self._device, self._whole = device, whole
        self._queries, self._resolved = device.timestamp_pool()
        self._stages: list[str] = []

    def begin(self, stage: str) -> Stamp | None:
        """A pass descriptor's `timestamp_writes`; None for no timestamp."""
        full = len(self._stages) >= self._queries.count - 1  # the last one is for the end
        if full or (self._whole and self._stages):
            return None
        return self._mark(stage)

    def _mark(self, stage: str) -> Stamp:
        self._stages.append(stage)
        return {"query_set": self._queries, "beginning_of_pass_write_index": len(self._stages) - 1}

    def end(self, encoder: Untyped) -> None:
        """Mark the end of the last pass and resolve the timestamps."""
        if self._stages:
            encoder.begin_compute_pass(label="end", timestamp_writes=self._mark("end")).end()
            encoder.resolve_query_set(self._queries, 0, len(self._stages), self._resolved, 0)

    def stage_ms(self) -> dict[str, float]:
        """Time of each stage, unless only the whole is timed, and "total" [ms]."""
        if not self._stages:
            return {"total": 0.0}
        raw = self._device.handle.queue.read_buffer(self._resolved, 0, 8 * len(self._stages))
        ticks = np.frombuffer(raw, dtype=np.uint64).astype(np.int64)
        ms = 1e-6 * self._device.timestamp_period_ns
        times: dict[str, float] = {}
        for stage, lasted in zip(self._stages, np.diff(ticks), strict=False):
            times[stage] = times.get(stage, 0.0) + float(lasted) * ms
        times = {} if self._whole else times
        times["total"] = float(ticks[-1] - ticks[0]) * ms
        return times


class WallClock:
    """The time from submitting a stage to its end.

    For software adapters: Mesa stamps compute passes before their work is done; waiting costs nothing there.
    """

    def __init__(self) -> None:
        self._times: dict[str, float] = {}

    def measure(self, stage: str, started: float) -> None:
        """Add the time since `started` (time.perf_counter) to the stage."""
        self._times[stage] = self._times.get(stage, 0.0) + 1e3 * (time.perf_counter() - started)

    def stage_ms(self) -> dict[str, float]:
        """Time of each stage, and "total" [ms]."""
        return self._times | {"total": sum(self._times.values())}
