"""One frame's command list: passes in order, each timed under the name of its stage."""

from __future__ import annotations

import time
from typing import Any

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, RasterProgram, Resources
from dermis.gpu.timing import Timestamps, WallClock


class Frame:
    """Records passes, submits them together, then knows how long each stage took.

    On software adapters each stage is submitted and waited for by itself, to time it.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._encoder = device.handle.create_command_encoder()
        self._stage = ""
        self._wall = WallClock() if device.adapter.kind == "CPU" else None
        self._stamps = Timestamps(device) if device.has_timestamps and not self._wall else None

    def compute(
        self, stage: str, program: ComputeProgram, resources: Resources, size: tuple[int, int], tile: int = 8
    ) -> None:
        """Run `program` once for each of size[0] x size[1] invocations, in tiles of `tile` squared."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1))

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Resources, groups: tuple[int, int, int]
    ) -> None:
        """Run `program` for a number of workgroups along each axis."""
        stamps = self._begin(stage)
        one = self._encoder.begin_compute_pass(label=stage, timestamp_writes=stamps)
        one.set_pipeline(program.pipeline)
        for index, group in enumerate(program.bind_groups(resources)):
            one.set_bind_group(index, group)
        one.dispatch_workgroups(*groups)
        one.end()

    def clear(self, buffer: Any) -> None:
        """Fill a buffer with zeros."""
        self._encoder.clear_buffer(buffer, 0, buffer.size)

    def copy(self, buffer: Any, texture: Any, *, pitch: int, layers: int) -> None:
        """Copy rows of `pitch` 4-byte pixels, layer after layer, from a buffer into a texture."""
        width, height = texture.size[:2]
        self._encoder.copy_buffer_to_texture(
            {"buffer": buffer, "offset": 0, "bytes_per_row": 4 * pitch, "rows_per_image": height},
            {"texture": texture, "mip_level": 0, "origin": (0, 0, 0)},
            (width, height, layers),
        )

    def draw(
        self,
        stage: str,
        program: RasterProgram,
        resources: Resources,
        vertices: int,
        *,
        layer: int = 0,
        depth: Any,
        far: float,
        target: Any = None,
    ) -> None:
        """Rasterise `vertices` / 3 triangles into cleared targets.

        layer : the instance index that the shader sees
        far : the depth that the attachment starts at
        """
        colour = [{"view": target, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}]
        stamps = self._begin(stage)
        one = self._encoder.begin_render_pass(
            label=stage,
            color_attachments=colour if target is not None else [],
            depth_stencil_attachment={
                "view": depth,
                "depth_load_op": "clear",
                "depth_store_op": "store",
                "depth_clear_value": far,
            },
            timestamp_writes=stamps,
        )
        one.set_pipeline(program.pipeline)
        for index, group in enumerate(program.bind_groups(resources)):
            one.set_bind_group(index, group)
        one.draw(vertices, 1, 0, layer)
        one.end()

    def submit(self) -> None:
        """Hand the passes to the device."""
        if self._wall and self._stage:
            self._finish_stage(self._wall)
        elif self._stamps:
            self._stamps.end(self._encoder)
            self._flush()
        else:
            self._flush()

    def wait(self) -> None:
        """Return when the device has done all that was submitted."""
        self.device.wait()

    def stage_ms(self) -> dict[str, float] | None:
        """Time of each stage after `submit` [ms], with "total"; None when the device cannot tell."""
        clock = self._wall or self._stamps
        return clock.stage_ms() if clock else None

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
        self.device.handle.queue.submit([self._encoder.finish()])
        self._encoder = self.device.handle.create_command_encoder()
