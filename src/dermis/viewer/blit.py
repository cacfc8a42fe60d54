"""Copies rendered images into the window's texture, on the device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dermis.gpu import Device
from dermis.gpu.program import Program

Box = tuple[int, int, int, int]
"""Left, top, width and height [pixel]."""


@dataclass(frozen=True)
class Patch:
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
        whole = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        one = encoder.begin_render_pass(label="blit", color_attachments=[whole])
        one.set_pipeline(self._pipeline)
        for patch in patches:
            one.set_viewport(*patch.box, 0.0, 1.0)
            one.set_scissor_rect(*patch.shown)
            one.set_bind_group(0, self._group(patch.image))
            one.draw(3)
        one.end()
        self.device.handle.queue.submit([encoder.finish()])

    def _group(self, image: Any) -> Any:
        entry = {"binding": 0, "resource": image.create_view()}
        return self.device.handle.create_bind_group(layout=self._group_layout, entries=[entry])

    def _visibility(self) -> int:
        import wgpu

        return int(wgpu.ShaderStage.VERTEX | wgpu.ShaderStage.FRAGMENT)
