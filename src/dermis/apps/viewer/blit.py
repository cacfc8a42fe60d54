"""Copies rendered images into the window's texture, on the device."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dermis.gpu import Device
from dermis.gpu.program import Program

Box = tuple[int, int, int, int]
"""Left, top, width and height [pixel]."""


class Patch(NamedTuple):
    """An image scaled to a box of the target, and the part of that box that is drawn.

    image : texture of sRGB bytes
    """

    image: Any
    box: Box
    shown: Box


class Blit(Program):
    """Draws byte images into targets of one format."""

    def __init__(self, device: Device, target: str) -> None:
        super().__init__(device, Path(__file__).parent / "blit.wgsl")
        fragment = {
            "module": self._module,
            "entry_point": "fragment",
            "constants": {"DECODED": target.endswith("-srgb")},
            "targets": [{"format": target}],
        }
        self._pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
            fragment=fragment,
            primitive={"topology": "triangle-list", "cull_mode": "none"},
        )

    def draw(self, patches: Sequence[Patch], view: Any) -> None:
        """Draw patches on black.

        view : of the target texture
        """
        encoder = self.device.handle.create_command_encoder()
        target = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        render_pass = encoder.begin_render_pass(label="blit", color_attachments=[target])
        render_pass.set_pipeline(self._pipeline)
        for patch in patches:
            render_pass.set_viewport(*patch.box, 0.0, 1.0)
            render_pass.set_scissor_rect(*patch.shown)
            entry = {"binding": 0, "resource": patch.image.create_view()}
            group = self.device.handle.create_bind_group(layout=self._group_layout, entries=[entry])
            render_pass.set_bind_group(0, group)
            render_pass.draw(3)
        render_pass.end()
        self.device.handle.queue.submit([encoder.finish()])

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.VERTEX | wgpu.ShaderStage.FRAGMENT)
