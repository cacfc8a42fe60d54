"""One frame's command list: passes in order, each timed under the name of its stage."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, RasterProgram, Resources


class Frame:
    """Records passes, submits them together, then knows how long each stage took."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._encoder = device.handle.create_command_encoder()
        self._stages: list[str] = []
        self._queries: Any = None
        self._resolved: Any = None
        if device.has_timestamps:
            self._queries, self._resolved = device.timestamp_pool()

    def compute(
        self, stage: str, program: ComputeProgram, resources: Resources, size: tuple[int, int], tile: int = 8
    ) -> None:
        """Run `program` once for each of size[0] x size[1] invocations, in tiles of `tile` squared."""
        self.dispatch(stage, program, resources, (*program.groups_for(size, tile), 1))

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Resources, groups: tuple[int, int, int]
    ) -> None:
        """Run `program` for a number of workgroups along each axis."""
        one = self._encoder.begin_compute_pass(label=stage, timestamp_writes=self._timing(stage))
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
        one = self._encoder.begin_render_pass(
            label=stage,
            color_attachments=colour if target is not None else [],
            depth_stencil_attachment={
                "view": depth,
                "depth_load_op": "clear",
                "depth_store_op": "store",
                "depth_clear_value": far,
            },
            timestamp_writes=self._timing(stage),
        )
        one.set_pipeline(program.pipeline)
        for index, group in enumerate(program.bind_groups(resources)):
            one.set_bind_group(index, group)
        one.draw(vertices, 1, 0, layer)
        one.end()

    def submit(self) -> None:
        """Hand the passes to the device."""
        if self._queries is not None and self._stages:
            end = self._encoder.begin_compute_pass(label="end", timestamp_writes=self._timing("end"))
            end.end()
            self._encoder.resolve_query_set(self._queries, 0, len(self._stages), self._resolved, 0)
        self.device.handle.queue.submit([self._encoder.finish()])

    def wait(self) -> None:
        """Return when the device has done all that was submitted."""
        # wgpu 0.32's own wait for submitted work raises TypeError; a read waits for all that came before it.
        self.device.handle.queue.read_buffer(self.device.fence)

    def stage_ms(self) -> dict[str, float] | None:
        """Device time of each stage after `submit` [ms], with "total"; None without timestamps.

        A pass lasts until the next one begins, so the stages add up to the total. (Mesa's software adapter
        stamps the end of a compute pass before its work is done; the next pass' start is right everywhere.)
        """
        if self._queries is None or not self._stages:
            return None
        raw = self.device.handle.queue.read_buffer(self._resolved, 0, 8 * len(self._stages))
        ticks = np.frombuffer(raw, dtype=np.uint64).astype(np.int64)
        times: dict[str, float] = {}
        for stage, lasted in zip(self._stages, np.diff(ticks), strict=False):
            times[stage] = times.get(stage, 0.0) + float(lasted) * 1e-6
        times["total"] = float(ticks[-1] - ticks[0]) * 1e-6
        return times

    def _timing(self, stage: str) -> dict[str, Any] | None:
        if self._queries is None or len(self._stages) >= self._queries.count:
            return None
        self._stages.append(stage)
        return {"query_set": self._queries, "beginning_of_pass_write_index": len(self._stages) - 1}
