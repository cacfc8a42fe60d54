"""One frame's command list: passes in order, each timed under the name of its stage."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Literal

from dermis.gpu.access import Access
from dermis.gpu.compute_pass import ComputePass, Step
from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram
from dermis.gpu.raster_program import FragmentProgram, RasterProgram
from dermis.gpu.readback import Fetched
from dermis.gpu.recorder import Recorder
from dermis.gpu.timing import Timestamps, WallClock
from dermis.gpu.types import Bindings, Buffer, Texture, TextureOrView, TextureView
from dermis.gpu.uniforms import Uniforms

Timed = bool | Literal["whole"]
"""Whether stages are timed, each in a pass of its own, or the frame as it is when nobody asks, as a whole."""
_MOST_STEPS = 16  # of a pass: its records lie elsewhere when other passes before it run


class Frame(Recorder):
    """Records passes, submits them together, then knows how long each stage took.

    On software adapters each stage is submitted and waited for by itself, to time it.

    timed : False leaves the stages' times out; dispatches then share passes across stages, as they do in
        frames that are timed as a "whole", from the start of their first pass to the end of the last one.
        Software adapters can only time stages
    uniforms : for the passes' records, its own when left out
    submitted : number of the last submit, for `Device.wait`
    """

    def __init__(self, device: Device, *, timed: Timed = True, uniforms: Uniforms | None = None) -> None:
        self.device = device
        self._open: Any = None
        self._uniforms = uniforms or Uniforms(device)
        self._fetched: list[Fetched] = []
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
        groups: tuple[int, int, int],
        completes: str = "",
        access: Access | None = None,
    ) -> None:
        """Run `program` for a number of workgroups along each axis.

        completes : of account where passes are declared, see `Recorder.dispatch`
        access : of these resources, for who has it
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

    def fetch(self, buffers: Sequence[Buffer], fetched: Fetched) -> None:
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
        *,
        indices: Buffer | None = None,
        layer: int = 0,
        depth: TextureView,
        far: float,
        target: TextureOrView | None = None,
    ) -> None:
        """Rasterise `vertices` / 3 triangles into cleared targets.

        indices : buffer of the numbers of the vertices for the shader; None counts them
        layer : the instance index that the shader sees
        far : the depth that the attachment starts at
        """
        attached = {
            "view": depth,
            "depth_load_op": "clear",
            "depth_store_op": "store",
            "depth_clear_value": far,
        }
        targets = [target] if target is not None else []
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
        depth: dict[str, Any] | None = None,
    ) -> Any:
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
    def _encoder(self) -> Any:
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

    def _begin(self, stage: str) -> dict[str, Any] | None:
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


def step_of(
    stage: str, program: ComputeProgram, group: Any, offsets: Sequence[int], groups: tuple[int, int, int]
) -> Step:
    """A dispatch of a bind group with the offsets of its uniforms."""
    # as the native library takes them, so that no frame needs to convert them
    kept = program.device.ffi.new("uint32_t[]", offsets)
    return Step(stage, program.pipeline._internal, group._internal, len(offsets), kept, groups)
